"""Flesh around the joints that a body has."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.body.skeleton import JOINT_NAMES
from mrhubo.frames import human_to_world
from mrhubo.view import human_solids
from mrhubo.view.limbs import foot


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_body_of_22_joints_has_feet(human: tuple[np.ndarray, list[str]], side: str) -> None:
    """Toes and heels are guessed from the foot's joint, which is the ball of the foot."""
    positions, names = human
    points = {name: human_to_world(positions[names.index(name)]) for name in JOINT_NAMES}
    rows = foot(points, side, 1.0)
    assert len(rows) == 4
    ball = points[f"{side}_foot"]
    assert sum(bool((start == ball).all() or (end == ball).all()) for start, end, *_ in rows) == 3
    solids = human_solids(np.array([positions[names.index(name)] for name in JOINT_NAMES]), JOINT_NAMES)
    lowest, ahead = solids.bounds()[0, 2], solids.bounds()[1, 0]
    assert lowest < points["left_ankle"][2] - 0.05 and ahead > ball[0] + 0.04


def test_without_the_foot_joint_the_ball_lies_on_the_way_to_the_toe(human: tuple[np.ndarray, list[str]]) -> None:
    positions, names = human
    points = {name: human_to_world(point) for name, point in zip(names, positions, strict=True)}
    points.pop("left_foot")
    assert len(foot(points, "left", 1.0)) == 4
    assert not foot({name: point for name, point in points.items() if name != "left_toe"}, "left", 1.0)
