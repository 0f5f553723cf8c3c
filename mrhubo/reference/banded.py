"""Banded systems by LAPACK, which takes a time proportional to the frames.

Legend: T frames, M joints of one block.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from mrhubo.fast.together.banded import Banded, Solve

_LEAST, _MOST = 1e-12, 1e-4


def factor(system: Banded, more: float = 0.0) -> Solve:
    """Solves by a Cholesky factor in lower banded form.

    Args:
        system: positive definite; where rounding leaves it no more so, its diagonal is made a little larger.
        more: share by which the diagonal is larger.
    """
    frames, joints = system.diagonal_TM.shape
    # Row k holds the entries k below the diagonal; the next frame's same joint is `joints` below.
    banded = np.zeros(((len(system.couplings_TMM) + 1) * joints, frames, joints))
    banded[0] = (1 + more) * system.diagonal_TM
    for k in range(1, joints):
        banded[k, :, : joints - k] = np.diagonal(system.within_TMM, offset=-k, axis1=1, axis2=2)
    for lag, coupling_TMM in enumerate(system.couplings_TMM, start=1):
        for n in range(joints):
            banded[lag * joints - n : (lag + 1) * joints - n, : frames - lag, n] = coupling_TMM[..., n].T
    try:
        lower = cholesky_banded(banded.reshape(len(banded), -1), overwrite_ab=True, lower=True, check_finite=False)
    except np.linalg.LinAlgError:
        if more >= _MOST:
            raise
        return factor(system, max(_LEAST, 100 * more))

    def solve(right_TM: np.ndarray) -> np.ndarray:
        return cho_solve_banded((lower, True), right_TM.ravel(), check_finite=False).reshape(right_TM.shape)

    return solve
