"""Who stands where: the person and the robots side by side on one floor, on one clock.

World: x towards the viewer, y to the viewer's right, z up, m; the floor is at z = 0. Legend: T frames of a figure, F
frames of the clock.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrhubo.errors import UserError
from mrhubo.viewer.performance import Performance
from mrhubo.viewer.person import Person
from mrhubo.viewer.poses import about_z, headings, poses

_GAP_M = 0.25
"""Between the spaces that neighbours reach into."""
_SAMPLES = 60
"""Frames that are looked at to know how far a figure reaches."""
_FAR_M = 1.5
"""Whose base goes farther is followed by the camera."""
_CALM_S = 1.0
"""How long [s] the mean is that the camera follows."""


@dataclass(frozen=True)
class Standing:
    """Where a figure stands."""

    pose_T44: np.ndarray
    """Of a person's pelvis, or of a robot's base."""
    middle_2: np.ndarray
    """The place (2,) on the floor at which it begins."""
    low_3: np.ndarray
    """The corner of the box that it reaches into, seen from where it is on the floor at each moment."""
    high_3: np.ndarray
    """The opposite corner."""


@dataclass(frozen=True)
class Stage:
    """All figures and their clock."""

    person: Person | None
    robots: tuple[Performance, ...]
    standings: tuple[Standing, ...]
    """Of the person, if there is one, then of the robots."""
    frame_rate: float
    """Of the clock."""
    frames: int
    followed_F2: np.ndarray
    """What the camera may follow: how far (2,) figures whose bases move have gone, on the mean, without quick turns."""

    @property
    def duration(self) -> float:
        """From the first to the last frame [s]."""
        return (self.frames - 1) / self.frame_rate

    @property
    def goes_far(self) -> bool:
        """Whether figures leave the picture of a camera that stands still."""
        return bool(np.ptp(self.followed_F2, axis=0).max() > _FAR_M)

    def frame_of(self, figure: Person | Performance, time: float) -> int:
        """Which frame of a figure is shown at a moment [s]; one that has ended keeps still."""
        return int(np.clip(round(time * figure.frame_rate), 0, len(figure) - 1))

    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners of the box that figures reach into where they begin."""
        lows = [np.append(s.middle_2, 0.0) + s.low_3 for s in self.standings]
        highs = [np.append(s.middle_2, 0.0) + s.high_3 for s in self.standings]
        return np.min(lows, axis=0), np.max(highs, axis=0)


def arrange(person: Person | None, robots: Sequence[Performance]) -> Stage:
    """Puts the figures side by side: the person first, at the viewer's left.

    Where no robot's base moves, the person stays in place too, and looks ahead. Else all go their ways, turned so that
    the person, or the first robot that goes somewhere, looks at the viewer in the beginning.

    Raises:
        UserError: there is nobody.
    """
    if person is None and not robots:
        raise UserError("there is nobody to show")
    moving = [robot for robot in robots if robot.base_T44 is not None]
    figures: list[Person | Performance] = [*([] if person is None else [person]), *robots]
    if person is not None and person.has_root:
        start = float(headings(person.root_T33[0]))
    else:
        start = float(headings(moving[0].base_T44[0, :3, :3])) if moving and moving[0].base_T44 is not None else 0.0
    still = [_still_person(f, start, bool(moving)) if isinstance(f, Person) else _robot(f, start) for f in figures]
    boxes = [_reach(figure, pose_T44) for figure, pose_T44 in zip(figures, still, strict=True)]
    standings, right = [], 0.0
    for pose_T44, (low_3, high_3) in zip(still, boxes, strict=True):
        middle_2 = np.array([0.0, right - low_3[1]])
        right += high_3[1] - low_3[1] + _GAP_M
        placed_T44 = pose_T44.copy()
        placed_T44[:, :2, 3] += middle_2
        standings.append(Standing(placed_T44, middle_2, low_3, high_3))
    centre = (right - _GAP_M) / 2
    for standing in standings:
        standing.pose_T44[:, 1, 3] -= centre
        standing.middle_2[1] -= centre
    rate = figures[0].frame_rate
    frames = 1 + max(int(np.floor((len(f) - 1) / f.frame_rate * rate + 1e-6)) for f in figures)
    stage = Stage(person, tuple(robots), tuple(standings), rate, frames, np.zeros((frames, 2)))
    return replace(stage, followed_F2=_followed(stage, figures, bool(moving)))


