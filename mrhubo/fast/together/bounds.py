"""What the moves of a motion's joints are bounded by: limits of joints, and of their steps from frame to frame.

Legend: T frames, X = T - 1 steps between them, M joints, K sides: lower and upper of each move, and, where steps are
bounded, lower and upper of the step to each frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_FAR = 10.0
"""A bound [rad] that no move reaches: of frames that stay, and of steps whose bounds do not count."""


@dataclass(frozen=True)
class Bounds:
    """apply(moves) <= upper."""

    upper_KTM: np.ndarray
    """Upper bounds of what `apply` gives [rad]."""
    free_T1: np.ndarray
    """1 in frames that move, 0 in those that stay."""
    counts_T1: np.ndarray
    """1 where the step to a frame is bounded."""

    @classmethod
    def of(
        cls,
        move_2TM: np.ndarray,
        free_T: np.ndarray,
        step_2XM: np.ndarray | None = None,
        counts_X: np.ndarray | None = None,
    ) -> Bounds:
        """Of moves between lower and upper bounds (2, T, M) [rad], and of steps between others (2, X, M); where those
        count (X,).
        """
        free_T1, counts_T1 = free_T.astype(float)[:, None], np.zeros((len(free_T), 1))
        sides = [np.where(free_T1 > 0, -move_2TM[0], _FAR), np.where(free_T1 > 0, move_2TM[1], _FAR)]
        if step_2XM is not None and counts_X is not None and counts_X.any():
            counts_T1[1:, 0] = counts_X
            for side_XM in (-step_2XM[0], step_2XM[1]):
                sides.append(np.where(counts_T1 > 0, np.pad(side_XM, ((1, 0), (0, 0))), _FAR))
        return cls(np.stack(sides), free_T1, counts_T1)

    @property
    def of_steps(self) -> bool:
        """Whether any step is bounded."""
        return len(self.upper_KTM) > 2

    def apply(self, x_TM: np.ndarray) -> np.ndarray:
        """All that is bounded from above (K, T, M), of moves (T, M)."""
        found_KTM = np.zeros_like(self.upper_KTM)
        np.negative(x_TM, out=found_KTM[0])
        found_KTM[1] = x_TM
        if self.of_steps:
            np.multiply(np.diff(x_TM, axis=0), self.counts_T1[1:], out=found_KTM[3, 1:])
            np.negative(found_KTM[3], out=found_KTM[2])
        return found_KTM

    def transposed(self, y_KTM: np.ndarray) -> np.ndarray:
        """The transpose of `apply`, for frames that move (T, M)."""
        found_TM = y_KTM[1] - y_KTM[0]
        if self.of_steps:
            step_TM = self.counts_T1 * (y_KTM[3] - y_KTM[2])
            found_TM += step_TM
            found_TM[:-1] -= step_TM[1:]
        found_TM *= self.free_T1
        return found_TM

    def stiffness(self, stiff_KTM: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """The transpose of `apply`, times a diagonal matrix, times `apply`: its diagonal (T, M), and its entries
        between a frame and the next (X, M); None: there are none.
        """
        found_TM = stiff_KTM[0] + stiff_KTM[1]
        if not self.of_steps:
            return found_TM * self.free_T1, None
        step_TM = self.counts_T1 * (stiff_KTM[2] + stiff_KTM[3])
        found_TM += step_TM
        found_TM[:-1] += step_TM[1:]
        return found_TM * self.free_T1, -step_TM[1:] * self.free_T1[1:] * self.free_T1[:-1]
