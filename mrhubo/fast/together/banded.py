"""Linear systems in which each frame of a motion is coupled with the next ones alone.

Legend: T frames, M joints of one block, G groups of frames, H of them that are eliminated, E rows of a group.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mrhubo.fast.plain.steps import diagonal

Solve = Callable[[np.ndarray], np.ndarray]
"""The solution (T, M) for a right side (T, M)."""


@dataclass(frozen=True)
class Banded:
    """A symmetric positive definite matrix of T M rows, frame after frame."""

    within_TMM: np.ndarray
    """Entries between joints of one frame; its diagonal does not count."""
    diagonal_TM: np.ndarray
    couplings_TMM: list[np.ndarray]
    """Entries between the joints one, two ... frames later, the rows, and those of a frame, the columns:
    (T - 1, M, M), (T - 2, M, M) ..."""

    def plus(self, diagonal_TM: np.ndarray, next_XM: np.ndarray | None = None) -> Banded:
        """The same with something added to the diagonal, and to what couples joints with themselves a frame later."""
        couplings_TMM = self.couplings_TMM
        if next_XM is not None:
            first_XMM = couplings_TMM[0].copy()
            diagonal(first_XMM)[:] += next_XM
            couplings_TMM = [first_XMM, *couplings_TMM[1:]]
        return replace(self, diagonal_TM=self.diagonal_TM + diagonal_TM, couplings_TMM=couplings_TMM)

    def times(self, x_TM: np.ndarray) -> np.ndarray:
        """The product (T, M) with moves (T, M)."""
        found_TM = self.diagonal_TM * x_TM
        lower_TMM = np.tril(self.within_TMM, -1)
        found_TM += _times(lower_TMM + lower_TMM.swapaxes(-1, -2), x_TM)
        for lag, coupling_TMM in enumerate(self.couplings_TMM, start=1):
            found_TM[lag:] += _times(coupling_TMM, x_TM[:-lag])
            found_TM[:-lag] += _times(coupling_TMM.swapaxes(-1, -2), x_TM[lag:])
        return found_TM


def _times(matrix_TMM: np.ndarray, x_TM: np.ndarray) -> np.ndarray:
    return (matrix_TMM @ x_TM[..., None])[..., 0]


Factor = Callable[[Banded], Solve]
"""Whoever solves such systems: works on the matrix once, and then answers right sides."""


def halve(system: Banded) -> Solve:
    """Solves by cyclic reduction: groups of frames that are coupled with their neighbours alone; every other group is
    eliminated, all of them at a time, until one is left. (R. A. Sweet, "A generalized cyclic reduction algorithm",
    SIAM Journal on Numerical Analysis, 1974.) Steps are as many as halvings of the frames, not as many as frames, so
    that NumPy alone does it.
    """
    frames, joints = system.diagonal_TM.shape
    own_GEE, next_GEE = _grouped(system)
    levels: list[tuple[np.ndarray, ...]] = []
    while len(own_GEE) > 1:
        kept_GEE, inverse_HEE = own_GEE[0::2].copy(), np.linalg.inv(own_GEE[1::2])
        before_HEE, after_HEE = next_GEE[0::2], next_GEE[1::2]
        first_HEE = inverse_HEE @ before_HEE.swapaxes(-1, -2)
        second_HEE = inverse_HEE[: len(after_HEE)] @ after_HEE
        kept_GEE[: len(before_HEE)] -= before_HEE @ first_HEE
        kept_GEE[1 : 1 + len(after_HEE)] -= after_HEE.swapaxes(-1, -2) @ second_HEE
        levels.append((inverse_HEE, before_HEE, after_HEE, first_HEE, second_HEE))
        own_GEE, next_GEE = kept_GEE, -before_HEE[: len(after_HEE)] @ second_HEE
    last_EE = own_GEE[0]

    def solve(right_TM: np.ndarray) -> np.ndarray:
        right_GE1 = np.zeros((-(-frames * joints // len(last_EE)), len(last_EE), 1))
        right_GE1.reshape(-1)[: right_TM.size] = right_TM.ravel()
        halves = []
        for inverse_HEE, before_HEE, after_HEE, *_ in levels:
            kept_GE1, own_HE1 = right_GE1[0::2].copy(), inverse_HEE @ right_GE1[1::2]
            kept_GE1[: len(before_HEE)] -= before_HEE @ own_HE1
            kept_GE1[1 : 1 + len(after_HEE)] -= after_HEE.swapaxes(-1, -2) @ own_HE1[: len(after_HEE)]
            halves.append(own_HE1)
            right_GE1 = kept_GE1
        found_GE1 = np.linalg.solve(last_EE, right_GE1[0])[None]
        for own_HE1, (*_, first_HEE, second_HEE) in zip(halves[::-1], levels[::-1], strict=True):
            own_HE1 -= first_HEE @ found_GE1[: len(first_HEE)]
            own_HE1[: len(second_HEE)] -= second_HEE @ found_GE1[1 : 1 + len(second_HEE)]
            both_GE1 = np.empty((len(found_GE1) + len(own_HE1), *found_GE1.shape[1:]))
            both_GE1[0::2], both_GE1[1::2] = found_GE1, own_HE1
            found_GE1 = both_GE1
        return found_GE1.reshape(-1)[: frames * joints].reshape(frames, joints)

    return solve


def _grouped(system: Banded) -> tuple[np.ndarray, np.ndarray]:
    """The matrix in groups of as many frames as a frame is coupled with: entries of each group (G, E, E), and between
    each group and the next (G - 1, E, E). Rows that fill up the last group are those of the identity.
    """
    frames, joints = system.diagonal_TM.shape
    size = max(1, len(system.couplings_TMM))
    groups = -(-frames // size)

    def filled(value_TX: np.ndarray, fill: float) -> np.ndarray:
        full = np.full((groups * size, *value_TX.shape[1:]), fill)
        full[: len(value_TX)] = value_TX
        return full.reshape(groups, size, *value_TX.shape[1:])

    own = np.zeros((groups, size, joints, size, joints))
    following = np.zeros((groups, size, joints, size, joints))
    lower_TMM = np.tril(system.within_TMM, -1)
    within_GSMM, diagonal_GSM = filled(lower_TMM + lower_TMM.swapaxes(-1, -2), 0.0), filled(system.diagonal_TM, 1.0)
    joint_M = np.arange(joints)
    for i in range(size):
        own[:, i, :, i] = within_GSMM[:, i]
        own[:, i, joint_M, i, joint_M] = diagonal_GSM[:, i]
    for lag, coupling_TMM in enumerate(system.couplings_TMM, start=1):
        coupling_GSMM = filled(coupling_TMM, 0.0)
        for i in range(size):
            inside, j = divmod(i + lag, size)
            if inside == 0:
                own[:, j, :, i] = coupling_GSMM[:, i]
                own[:, i, :, j] = coupling_GSMM[:, i].swapaxes(-1, -2)
            else:
                following[:, i, :, j] = coupling_GSMM[:, i].swapaxes(-1, -2)
    rows = size * joints
    return own.reshape(groups, rows, rows), following[:-1].reshape(groups - 1, rows, rows)