def _still_person(person: Person, start: float, goes: bool) -> np.ndarray:
    """Poses (T, 4, 4) of the pelvis, whose first place on the floor is the origin."""
    if not goes:
        place_T3 = person.root_T3 * [0.0, 0.0, 1.0]
        return poses(place_T3, about_z(-headings(person.root_T33)) @ person.root_T33)
    turn_33 = about_z(np.array(-start))
    place_T3 = (person.root_T3 - person.root_T3[0] * [1.0, 1.0, 0.0]) @ turn_33.T
    return poses(place_T3, turn_33 @ person.root_T33)


def _robot(robot: Performance, start: float) -> np.ndarray:
    """Poses (T, 4, 4) of the base, whose first place on the floor is the origin."""
    if robot.base_T44 is None:
        pose_T44 = np.tile(np.eye(4), (len(robot), 1, 1))
        pose_T44[:, 2, 3] = -_extremes(robot, pose_T44)[0][2]
        return pose_T44
    turn_44 = poses(np.zeros(3), about_z(np.array(-start)))
    first_44 = poses(-robot.base_T44[0, :3, 3] * [1.0, 1.0, 0.0], np.eye(3))
    return turn_44 @ first_44 @ robot.base_T44


def _reach(figure: Person | Performance, pose_T44: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the box that a figure reaches into, seen from where it is on the floor at each moment."""
    in_place_T44 = pose_T44.copy()
    in_place_T44[:, :2, 3] = 0.0
    return _extremes(figure, in_place_T44)


def _extremes(figure: Person | Performance, pose_T44: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the box around a figure in all of some frames."""
    frames = np.unique(np.linspace(0, len(figure) - 1, _SAMPLES).round().astype(int))
    if isinstance(figure, Person):
        points_TK3 = (
            figure.points_TK3[frames] @ pose_T44[frames, :3, :3].swapaxes(-1, -2) + pose_T44[frames, None, :3, 3]
        )
        low_3, high_3 = points_TK3.min(axis=(0, 1)), points_TK3.max(axis=(0, 1))
        return low_3 - [0.1, 0.1, 0.0], high_3 + [0.1, 0.1, 0.15]  # keypoints lie within the flesh
    low_3, high_3 = np.full(3, np.inf), np.full(3, -np.inf)
    poses_BT44 = pose_T44[frames] @ figure.body_poses(frames)
    for body, place_T44 in zip(figure.bodies, poses_BT44, strict=True):
        for mesh in body.meshes:
            corners_V3 = _outermost(mesh.vertices_V3)
            placed = corners_V3 @ place_T44[:, :3, :3].swapaxes(-1, -2) + place_T44[:, None, :3, 3]
            low_3, high_3 = np.minimum(low_3, placed.min(axis=(0, 1))), np.maximum(high_3, placed.max(axis=(0, 1)))
    if not np.isfinite(low_3).all():  # nothing of it is seen
        return np.full(3, -0.2), np.full(3, 0.2)
    return low_3, high_3


def _outermost(vertices_V3: np.ndarray, most: int = 400) -> np.ndarray:
    """Vertices farthest along many directions, which stand for a mesh where its size counts."""
    if len(vertices_V3) <= most:
        return vertices_V3
    direction_D3 = np.random.default_rng(0).normal(size=(most // 2, 3))
    direction_D3 = np.concatenate([np.eye(3), -np.eye(3), direction_D3])
    return vertices_V3[np.unique((vertices_V3 @ direction_D3.T).argmax(axis=0))]


def _followed(stage: Stage, figures: Sequence[Person | Performance], goes: bool) -> np.ndarray:
    """`Stage.followed_F2`."""
    ways = []
    for figure, standing in zip(figures, stage.standings, strict=True):
        if goes and not (isinstance(figure, Performance) and figure.base_T44 is None):
            shown = [stage.frame_of(figure, frame / stage.frame_rate) for frame in range(stage.frames)]
            ways.append(standing.pose_T44[shown, :2, 3] - standing.middle_2)
    if not ways:
        return np.zeros((stage.frames, 2))
    way_F2 = np.mean(ways, axis=0)
    half = max(1, min(round(_CALM_S * stage.frame_rate / 2), stage.frames))
    padded = np.pad(way_F2, [(half, half), (0, 0)], mode="edge")
    total = np.cumsum(np.pad(padded, [(1, 0), (0, 0)]), axis=0)
    return (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
