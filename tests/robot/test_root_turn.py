"""What a waist cannot do of a bent back, the base does: the chest, its legs and its arms point in the world as they are to."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import pytest
import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body.skeleton import JOINT_NAMES, POSED_JOINT_NAMES
from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.robot import BodyMap, align_pose, build_body_map
from mrhubo.robot.parts import CHEST
from mrhubo.robot.root_turn import RootTurn, is_turned_back
from tests.reference.walkers import ROOTS, entries, walker

ROBOTS = ["nao-whole-body", "coman-whole-body"]


def people(frames: int = 60) -> Tensor:
    """Local rotations of people who bend and turn, their backs by up to 90 degrees or so."""
    turns = 0.4 * torch.randn(frames, len(POSED_JOINT_NAMES), 3, generator=torch.Generator().manual_seed(3))
    turns[:10, [POSED_JOINT_NAMES.index(f"spine{k}") for k in (1, 2, 3)]] = 0.0
    return rotation.axis_angle_to_matrix(turns)


@functools.cache
def shipped(root: Path, name: str, follows: str) -> BodyMap:
    return build_body_map(load_config(root / "conf" / f"{name}.yaml", [f"robot.root_follows={follows}"]).robot)


def root_turn(body_map: BodyMap) -> RootTurn:
    found = body_map.shared.root_turn
    assert found is not None
    return found


def chest(body_map: BodyMap, local_BJ33: Tensor) -> Tensor:
    return body_map.skeleton.global_rotations(local_BJ33)[:, JOINT_NAMES.index(CHEST.joint)]


def nearness(reached_B33: Tensor, wanted_B33: Tensor) -> Tensor:
    """Sum of the cosines of forward and up."""
    return (reached_B33 * wanted_B33)[..., 1:].sum((-1, -2))


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("follows", ["chest", "between"])
def test_legs_point_in_the_world_as_the_persons_and_the_rest_is_as_it_was(root: Path, name: str, follows: str) -> None:
    plain, other, poses = shipped(root, name, "pelvis"), shipped(root, name, follows), people()
    assert plain.shared.root_turn is None
    plain_BD3, other_BD3, turn_B33 = (
        plain.human_directions(poses),
        other.human_directions(poses),
        root_turn(other)(poses),
    )
    legs = torch.tensor([is_turned_back(direction.part) for direction in other.directions])
    assert {d.part.region for d, leg in zip(other.directions, legs, strict=True) if leg} == {"leg", "foot", "bend"}
    torch.testing.assert_close(other_BD3[:, legs] @ turn_B33.mT, plain_BD3[:, legs], atol=1e-5, rtol=0)
    assert torch.equal(other_BD3[:, ~legs], plain_BD3[:, ~legs])
    assert float(rotation.geodesic_distance(turn_B33, torch.eye(3)).max()) > 0.3  # it does turn


def test_a_chest_that_no_waist_turns_is_the_persons_or_half_way(root: Path) -> None:
    poses = people()
    whole, half = (root_turn(shipped(root, "nao-whole-body", follows))(poses) for follows in ("chest", "between"))
    torch.testing.assert_close(whole, chest(shipped(root, "nao-whole-body", "chest"), poses), atol=1e-5, rtol=0)
    torch.testing.assert_close(half @ half, whole, atol=1e-5, rtol=0)
    angle = rotation.geodesic_distance(whole, torch.eye(3))
    torch.testing.assert_close(rotation.geodesic_distance(half, torch.eye(3)), angle / 2, atol=1e-5, rtol=0)


def test_what_a_waist_can_do_is_left_to_it_and_it_does_the_most_it_can(root: Path) -> None:
    """Whatever its angles, none of many others comes nearer; and where one of its own poses is asked for, it is that."""
    body_map = shipped(root, "coman-whole-body", "chest")
    robot, turn = body_map.robot, root_turn(body_map)
    poses = robot.forward(robot.sample(400, torch.Generator().manual_seed(0)))
    pelvis_B33, chest_B33 = (
        poses.rotation_BL33[:, robot.link_index(body_map.keypoints.ends[name].link)] for name in ("pelvis", "chest")
    )
    axes = [body_map.shared.view_axes_V33[body_map.shared.views.index(name)] for name in ("pelvis", "chest")]
    own_B33 = ((pelvis_B33 @ axes[0]).mT @ chest_B33 @ axes[1]).double()
    assert float(rotation.geodesic_distance(turn.reached(own_B33), own_B33).max()) < 1e-3
    asked_B33 = chest(body_map, people()).double()
    best_B = nearness(turn.reached(asked_B33), asked_B33)
    others_BX = nearness(own_B33[None], asked_B33[:, None])
    assert float((others_BX - best_B[:, None]).max()) < 1e-6
    assert float(best_B.min()) < 1.99  # some are out of its reach


@pytest.mark.parametrize("hung_up", ROOTS)
def test_one_joint_of_a_waist_turns_as_far_as_it_goes(tmp_path: Path, hung_up: str) -> None:
    """Whichever end of it the URDF hangs up."""
    turn = root_turn(walker(tmp_path, hung_up, follows="chest"))
    yaw_B = torch.linspace(-2.5, 2.5, 21, dtype=torch.double)
    upright = torch.zeros(21, 3, dtype=torch.double)
    upright[:, 1] = yaw_B
    expected = upright.clamp(-1, 1)
    torch.testing.assert_close(turn.reached(rotation.axis_angle_to_matrix(upright)),
                               rotation.axis_angle_to_matrix(expected), atol=1e-6, rtol=0)  # fmt: skip


@pytest.mark.parametrize("name", ROBOTS)
def test_a_person_is_aligned_to_directions_as_the_robot_sees_them(root: Path, name: str) -> None:
    body_map = shipped(root, name, "chest")
    q_BN = body_map.robot.sample(60, torch.Generator().manual_seed(1))
    direction_BD3 = body_map.robot_directions(body_map.robot.forward(q_BN))
    found_BD3, columns = body_map.human_directions(align_pose(body_map, people(), direction_BD3)), body_map.measured
    torch.testing.assert_close(found_BD3[:, columns], direction_BD3[:, columns], atol=2e-4, rtol=0)


def test_who_cannot_follow_is_told(root: Path, tmp_path: Path) -> None:
    config = load_config(root / "conf" / "nao.yaml", ["robot.root_follows=chest"])
    with pytest.raises(UserError, match="robot.root_follows: 'nao' has no feet, so its base stays where it is"):
        build_body_map(config.robot)
    with pytest.raises(UserError, match="robot.root_follows"):
        load_config(root / "conf" / "nao-whole-body.yaml", ["robot.root_follows=head"])
    with pytest.raises(UserError, match="robot.root_follows: part 'cest' does not exist; nearest: 'chest'"):
        walker(tmp_path, follows="cest")
    arms: dict[str, Any] = dict.fromkeys(n for n in entries() if any(w in n for w in ("shoulder", "elbow", "wrist")))
    with pytest.raises(UserError, match="robot.root_follows: robot.keypoints names no chest"):
        walker(tmp_path, follows="chest", chest=None, **arms)
