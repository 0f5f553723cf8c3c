"""About which axis elbows bend, on a human and on robots."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo import rotation
from mrhubo.config import RobotConfig, load_config
from mrhubo.robot import build_body_map
from mrhubo.robot.bending import BendAxis, bend_axis
from tests.robot.two_arms import joint_of

UP, OUT, BACK = torch.tensor([0.0, 1, 0]), torch.tensor([1.0, 0, 0]), torch.tensor([0.0, 0, -1])


def bent(degrees: float, about: torch.Tensor = UP) -> torch.Tensor:
    """An arm that points outwards, and bends by so much about an axis."""
    return rotation.axis_angle_to_matrix(math.radians(degrees) * about) @ OUT


def test_a_bent_elbow_tells_its_axis_and_a_straight_one_asks_the_upper_arm() -> None:
    axis, needed = bend_axis(OUT, bent(60.0), BACK)
    torch.testing.assert_close(axis, UP)
    assert float(needed) == 0
    axis, needed = bend_axis(OUT, bent(0.0), BACK)
    torch.testing.assert_close(axis, BACK)
    assert float(needed) == 1
    axis, _ = bend_axis(OUT, OUT, torch.nn.functional.normalize(BACK + OUT, dim=0))
    torch.testing.assert_close(axis, BACK, msg="at right angles to the arm")


@settings(max_examples=100, deadline=None)
@given(degrees=st.floats(0, 170), turn=st.floats(0, 2 * math.pi), own=st.floats(0, 2 * math.pi))
def test_axes_are_across_the_arm_and_at_most_of_length_one(degrees: float, turn: float, own: float) -> None:
    about, own_3 = (torch.tensor([0.0, math.cos(angle), math.sin(angle)]) for angle in (turn, own))
    axis, needed = bend_axis(OUT, bent(degrees, about), own_3)
    assert abs(float(axis @ OUT)) < 1e-5 and float(axis.norm()) < 1 + 1e-5 and 0 <= float(needed) <= 1


def test_the_axis_is_smooth_between() -> None:
    """No step anywhere, even where the plane contradicts the upper arm."""
    for own in (BACK, UP, -UP):
        found = torch.stack([a * needed for a, needed in (bend_axis(OUT, bent(d / 20), own) for d in range(800))])
        assert float(found.diff(dim=0).norm(dim=1).max()) < 0.02


@pytest.mark.parametrize("name", ["nao", "coman", "reachy"])
def test_shipped_robots_bend_about_their_elbows(root: Path, name: str) -> None:
    body_map = build_body_map(load_config(root / "conf" / f"{name}.yaml").robot)
    axes = [direction for direction in body_map.directions if isinstance(direction, BendAxis)]
    assert [axis.name for axis in axes] == ["left_elbow_axis", "right_elbow_axis"]
    for axis in axes:
        joint = body_map.robot.description.parent_joint[axis.link]
        assert joint.name in {"LElbowRoll", "RElbowRoll", "LElbj", "RElbj", "l_elbow_pitch", "r_elbow_pitch"}
        assert abs(float(axis.axis_3 @ torch.tensor(joint.axis_3.tolist()))) == pytest.approx(1.0)


def reversed_elbow(side: str) -> tuple[str, str]:
    """The elbow's joint with its axis, and so its limits, the other way round."""
    old = joint_of(f"{side}_elbow")
    new = old.replace('xyz="0 1 0"', 'xyz="0 -1 0"').replace('lower="-2.3" upper="0"', 'lower="0" upper="2.3"')
    assert new.count("-1 0") == 1 and "2.3" in new
    return old, new


@pytest.mark.parametrize("replaced", [(), ("l",), ("l", "r")])
def test_the_axis_is_the_one_of_bending_forward(pair: Callable[..., RobotConfig], replaced: tuple[str, ...]) -> None:
    """Whatever the sign of the robot's joint."""
    body_map = build_body_map(pair(*map(reversed_elbow, replaced)))
    robot = body_map.robot
    q_BN = robot.sample(100, torch.Generator().manual_seed(0))
    found_BD3, names = body_map.robot_directions(robot.forward(q_BN)), list(body_map.direction_names)
    for side in ("left", "right"):
        upper, lower, axis = (found_BD3[:, names.index(f"{side}_{n}")] for n in ("elbow", "wrist", "elbow_axis"))
        cross = torch.linalg.cross(upper, lower)
        bent_B = cross.norm(dim=1) > 0.1
        assert int(bent_B.sum()) > 50
        torch.testing.assert_close(torch.nn.functional.normalize(cross, dim=1)[bent_B], axis[bent_B], atol=1e-4, rtol=0)


def test_an_arm_that_two_joints_bend_has_no_axis(pair: Callable[..., RobotConfig]) -> None:
    """A wrist that turns about the same axis as the elbow, with the hand's point beyond it."""
    old = joint_of("l_wrist")
    moving = joint_of("l_elbow").replace("l_elbow", "l_wrist").replace("l_lower", "l_hand").replace("l_fore", "l_lower")
    moving = moving.replace('xyz="0 0 0"', 'xyz="0 0 -0.12"')
    hand = {"left_wrist": {"link": "l_hand", "offset": [0.0, 0.0, -0.12]}}
    names = [f"{s}_{joint}" for s in "lr" for joint in ("pitch", "roll", "yaw", "elbow")]
    body_map = build_body_map(pair((old, moving), keypoints=hand, joints=[*names, "l_wrist"]))
    assert "left_elbow_axis" not in body_map.direction_names and "right_elbow_axis" in body_map.direction_names
