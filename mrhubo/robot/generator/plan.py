"""A robot that is being made: bodies and the joints between them as lines in space, before there are frames and names.

The frame while planning: x forward, y left, z up, the ground at 0, arms hanging. Legend: vectors (3,) in metres.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

X, Y, Z = np.eye(3)
Limits = tuple[float | None, float | None]
"""Of a joint [rad]; None where its description tells none."""


@dataclass(frozen=True)
class PlannedJoint:
    """A joint between two bodies."""

    role: str
    """What it is, for names and for the truth: `left_shoulder_pitch`."""
    kind: str
    parent: int
    child: int
    point_3: np.ndarray
    axis_3: np.ndarray
    lower: float | None
    upper: float | None
    mimics: tuple[str, float] | None = None
    """Role of the joint that it mimics, and the multiplier."""

    @property
    def moves(self) -> bool:
        """Whether it is not fixed."""
        return self.kind != "fixed"


@dataclass(frozen=True)
class Solid:
    """A box, axis-parallel while planning: centre, half sizes [m]."""

    centre_3: np.ndarray
    half_3: np.ndarray


@dataclass
class Plan:
    """Bodies by number, what they are called and made of, and the joints between them."""

    bodies: list[str] = field(default_factory=list)
    joints: list[PlannedJoint] = field(default_factory=list)
    solids: dict[int, Solid] = field(default_factory=dict)
    points: dict[str, tuple[int, np.ndarray]] = field(default_factory=dict)
    """True points by name, with the body that carries them."""
    directions: dict[str, tuple[int, np.ndarray]] = field(default_factory=dict)
    """True directions by name (`left_fingers`), with the body that carries them."""

    def body(self, role: str) -> int:
        """A new body."""
        self.bodies.append(role)
        return len(self.bodies) - 1

    def join(
        self, role: str, parent: int, point_3: np.ndarray, axis_3: np.ndarray, limits: Limits | None,
        kind: str = "revolute", body: str | None = None, mimics: tuple[str, float] | None = None,
    ) -> int:  # fmt: skip
        """A new body that hangs on a joint."""
        child = self.body(body or role)
        lower, upper = limits if limits is not None else (None, None)
        kind = "continuous" if limits is None and kind == "revolute" else kind
        self.joints.append(
            PlannedJoint(
                role, kind, parent, child, np.array(point_3, float), np.array(axis_3, float), lower, upper, mimics
            )
        )
        return child

    def fix(self, role: str, parent: int, point_3: np.ndarray) -> int:
        """A new body that is fixed to another, with its frame at a point."""
        return self.join(role, parent, point_3, X, (0.0, 0.0), "fixed")

    def solid(self, body: int, start_3: np.ndarray, end_3: np.ndarray, thickness: float) -> None:
        """Gives a body a box around the line between two points."""
        start_3, end_3 = np.asarray(start_3, float), np.asarray(end_3, float)
        self.solids[body] = Solid((start_3 + end_3) / 2, np.abs(end_3 - start_3) / 2 + thickness)

    def joint(self, role: str) -> PlannedJoint:
        """The joint with a role."""
        return next(joint for joint in self.joints if joint.role == role)

    def change(self, role: str, **changes: Any) -> None:
        """Gives the joint with a role other fields."""
        self.joints = [replace(joint, **changes) if joint.role == role else joint for joint in self.joints]

    def insert_before(
        self, role: str, new: str, point_3: np.ndarray, axis_3: np.ndarray, limits: Limits,
        kind: str = "revolute",
    ) -> None:  # fmt: skip
        """A joint between a joint and the body that carries it, with a body of its own."""
        carried = self.joint(role)
        body = self.join(new, carried.parent, point_3, axis_3, limits, kind)
        self.change(role, parent=body)

    def insert_after(
        self, role: str, new: str, point_3: np.ndarray, axis_3: np.ndarray, limits: Limits,
    ) -> None:  # fmt: skip
        """A joint between a joint and the body that it carries, with a body of its own between them."""
        carrier = self.joint(role)
        body = self.body(new)
        self.change(role, child=body)
        self.joints.append(
            PlannedJoint(new, "revolute", body, carrier.child, np.array(point_3), np.array(axis_3), *limits)
        )

    def remove(self, bodies: Collection[int]) -> None:
        """Takes bodies away, with their joints, points and directions; the others keep their numbers."""
        self.joints = [j for j in self.joints if j.child not in bodies and j.parent not in bodies]
        self.points = {name: found for name, found in self.points.items() if found[0] not in bodies}
        self.directions = {name: found for name, found in self.directions.items() if found[0] not in bodies}

    def rooted(self, root: int) -> list[PlannedJoint]:
        """The joints from a root outwards, each turned so that its parent is nearer to the root: the same motion, with
        the axis the other way.
        """
        found: list[PlannedJoint] = []
        seen, todo = {root}, [root]
        for body in todo:
            for joint in self.joints:
                if joint.parent == body and joint.child not in seen:
                    found.append(joint)
                elif joint.child == body and joint.parent not in seen:
                    found.append(replace(joint, parent=joint.child, child=joint.parent, axis_3=-joint.axis_3))
                else:
                    continue
                seen.add(found[-1].child)
                todo.append(found[-1].child)
        return found

    def posed(self, angles: dict[str, float]) -> tuple[Plan, list[np.ndarray]]:
        """The same robot with another pose for its zero, and how each body has moved (4, 4).

        Args:
            angles: how far joints are turned in the new zero pose [rad], by role; 0 for the others.
        """
        moved = [np.eye(4) for _ in self.bodies]
        joints = []
        for joint in self.rooted(0):
            angle = angles.get(joint.role, 0.0)
            if joint.mimics is not None:
                angle = angles.get(joint.mimics[0], 0.0) * joint.mimics[1]
            pose_44 = moved[joint.parent]
            moved[joint.child] = pose_44 @ about(joint.point_3, joint.axis_3, angle) if joint.moves else pose_44
            limits = [None if end is None else end - angle for end in (joint.lower, joint.upper)]
            joints.append(replace(
                joint, point_3=pose_44[:3, :3] @ joint.point_3 + pose_44[:3, 3],
                axis_3=pose_44[:3, :3] @ joint.axis_3, lower=limits[0], upper=limits[1],
            ))  # fmt: skip
        order = {joint.role: i for i, joint in enumerate(self.joints)}
        joints.sort(key=lambda joint: order[joint.role])
        points = {
            name: (body, moved[body][:3, :3] @ point_3 + moved[body][:3, 3])
            for name, (body, point_3) in self.points.items()
        }
        directions = {name: (body, moved[body][:3, :3] @ way_3) for name, (body, way_3) in self.directions.items()}
        return Plan(self.bodies, joints, self.solids, points, directions), moved


def about(point_3: np.ndarray, axis_3: np.ndarray, angle: float) -> np.ndarray:
    """The turn (4, 4) about a line; O. Rodrigues, 1840."""
    x, y, z = axis_3 / np.linalg.norm(axis_3)
    cross_33 = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    pose_44 = np.eye(4)
    pose_44[:3, :3] += math.sin(angle) * cross_33 + (1 - math.cos(angle)) * cross_33 @ cross_33
    pose_44[:3, 3] = point_3 - pose_44[:3, :3] @ point_3
    return pose_44


def mirrored(vector_3: np.ndarray, side: float) -> np.ndarray:
    """A vector of the left side, or its mirror image on the right one (side -1)."""
    return np.array([vector_3[0], side * vector_3[1], vector_3[2]], float)
