"""What a robot reads of a human pose, and how plausible that is."""

from __future__ import annotations

import functools
from pathlib import Path

import pytest
import torch

from mrhubo.body import BodyPrior
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import load_config
from mrhubo.motion import Motion, read_motion, reshare
from mrhubo.retargeter.spoiling import bent_backwards
from mrhubo.robot import BodyMap, build_body_map
from mrhubo.robot.plausibility import read, read_phi, read_pose, turned_joints
from mrhubo.rotation import axis_angle_to_matrix

ROBOTS = ["nao", "coman", "reachy"]


@pytest.fixture(scope="module")
def prior() -> BodyPrior:
    return BodyPrior.open()


@pytest.fixture(scope="module")
def motion(root: Path) -> Motion:
    return read_motion(root / "data" / "motions" / "conversation.npz")


@functools.cache
def body_map_of(root: Path, name: str) -> BodyMap:
    return build_body_map(load_config(root / "conf" / f"{name}.yaml").robot)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_pose_that_is_read_has_the_directions_and_nothing_else(root: Path, name: str, motion: Motion) -> None:
    body_map = body_map_of(root, name)
    direction_BD3 = body_map.human_directions(motion.local_TJ33[::20])
    pose_BJ33 = read_pose(body_map, direction_BD3)
    columns = body_map.measured
    found = body_map.human_directions(pose_BJ33)[:, columns]
    torch.testing.assert_close(found, direction_BD3[:, columns], atol=2e-5, rtol=0)
    turned = turned_joints(body_map.keypoints.parts)
    others = [i for i in range(len(POSED_JOINT_NAMES)) if i not in turned]
    torch.testing.assert_close(pose_BJ33[:, others], torch.eye(3).expand(len(pose_BJ33), len(others), 3, 3))


@pytest.mark.parametrize("name", ROBOTS)
def test_phi_is_the_same_however_rotations_are_shared(root: Path, name: str, motion: Motion, prior: BodyPrior) -> None:
    body_map = body_map_of(root, name)
    phi_B, reshared_B = (
        read_phi(body_map, prior, body_map.human_directions(m.local_TJ33[::20])) for m in (motion, reshare(motion, 2))
    )
    assert float((phi_B - reshared_B).abs().median()) < 1e-5
    assert float((phi_B - reshared_B).abs().max()) < 0.1 * float(phi_B.max())  # at straight elbows twist is read


def test_legs_have_no_say(root: Path, motion: Motion, prior: BodyPrior) -> None:
    body_map, local_BJ33 = body_map_of(root, "nao"), motion.local_TJ33[::20]
    legs = [i for i, n in enumerate(POSED_JOINT_NAMES) if n.split("_")[-1] in ("hip", "knee", "ankle", "foot")]
    kicking = local_BJ33.clone()
    kicking[:, legs] = axis_angle_to_matrix(torch.randn(len(kicking), len(legs), 3))
    phi_B, kicking_B = (read_phi(body_map, prior, body_map.human_directions(x)) for x in (local_BJ33, kicking))
    torch.testing.assert_close(phi_B, kicking_B, atol=1e-6, rtol=1e-4)


@pytest.mark.parametrize("name", ["nao", "reachy"])
def test_elbows_bent_backwards_are_no_humans(root: Path, name: str, motion: Motion, prior: BodyPrior) -> None:
    body_map, local_BJ33 = body_map_of(root, name), motion.local_TJ33[::10]
    angle_B = torch.linspace(30, 90, len(local_BJ33))
    backwards = bent_backwards(local_BJ33, angle_B, body_map.keypoints.parts)
    joints = turned_joints(body_map.keypoints.parts)
    whole, broken = (read(body_map, prior, body_map.human_directions(x)) for x in (local_BJ33, backwards))
    assert float(broken.phi(joints).quantile(0.1)) > float(whole.phi(joints).quantile(0.9))
    assert float(whole.excess(joints).max()) < 0.35
    assert float(broken.excess(joints).mean()) > 3 * float(whole.excess(joints).mean()) + 0.1


def test_a_robot_whose_elbow_is_no_hinge_is_read_as_a_human_too(root: Path, motion: Motion) -> None:
    """The pose that is read bends about a human's axis, whether or not the robot has one."""
    body_map = body_map_of(root, "nao")
    pose_BJ33 = read_pose(body_map, body_map.human_directions(motion.local_TJ33[::20]))
    body_map.shared.names = tuple("" if "axis" in name else name for name in body_map.shared.names)
    without = read_pose(body_map, body_map.human_directions(motion.local_TJ33[::20]))
    bent = (motion.local_TJ33[::20, POSED_JOINT_NAMES.index("left_elbow")].diagonal(dim1=1, dim2=2).sum(1) - 1) / 2
    clearly = bent < 0.9
    assert int(clearly.sum()) > 5
    torch.testing.assert_close(without[clearly][:, 15], pose_BJ33[clearly][:, 15], atol=0.1, rtol=0)
