"""A tree of joints that moves, as BVH and ASF/AMC files have it, and its forward kinematics.

Legend: N joints (ends of bones count as joints), T frames, F some of them, C numbers a frame. Frame: the file's own
world and unit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

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

    def __len__(self) -> int:
        return len(self.value_TC)

    @property
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
        turn: dict[int, Rotation] = {}
        point: dict[int, np.ndarray] = {}
        for place in needed:
            joint = self.joints[place]
            offset_F3 = self._offset(place, value_FC)
            local = None if rest else _local(joint, value_FC)
            if joint.parent < 0:
                point[place] = offset_F3
                turn[place] = Rotation.identity(len(value_FC)) if local is None else local
                continue
            point[place] = point[joint.parent] + turn[joint.parent].apply(offset_F3)
            turn[place] = turn[joint.parent] if local is None else turn[joint.parent] * local
        return Pose({place: point[place] for place in wanted}, {place: turn[place] for place in wanted})

    def _offset(self, place: int, value_FC: np.ndarray) -> np.ndarray:
        joint = self.joints[place]
        offset_F3 = np.tile(np.asarray(joint.offset_3, dtype=np.float64), (len(value_FC), 1))
        for axis, column in joint.position:
            base = offset_F3[:, "xyz".index(axis)] if place in self._added else 0.0
            offset_F3[:, "xyz".index(axis)] = base + value_FC[:, column]
        return offset_F3

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
    turn: dict[int, Rotation]
    """F rotations by joint, relative to how it is turned when all angles are 0."""


def _local(joint: Joint, value_FC: np.ndarray) -> Rotation | None:
    """A joint's own rotations; None where it has no angles."""
    if not joint.rotation:
        return None
    axes, columns = "".join(axis for axis, _ in joint.rotation), [column for _, column in joint.rotation]
    local = _euler(axes, value_FC[:, columns])
    if joint.axes:
        own = _euler("".join(axis for axis, _ in joint.axes), np.array([[angle for _, angle in joint.axes]]))
        local = own * local * own.inv()
    return local


def _euler(axes: str, angle_FX: np.ndarray) -> Rotation:
    """Turns [deg] about `axes`, the outermost first."""
    if len(axes) <= 3 and all(one != other for one, other in zip(axes, axes[1:], strict=False)):
        return Rotation.from_euler(axes.upper(), angle_FX, degrees=True)
    turn = Rotation.identity(len(angle_FX))
    for place, axis in enumerate(axes):
        turn = turn * Rotation.from_euler(axis.upper(), angle_FX[:, place : place + 1], degrees=True)
    return turn
