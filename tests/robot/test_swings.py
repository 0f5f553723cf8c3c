"""What no joint swings against the limb that carries it counts little."""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import pytest
import torch

from mrhubo.body.joints import POSED_JOINT_NAMES
from mrhubo.describing.run import open_robot
from mrhubo.errors import InputWarning
from mrhubo.reference import angle_between
from mrhubo.retargeter import optimised
from mrhubo.robot import BodyMap
from mrhubo.robot.swings import direction_weights

ROBOTS = Path(__file__).parents[2] / "data/robots"


def body_map_of(file: Path, whole_body: bool = False) -> BodyMap:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)  # what is guessed of a hand
        return BodyMap.of(open_robot(str(file), whole_body))


def weights(file: Path, region: str) -> set[float]:
    body_map = body_map_of(file, whole_body=region == "foot")
    return {
        weight
        for direction, weight in zip(body_map.directions, direction_weights(body_map), strict=True)
        if direction.part.region == region
    }


def test_a_hand_that_only_twists_counts_little_and_one_that_swings_in_full() -> None:
    assert weights(ROBOTS / "nao/nao.urdf", "hand") == {0.02}
    assert weights(ROBOTS / "coman/coman.urdf", "hand") == {0.5}
    assert weights(ROBOTS / "nao/nao.urdf", "foot") == weights(ROBOTS / "coman/coman.urdf", "foot") == {0.1, 0.5}


@pytest.mark.parametrize(
    ("locked", "weight"),
    [((), 0.5), (("Wrj2",), 0.1), (("ForearmPlate",), 0.1), (("Wrj1", "Wrj2"), 0.02)],
    ids=["none", "a swing", "the twist", "both swings"],
)
def test_a_wrist_with_fewer_joints_counts_less(tmp_path: Path, locked: tuple[str, ...], weight: float) -> None:
    text = (ROBOTS / "coman/coman.urdf").read_text()
    for side in "LR":
        for joint in (side + name for name in locked):
            assert f'<joint name="{joint}" type="revolute">' in text
            text = text.replace(f'<joint name="{joint}" type="revolute">', f'<joint name="{joint}" type="fixed">')
    (tmp_path / "coman.urdf").write_text(text)
    assert weights(tmp_path / "coman.urdf", "hand") == {weight}


@pytest.mark.parametrize("bent_deg", [0.0, 50.0])
def test_a_bent_wrist_turns_no_forearm_away_that_cannot_follow(bent_deg: float) -> None:
    body_map = body_map_of(ROBOTS / "nao/nao.urdf")
    local_1J33 = torch.eye(3).repeat(1, len(POSED_JOINT_NAMES), 1, 1)
    for side, sign in (("left", -1.0), ("right", 1.0)):  # hanging arms, bent elbows
        local_1J33[0, POSED_JOINT_NAMES.index(f"{side}_shoulder")] = about("z", sign * math.radians(60))
        local_1J33[0, POSED_JOINT_NAMES.index(f"{side}_elbow")] = about("y", sign * math.radians(60))
        local_1J33[0, POSED_JOINT_NAMES.index(f"{side}_wrist")] = about("z", sign * math.radians(bent_deg))
    found_BD3 = body_map.robot_directions(body_map.robot.forward(optimised(body_map).predict(local_1J33)))
    miss_D = torch.rad2deg(angle_between(found_BD3, body_map.human_directions(local_1J33)))[0]
    assert max(miss_D[body_map.direction_names.index(f"{side}_wrist")] for side in ("left", "right")) < 2.0


def about(axis: str, angle: float) -> torch.Tensor:
    """The rotation (3, 3) about an axis of the human frame."""
    i = "xyz".index(axis)
    vector_3 = torch.zeros(3)
    vector_3[i] = angle
    x, y, z = vector_3.tolist()
    return torch.linalg.matrix_exp(torch.tensor([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]))
