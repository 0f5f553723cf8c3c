"""Flesh around the joints that a body has."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from mrhubo.body.skeleton import JOINT_NAMES
from mrhubo.frames import human_to_world
from mrhubo.view import human_solids
from mrhubo.view.limbs import Points, Row, arm, foot, hand, leg


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


PARTS = pytest.mark.parametrize("part", [arm, hand, leg, foot])
BODIES = pytest.mark.parametrize("names", [None, JOINT_NAMES], ids=["all points", "22 joints"])
YAW = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])


def bent(human: tuple[np.ndarray, list[str]], names: tuple[str, ...] | None) -> dict[str, np.ndarray]:
    """Points of a body in no particular pose, world frame."""
    positions = human[0] + np.random.default_rng(0).normal(scale=0.03, size=human[0].shape)
    points = dict(zip(human[1], human_to_world(positions), strict=True))
    return points if names is None else {name: points[name] for name in names}


def table(rows: list[Row]) -> np.ndarray:
    return np.array([[*start, *end, first, last] for start, end, first, last in rows])


@PARTS
@BODIES
@pytest.mark.parametrize("side", ["left", "right"])
def test_limbs_move_turn_and_grow_with_their_points(
    human: tuple[np.ndarray, list[str]],
    part: Callable[[Points, str, float], list[Row]],
    names: tuple[str, ...],
    side: str,
) -> None:
    points = bent(human, names)
    before = table(part(points, side, 1.0))
    assert len(before) >= 2 and (before[:, 6:] > 0.005).all()
    shift = np.array([1.0, -2.0, 0.5])
    moved = table(part({name: 2.0 * YAW @ point + shift for name, point in points.items()}, side, 2.0))
    for columns in (slice(0, 3), slice(3, 6)):
        np.testing.assert_allclose(moved[:, columns], 2.0 * before[:, columns] @ YAW.T + shift, atol=1e-9)
    np.testing.assert_allclose(moved[:, 6:], 2.0 * before[:, 6:])


@PARTS
@BODIES
def test_limbs_are_mirrored_with_their_points(
    human: tuple[np.ndarray, list[str]], part: Callable[[Points, str, float], list[Row]], names: tuple[str, ...]
) -> None:
    mirror, points = np.array([1.0, -1.0, 1.0]), bent(human, names)
    other = {"left": "right", "right": "left"}
    swapped = {"_".join(other.get(word, word) for word in name.split("_")): mirror * p for name, p in points.items()}
    before, after = table(part(points, "left", 1.0)), table(part(swapped, "right", 1.0))
    after[:, 1], after[:, 4] = -after[:, 1], -after[:, 4]
    order = [np.lexsort(rows.round(6).T) for rows in (before, after)]
    np.testing.assert_allclose(after[order[1]], before[order[0]], atol=1e-9)
