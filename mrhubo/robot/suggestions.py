"""Entries of `robot.keypoints` to paste, in place of what is wrong, and the words that they come in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mrhubo.robot.ancestry import Ancestry
from mrhubo.robot.axis_lines import StandingRobot
from mrhubo.robot.capsules import SHORT
from mrhubo.robot.entries import End, Point
from mrhubo.robot.keypoints import Keypoints, Limb
from mrhubo.robot.parts import OrientedPart

if TYPE_CHECKING:
    from mrhubo.robot.body_map import BodyMap

_STRAIGHT = 10.0
"""Degrees up to which a direction is meant to be along an axis of a frame."""
_NEAR = 5e-4
"""Metres, and cosine, that an entry need not tell."""


def point_entry(name: str, point: Point) -> str:
    """``left_wrist: {link: l_lower, offset: [0, 0, -0.22]}``, or the link alone where that says the same."""
    if max(map(abs, point.offset_3)) < _NEAR:
        return f"{name}: {point.link}"
    return f"{name}: {{link: {point.link}, offset: {numbers(point.offset_3)}}}"


def end_entry(name: str, end: End, words: tuple[str, str]) -> str:
    """``left_hand: {link: l_hand, fingers: [0, 0, -1], thumb: [1, 0, 0]}``."""
    axes = ", ".join(f"{word}: {numbers(axis_3)}" for word, axis_3 in zip(words, end.axes_23.tolist(), strict=True))
    return f"{name}: {{link: {end.link}, {axes}}}"


def entry(keypoints: Keypoints, name: str, like: str) -> str:
    """An entry of one name with the value that another one has."""
    if like in keypoints.points:
        return point_entry(name, keypoints.points[like])
    return end_entry(name, keypoints.ends[like], next(part.words for part in oriented(keypoints) if part.name == like))


def oriented(keypoints: Keypoints) -> list[OrientedPart]:
    """The oriented parts that a robot has."""
    return [part for part in keypoints.parts if isinstance(part, OrientedPart)]


def exchanged(keypoints: Keypoints) -> str:
    """The entries of left and right, exchanged."""
    both = [names for pair in keypoints.pairs for names in (pair, pair[::-1])]
    return ", ".join(entry(keypoints, name, other) for name, other in both)


def numbers(values: Sequence[float]) -> str:
    """``[0.1, 0, -0.22]``, to a tenth of a millimetre."""
    return "[" + ", ".join(f"{round(float(value), 4) + 0.0:g}" for value in values) + "]"


def view_entry(body_map: BodyMap, name: str) -> str | None:
    """The entry of a part from which others are seen, such as the chest, as the limbs that hang on it tell: the link that
    carries them, its left from the one's start to the other's, its up that of the robot's root, forward across. None
    where that is what is written already.
    """
    robot, keypoints = body_map.robot, body_map.keypoints
    limbs = [limb for limb in keypoints.directions if isinstance(limb, Limb) and limb.part.hangs_on == name]
    link = Ancestry(robot).carrier_of([limb.start.link for limb in limbs]) if limbs else keypoints.ends[name].link
    first, second = next(part.words for part in oriented(keypoints) if part.name == name)
    standing = StandingRobot(robot.description, robot.configuration(robot.home().cpu().numpy()))
    turn_33, written = standing.poses[link][:3, :3], keypoints.ends[name]
    axes_23 = turn_33.T @ standing.poses[written.link][:3, :3] @ written.axes_23.numpy().T.astype(float)
    axes_23 = axes_23.T
    if len(limbs) > 1:
        rest = body_map.skeleton.rest_points
        side = np.sign(float(rest[limbs[0].part.start][0] - rest[limbs[1].part.start][0]))
        left_3 = (standing.position(limbs[0].start) - standing.position(limbs[1].start)) * side
        level_3 = left_3 * [1.0, 1.0, 0.0]
        left_3 = level_3 if float(np.linalg.norm(level_3)) > 0.5 * float(np.linalg.norm(left_3)) else left_3
        left_3 = turn_33.T @ unit(left_3)
        up_3 = turn_33.T @ np.array([0.0, 0.0, 1.0])
        up_3 = _snapped(up_3 - (up_3 @ left_3) * left_3)
        found_23 = np.stack([_snapped(np.cross(left_3, up_3)), up_3])
        if link == written.link and float((found_23 * axes_23).sum(1).min()) > np.cos(np.deg2rad(_STRAIGHT)):
            return None
        axes_23 = found_23
    elif link == written.link:
        return None
    if axes_23[0, 0] > 1 - _NEAR and axes_23[1, 2] > 1 - _NEAR:
        return f"{name}: {link}"
    return f"{name}: {{link: {link}, {first}: {numbers(axes_23[0])}, {second}: {numbers(axes_23[1])}}}"


def quoted(names: Sequence[str]) -> str:
    """``'a', 'b'``."""
    return ", ".join(f"'{name}'" for name in names)


def unit(vector_3: np.ndarray) -> np.ndarray:
    """A vector (3,) at length 1."""
    return vector_3 / max(float(np.linalg.norm(vector_3)), SHORT)


def _snapped(vector_3: np.ndarray) -> np.ndarray:
    """A unit direction; along an axis of the frame, if it is near one: frames are put on straight."""
    unit_3 = unit(vector_3)
    nearest = int(np.argmax(np.abs(unit_3)))
    if abs(unit_3[nearest]) < np.cos(np.deg2rad(_STRAIGHT)):
        return unit_3
    return np.sign(unit_3[nearest]) * np.eye(3)[nearest]
