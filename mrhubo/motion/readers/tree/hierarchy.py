"""A tree of joints that moves, as BVH and ASF/AMC files have it, and its forward kinematics.

Legend: N joints (ends of bones count as joints), T frames, F some of them, C numbers a frame. Frame: the file's own
world and unit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

_ADDED = 0.1
"""Positions smaller than this share of a bone's offset are added to it; as the bone itself they would be none."""


@dataclass(frozen=True)
class Joint:
    """A joint of a file, or the end of a bone."""

    name: str
    parent: int
    """Place of its parent, which comes before it; -1 for a root."""
    offset_3: tuple[float, float, float]
    """From its parent, in the parent's axes."""
    rotation: tuple[tuple[str, int], ...] = ()
    """Axis, `x`, `y` or `z`, and column of each of its angles [deg], the outermost first."""
    position: tuple[tuple[str, int], ...] = ()
    """Axis and column of each of its coordinates, which take the place of the offset."""
    axes: tuple[tuple[str, float], ...] = ()
    """Axes of its angles, where they are not its own: turns [deg] about x, y, z, the outermost first (ASF's `axis`)."""


@dataclass(frozen=True)
class JointTree:
    """A tree of joints and the numbers that move it."""

    joints: tuple[Joint, ...]
    """Parents before children."""
    value_TC: np.ndarray
    """Angles [deg] and coordinates, a row a frame."""
    rest_name: str = "its pose at all angles 0"
    """What the pose is, in words, in which all angles are 0; empty where that is known to be none of rest."""

    def __len__(self) -> int:
        return len(self.value_TC)

    @cached_property
    def names(self) -> list[str]:
        """The joints' names."""
        return [joint.name for joint in self.joints]

    @cached_property
    def children(self) -> list[list[int]]:
        """The children of each joint."""
        found: list[list[int]] = [[] for _ in self.joints]
        for place, joint in enumerate(self.joints):
            if joint.parent >= 0:
                found[joint.parent].append(place)
        return found

    def above(self, place: int) -> list[int]:
        """The joint and all joints above it, nearest first."""
        chain = []
        while place >= 0:
            chain.append(place)
            place = self.joints[place].parent
        return chain

    @property
    def roots(self) -> list[int]:
        """The joints without a parent."""
        return [place for place, joint in enumerate(self.joints) if joint.parent < 0]

    def under(self, root: int) -> JointTree:
        """The tree of a joint and all that hang on it; it moves as those above move it."""
        kept = [place for place in range(len(self.joints)) if root in self.above(place)]
        moved = {place: number for number, place in enumerate(kept)}
        joints = [replace(self.joints[place], parent=moved.get(self.joints[place].parent, -1)) for place in kept]
        above = [self.joints[place] for place in self.above(root)[1:]]
        if not any(joint.rotation or joint.position or any(joint.offset_3) for joint in above):
            return replace(self, joints=tuple(joints))
        pose, first = self.pose(slice(None), [root]), self.value_TC.shape[1]
        value_T6 = np.concatenate([pose.point[root], angles_zyx(pose.matrix[root])], axis=-1)
        columns = range(first, first + 6)
        joints[0] = Joint(
            joints[0].name,
            -1,
            (0.0, 0.0, 0.0),
            tuple(zip("zyx", columns[3:], strict=True)),
            tuple(zip("xyz", columns[:3], strict=True)),
        )
        value_TC = np.concatenate([self.value_TC, value_T6.astype(self.value_TC.dtype)], axis=1)
        return replace(self, joints=tuple(joints), value_TC=value_TC)

    def pose(self, frames: slice | np.ndarray, places: Sequence[int] | None = None) -> Pose:
        """Some joints, or all, in some frames."""
        value_FC = np.asarray(self.value_TC[frames], dtype=np.float64)
        return self._pose(value_FC, places, rest=False)

    def rest(self) -> Pose:
        """The one frame in which all angles are 0, and coordinates are as the first frame has them."""
        return self._pose(np.asarray(self.value_TC[:1], dtype=np.float64), None, rest=True)

    def _pose(self, value_FC: np.ndarray, places: Sequence[int] | None, rest: bool) -> Pose:
        wanted = range(len(self.joints)) if places is None else places
        needed = sorted({above for place in wanted for above in self.above(place)})
        # Frames as the last axis: turning two columns is a few operations on whole arrays.
        turn: dict[int, np.ndarray] = {}
        point: dict[int, np.ndarray] = {}
        for place in needed:
            joint = self.joints[place]
            offset_3F = self._offset(place, value_FC)
            if joint.parent < 0:
                point[place] = offset_3F
                above_33F = np.repeat(np.eye(3)[:, :, None], len(value_FC), axis=2)
            else:
                above_33F = turn[joint.parent]
                point[place] = point[joint.parent] + (above_33F * offset_3F).sum(1)
            turn[place] = above_33F if rest or not joint.rotation else _turned(joint, above_33F, value_FC)
        return Pose(
            {place: np.ascontiguousarray(point[place].T) for place in wanted},
            {place: np.ascontiguousarray(turn[place].transpose(2, 0, 1)) for place in wanted},
        )

    def _offset(self, place: int, value_FC: np.ndarray) -> np.ndarray:
        """From the parent (3, F), in its axes."""
        joint = self.joints[place]
        offset_3F = np.repeat(np.asarray(joint.offset_3, dtype=np.float64)[:, None], len(value_FC), axis=1)
        for axis, column in joint.position:
            base = offset_3F["xyz".index(axis)] if place in self._added else 0.0
            offset_3F["xyz".index(axis)] = base + value_FC[:, column]
        return offset_3F

    @cached_property
    def _added(self) -> set[int]:
        """Joints whose coordinates are added to their offset: those that would else shrink to nothing."""
        found = set()
        for place, joint in enumerate(self.joints):
            if joint.parent < 0 or not joint.position:
                continue
            columns = [column for _, column in joint.position]
            length = float(np.median(np.linalg.norm(self.value_TC[:: max(1, len(self) // 64), columns], axis=-1)))
            if length < _ADDED * float(np.linalg.norm(joint.offset_3)):
                found.add(place)
        return found


@dataclass(frozen=True)
class Pose:
    """Where joints are and how they are turned in some frames, in the file's world."""

    point: dict[int, np.ndarray]
    """(F, 3) by joint."""
    matrix: dict[int, np.ndarray]
    """Rotations (F, 3, 3) by joint, relative to how it is turned when all angles are 0."""


def _turned(joint: Joint, above_33F: np.ndarray, value_FC: np.ndarray) -> np.ndarray:
    """How a joint is turned (3, 3, F), by how its parent is and by its own angles."""
    turn_33F = above_33F.copy()
    own = [(axis, np.radians(angle)) for axis, angle in joint.axes]
    for axis, angle in own:
        turn_about(turn_33F, axis, angle)
    for axis, column in joint.rotation:
        turn_about(turn_33F, axis, np.radians(value_FC[:, column]))
    for axis, angle in own[::-1]:
        turn_about(turn_33F, axis, -angle)
    return turn_33F


def turn_about(matrix_33F: np.ndarray, axis: str, angle_F: np.ndarray | float) -> None:
    """Turns rotations (3, 3, F) by angles [rad] about an axis of what is turned already, in place."""
    first, second = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    sine_F, cosine_F = np.sin(angle_F), np.cos(angle_F)
    one_3F, other_3F = matrix_33F[:, first].copy(), matrix_33F[:, second]
    matrix_33F[:, first] = cosine_F * one_3F + sine_F * other_3F
    matrix_33F[:, second] = cosine_F * other_3F - sine_F * one_3F


def angles_zyx(turn_F33: np.ndarray) -> np.ndarray:
    """Angles (F, 3) about z, y and x [deg], the outermost first, also where they are not unique."""
    z_F = np.arctan2(turn_F33[:, 1, 0], turn_F33[:, 0, 0])
    y_F = np.arctan2(-turn_F33[:, 2, 0], np.hypot(turn_F33[:, 0, 0], turn_F33[:, 1, 0]))
    sine_F, cosine_F = np.sin(z_F), np.cos(z_F)
    x_F = np.arctan2(
        sine_F * turn_F33[:, 0, 2] - cosine_F * turn_F33[:, 1, 2],
        cosine_F * turn_F33[:, 1, 1] - sine_F * turn_F33[:, 0, 1],
    )
    return np.degrees(np.stack([z_F, y_F, x_F], axis=-1))
