"""The compiled form of the floor under one robot.

Legend: H points of soles, L human joints, D directions, N joints.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mrhubo.fast.plain.ground import Base, Seen

if TYPE_CHECKING:
    from mrhubo.fast.compiled.ground_kernels import GroundKernels


class CompiledGround:
    """As `mrhubo.fast.plain.ground.PlainGround`."""

    def __init__(
        self, tables: tuple[np.ndarray, ...], kernels: GroundKernels, points: int, joints: int, longest_step: float,
        floor: float | None,
    ) -> None:  # fmt: skip
        """Nobody has been seen. `points`: H; `joints`: L; the rest as of `PlainGround`."""
        from mrhubo.fast.compiled.contacts import FLOOR, HEIGHTS
        from mrhubo.fast.compiled.ground import Floor

        self._tables, self._kernels, self._points = tables, kernels, points
        self._longest_step, self._floor = float(longest_step), np.nan if floor is None else float(floor)
        numbers, places, flags = np.zeros(points), np.zeros((points, 3)), np.zeros(points, np.bool_)
        self._f = Floor(
            places, places.copy(), numbers, flags, flags.copy(), numbers.copy(), places.copy(), numbers.copy(),
            np.zeros(HEIGHTS), np.zeros(HEIGHTS + 1), np.zeros(4), np.zeros(3), np.eye(3)[None].copy(), np.zeros(3),
            places.copy(), places.copy(), numbers.copy(), places.copy(), np.zeros((joints + 1, 3, 3)),
            np.zeros((joints + 1, 3)), np.zeros((4, 3)),
        )  # fmt: skip
        self._f.number_4[FLOOR] = np.nan
        self._nothing = np.zeros(0, np.bool_)

    @property
    def planted_R(self) -> np.ndarray:
        """Whether each foot is planted."""
        return np.logical_or(self._f.planted_H[::2], self._f.planted_H[1::2])

    @property
    def weight_H(self) -> np.ndarray:
        """As `PlainGround.weight_H`."""
        return self._f.weight_H.copy()

    def pass_by(self) -> None:
        """As `PlainGround.pass_by`."""
        self._f.held_H[:] = self._f.planted_H

    def look(self, seen: Seen, aim_D3: np.ndarray, turn_33: np.ndarray, passed: float) -> tuple[np.ndarray, np.ndarray]:
        """As `PlainGround.look`."""
        directions = len(aim_D3)
        wanted_X3 = np.concatenate((aim_D3, np.zeros((2 * self._points, 3))))
        # In one order of memory, which of a rotation that was turned over would be another: numba would compile anew.
        root_43 = np.ascontiguousarray(np.concatenate((seen.place_3[None], seen.turn_33)))
        self._f.turn_133[0] = turn_33
        given_H = self._nothing if seen.given_H is None else seen.given_H
        self._kernels.look(
            self._tables, self._f, seen.local_J33, root_43, given_H, self._floor, self._longest_step, float(passed),
            wanted_X3,
        )  # fmt: skip
        return wanted_X3[:directions].copy(), wanted_X3

    def stand(self, q_N: np.ndarray) -> Base:
        """As `PlainGround.stand`."""
        self._kernels.stand(self._tables, self._f, q_N.astype(np.float64))
        base_43 = self._f.base_43.copy()
        return Base(base_43[0], base_43[1:])
