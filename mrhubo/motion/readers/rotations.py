"""Rotations in the arrays of strangers: axis-angle or matrices, in rows or with an axis for the joints.

Legend: T frames, N frames of a block, K joints that an array has, J = 21: SMPL's joints 1..21, X numbers of a row.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.fast.rotations import are_crooked, axis_angle_to_matrix, orthonormal
from mrhubo.motion.checks import MAX_TURN, Turns

JOINTS = 21
"""SMPL's joints 1..21."""
WITH_ROOT, WITHOUT_ROOT = (22, 24, 52, 53, 55), (21, 23)
"""How many joints a pose has: of body, SMPL, SMPL-H, SMPL-X without eyes, and SMPL-X; and of SMPL-X's or SMPL's body
without the root."""


@dataclass(frozen=True)
class Form:
    """How the rows of an array tell the rotations of some joints."""

    joints: int
    """K."""
    matrices: bool
    """Nine numbers a joint, row after row of its matrix; else three, axis times angle [rad]."""

    @property
    def numbers(self) -> int:
        """Of one joint."""
        return 9 if self.matrices else 3

    @property
    def width(self) -> int:
        """X = K times that."""
        return self.numbers * self.joints


def find_form(shape: tuple[int, ...], counts: Collection[int]) -> Form | None:
    """The form of an array, by its shape: (T, 3 K), (T, K, 3), (T, 9 K) or (T, K, 3, 3); None where it is neither.

    Args:
        shape: of the array, T first.
        counts: how many joints, K, may be meant.
    """
    rest = shape[1:]
    if len(rest) >= 2 and rest[-2:] == (3, 3) and math.prod(rest[:-2]) in counts:
        return Form(math.prod(rest[:-2]), True)
    if len(rest) >= 2 and rest[-1] == 3 and math.prod(rest[:-1]) in counts:
        return Form(math.prod(rest[:-1]), False)
    width = math.prod(rest) if rest[:-1] == (1,) * (len(rest) - 1) else 0
    for numbers in (3, 9):
        if width and width % numbers == 0 and width // numbers in counts:
            return Form(width // numbers, numbers == 9)
    return None


def rows_of(array: np.ndarray) -> np.ndarray:
    """An array (T, ...) as rows (T, X), also where T is 0; a single number as one row."""
    return array.reshape(len(array), math.prod(array.shape[1:])) if array.ndim else array.reshape(1, 1)


def read_local(
    path: Path, key: str, frames: int, blocks: Iterable[tuple[int, np.ndarray]], form: Form, first: int
) -> np.ndarray:
    """Local rotations (T, 21, 3, 3), float32, of 21 joints of an array.

    Args:
        path: the file, for sentences.
        key: what the array is called in it.
        frames: T.
        blocks: rows (N, X), float64, one block after another, each with the number of its first frame.
        form: of the rows.
        first: which of the rows' joints is SMPL's joint 1.

    Raises:
        UserError: something is no rotation (says in which frame), or angles are in degrees.
    """
    local_TJ33 = np.empty((frames, JOINTS, 3, 3), np.float32)
    turns, columns = Turns(), slice(first * form.numbers, (first + JOINTS) * form.numbers)
    for start, rows_NX in blocks:
        joints_NJX = rows_NX[:, columns].reshape(-1, JOINTS, form.numbers)
        if form.matrices:
            local_NJ33 = _from_matrices(path, key, joints_NJX, start, columns.start)
        else:
            local_NJ33 = _from_axis_angle(path, key, joints_NJX, start, columns.start, turns)
        local_TJ33[start : start + len(rows_NX)] = local_NJ33
    if turns.are_degrees:
        raise UserError(
            f"{path}: '{key}' is no axis-angle in radians (degrees?): {turns.described}; multiply it by pi / 180"
        )
    return local_TJ33


def to_matrices(rows_TX: np.ndarray, form: Form, largest: float) -> np.ndarray | None:
    """Rotations (T, K, 3, 3), float32, of rows that are not needed; None where they are none.

    Args:
        rows_TX: rows (T, X).
        form: of the rows.
        largest: no axis-angle number is beyond it [rad].
    """
    values_TKX = rows_TX.reshape(len(rows_TX), form.joints, form.numbers).astype(np.float64)
    if form.matrices:
        matrix_TK33 = values_TKX.reshape(*values_TKX.shape[:2], 3, 3)
        return None if are_crooked(matrix_TK33).any() else orthonormal(matrix_TK33).astype(np.float32)
    if not (np.abs(values_TKX) <= largest).all():
        return None
    return axis_angle_to_matrix(values_TKX).astype(np.float32)


def _from_axis_angle(path: Path, key: str, values_NJ3: np.ndarray, start: int, column: int, turns: Turns) -> np.ndarray:
    turn_NJ = np.linalg.norm(values_NJ3, axis=-1)
    bad_M2 = np.argwhere(~(turn_NJ <= MAX_TURN))
    if len(bad_M2):
        frame, joint = bad_M2[0].tolist()
        numbers = np.abs(values_NJ3[frame, joint])
        place = int(np.argmax(np.where(np.isnan(numbers), np.inf, numbers)))
        value = float(values_NJ3[frame, joint, place])
        why = "is not finite" if not math.isfinite(value) else "is no axis-angle number in radians (degrees?)"
        raise UserError(
            f"{path}: '{key}' {why} in frame {start + frame}, number {column + 3 * joint + place}: {value:g}"
        )
    turns.add(turn_NJ)
    return axis_angle_to_matrix(values_NJ3).astype(np.float32)


def _from_matrices(path: Path, key: str, values_NJ9: np.ndarray, start: int, column: int) -> np.ndarray:
    matrix_NJ33 = values_NJ9.reshape(*values_NJ9.shape[:2], 3, 3)
    bad_M2 = np.argwhere(are_crooked(matrix_NJ33))
    if len(bad_M2):
        frame, joint = bad_M2[0].tolist()
        finite = np.isfinite(values_NJ9[frame, joint]).all()
        why = "is no rotation matrix" if finite else "is not finite"
        raise UserError(f"{path}: '{key}' {why} in frame {start + frame}, joint {column // 9 + joint}")
    return orthonormal(matrix_NJ33).astype(np.float32)
