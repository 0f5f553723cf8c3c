"""A retargeter stands a robot with feet on the floor, as the optimiser does, where a motion tells a root."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from mrhubo import rotation
from mrhubo.body import BodyPrior
from mrhubo.config import load_config
from mrhubo.evaluation.whole_body import score_whole_body
from mrhubo.motion import Motion
from mrhubo.reference import DirectionJacobian
from mrhubo.retargeter import Retargeter, build_network
from mrhubo.retargeter.nearest import NearestJoints
from mrhubo.robot import BodyMap, build_body_map
from tests.reference.standing.steppers import squat, walk
from tests.reference.walkers import walker


@pytest.fixture(scope="module")
def biped(tmp_path_factory: pytest.TempPathFactory) -> Retargeter:
    """A robot with legs that nothing was trained for."""
    body_map = walker(tmp_path_factory.mktemp("walker"))
    return Retargeter(NearestJoints(body_map), body_map, BodyPrior.open(), None, phi_threshold=0.01)


def test_planted_feet_stay_and_the_robot_goes_where_the_person_goes(biped: Retargeter, one_thread: None) -> None:
    motion = walk(60)
    found = biped(motion, avoid_collisions=False)
    assert found.root_position is not None and found.root_quaternion_wxyz is not None and found.contact is not None
    assert found.root_position.shape == (60, 3) and found.contact.shape == (60, 2)
    assert found.contact_names == ("left_foot", "right_foot") and found.frame_rate == motion.frame_rate
    turn_T33 = rotation.wxyz_to_matrix(found.root_quaternion_wxyz)
    score = score_whole_body(biped.body_map, motion, found.q, found.root_position, turn_T33)
    assert score.slide_cm_s < 1 and score.sunk == score.floating == score.outside == score.jumps == 0
    assert score.speed_max <= 1 and score.path_cm_m < 3 and max(score.parts_deg.values()) < 10


def test_without_a_root_or_frame_by_frame_joint_angles_are_all(biped: Retargeter) -> None:
    motion = squat(8)
    bare = Motion("squat", motion.local_TJ33, motion.frame_rate)
    poses = motion.local_TJ33
    whole = biped(bare)
    for found in (whole, biped(poses, frame_rate=motion.frame_rate), biped(motion, together=False), biped(poses[0])):
        assert found.root_position is None and found.contact is None and found.contact_names == ()
    assert torch.equal(whole.q, biped(poses, frame_rate=motion.frame_rate).q)
    assert biped(motion).root_position is not None


@pytest.fixture(scope="module")
def whole_bodies(root: Path) -> dict[str, BodyMap]:
    return {
        name: build_body_map(load_config(root / "conf" / f"{name}-whole-body.yaml").robot) for name in ("nao", "coman")
    }


def test_legs_that_share_a_joint_are_one_branch_and_a_waist_is_its_own(
    root: Path, whole_bodies: dict[str, BodyMap]
) -> None:
    sizes = {name: sorted(len(joints) for _, joints in DirectionJacobian(found).blocks)
             for name, found in whole_bodies.items()}  # fmt: skip
    assert sizes["nao"] == [2, 4, 4, 11] and sizes["coman"][:1] + sizes["coman"][1:3] == [3, 6, 6]
    nao = whole_bodies["nao"]
    torch.manual_seed(0)
    network = build_network(load_config(root / "conf" / "nao-whole-body.yaml", ["model.hidden=8"]), nao)
    direction_BD3 = nao.robot_directions(nao.robot.forward(nao.robot.sample(5, torch.Generator().manual_seed(0))))
    moved_BD3 = direction_BD3.clone()
    columns = [i for i, name in enumerate(nao.direction_names) if name.endswith(("knee", "ankle", "foot_up"))]
    moved_BD3[:, columns] = moved_BD3[:, columns].roll(1, dims=0)
    turned_N = (network.of_directions(moved_BD3) - network.of_directions(direction_BD3)).abs().amax(dim=0) > 1e-6
    legs = [name[1:4] in ("Hip", "Kne", "Ank") for name in nao.robot.joint_names]
    assert turned_N.tolist() == legs
