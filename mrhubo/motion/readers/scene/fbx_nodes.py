"""Nodes of an FBX file: where each is in its parent, by the many numbers that tell it.

A node is moved, turned about a pivot between two fixed turns, and scaled about another pivot (Autodesk's FBX SDK,
"Computing transformation matrices", https://help.autodesk.com/view/FBX/2020/ENU/):

    T Roff Rp Rpre R Rpost^-1 Rp^-1 Soff Sp S Sp^-1

Legend: F times.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from mrhubo.motion.readers.scene.fbx_curves import Curve
from mrhubo.motion.readers.scene.fbx_file import Record
from mrhubo.motion.readers.scene.nodes import affine
from mrhubo.motion.readers.tree.hierarchy import turn_about

MOVED, TURNED, SCALED = "Lcl Translation", "Lcl Rotation", "Lcl Scaling"
"""What animations move of a node."""
_ORDERS = ("xyz", "xzy", "yzx", "yxz", "zxy", "zyx", "xyz")
"""Axes in the order in which a node turns about them, by their number; the last is for spherical ones."""
_WITHOUT_PARENTS_SCALE = 2
"""How a node inherits: all but its parent's own scale."""
_BONES = ("LimbNode", "Limb", "Root")


@dataclass(frozen=True)
class FbxNode:
    """A node."""

    number: int
    """By which the file calls it."""
    name: str
    is_bone: bool
    values: Mapping[str, np.ndarray]
    """Its properties of three numbers (3,), by name."""
    order: str
    inherits_scale: bool

    def vector(self, name: str) -> np.ndarray:
        """A property (3,)."""
        return self.values.get(name, np.full(3, 1.0 if name == SCALED else 0.0))

    def local(
        self, time_F: np.ndarray, curves: Mapping[str, tuple[Curve | None, ...]], parent_scale_F3: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Where it is in its parent at some times [s]: affine maps (F, 3, 4), and its own scale (F, 3).

        Args:
            time_F: the times.
            curves: of its properties, one for each of three numbers.
            parent_scale_F3: of its parent, which it may not inherit.
        """
        moved_F3, turned_F3, scale_F3 = (
            self._moving(name, time_F, curves.get(name, ())) for name in (MOVED, TURNED, SCALED)
        )
        turn_F33 = (
            _turn(self.vector("PreRotation")[None], "xyz")
            @ _turn(turned_F3, self.order)
            @ _turn(self.vector("PostRotation")[None], "xyz").mT
        )
        pivot_3, scale_pivot_3 = self.vector("RotationPivot"), self.vector("ScalingPivot")
        inner_F3 = self.vector("ScalingOffset") + scale_pivot_3 - scale_F3 * scale_pivot_3 - pivot_3
        place_F3 = moved_F3 + self.vector("RotationOffset") + pivot_3 + (turn_F33 @ inner_F3[..., None])[..., 0]
        local_F34 = affine(place_F3, turn_F33, scale_F3)
        if not self.inherits_scale and parent_scale_F3 is not None:
            local_F34[..., :3] /= np.where(np.abs(parent_scale_F3) > 0, parent_scale_F3, 1.0)[..., None]
        return local_F34, scale_F3

    def _moving(self, name: str, time_F: np.ndarray, curves: tuple[Curve | None, ...]) -> np.ndarray:
        value_F3 = np.repeat(self.vector(name)[None], len(time_F), axis=0)
        for axis, curve in enumerate(curves):
            if curve is not None:
                value_F3[:, axis] = curve.at(time_F)
        return value_F3

    def with_no_turn(self) -> FbxNode:
        """The same where its own angles are 0, which many make the pose at rest."""
        return replace(self, values={**self.values, TURNED: np.zeros(3)})


def read_node(record: Record, usual: Mapping[str, Record]) -> FbxNode | None:
    """A node; None where its record has no number.

    Args:
        record: `Model` of the file.
        usual: properties of nodes that do not tell them.
    """
    number = record.whole()
    if number is None:
        return None
    told = {**usual, **properties(record)}
    values = {name: vector_3 for name, row in told.items() if (vector_3 := _vector(row)) is not None}
    order, inherits = (
        row.values[4] if (row := told.get(name)) is not None and row.whole(4) is not None else 0
        for name in ("RotationOrder", "InheritType")
    )
    return FbxNode(
        number,
        plain_name(record.text(1)),
        record.text(2) in _BONES,
        values,
        _ORDERS[order] if 0 <= order < len(_ORDERS) else "xyz",
        inherits != _WITHOUT_PARENTS_SCALE,
    )


def plain_name(name: str) -> str:
    """A name without its class, which stands behind it in binary files and before it in text."""
    return name.partition("\0")[0] if "\0" in name else name.partition("::")[2] or name


def properties(record: Record) -> dict[str, Record]:
    """The properties of an object, by name."""
    return {row.text(0): row for row in record.first("Properties70").named("P")}


def _vector(row: Record) -> np.ndarray | None:
    """The three numbers (3,) of a property; None of any other."""
    numbers = row.values[4:7]
    if len(numbers) != 3 or not all(isinstance(number, int | float) for number in numbers):
        return None
    vector_3 = np.array(numbers, dtype=np.float64)
    return vector_3 if np.isfinite(vector_3).all() else None


def _turn(angle_F3: np.ndarray, order: str) -> np.ndarray:
    """Rotations (F, 3, 3) about the axes of the world, one after the other, by angles [deg]."""
    turn_33F = np.repeat(np.eye(3)[:, :, None], len(angle_F3), axis=2)
    for axis in reversed(order):
        turn_about(turn_33F, axis, np.radians(angle_F3[:, "xyz".index(axis)]))
    return np.ascontiguousarray(turn_33F.transpose(2, 0, 1))
