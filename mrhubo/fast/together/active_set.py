"""The minimum of a motion's quadratic model inside bounds, by the set of those that hold it: solved as if some bounds
held and no other was there, then once more with those that are overstepped, and without those that pull, until the set
stays (M. Hintermueller, K. Ito, K. Kunisch, "The primal-dual active set strategy as a semismooth Newton method", SIAM
Journal on Optimization, 2002).

Where few bounds change that is one to three systems. Where many do, among frames that jerk ties closely to each other,
the set may go to and fro for long; that shows at once, and then another method has to go on.

Legend: T frames, M joints, K sides of bounds.
"""

from __future__ import annotations

import numpy as np

from mrhubo.fast.together.banded import Banded, Factor
from mrhubo.fast.together.bounds import Bounds

GIVE = 1e-6
"""How far a bound gives way [rad] for each unit of its multiplier: so there is a minimum, too, where bounds leave no
room between them (a joint that must run all the way from one settled frame to another)."""
_MOST = 12
"""Systems at most."""
_SHRINK = 0.5
"""As long as each set changes this much less than the one before, it is worth going on."""
_HELD, _OVER = -1e-10, 1e-9
"""[rad] above its bound, where a move is still held by it, or begins to be."""


def by_active_set(matrix: Banded, right_TM: np.ndarray, bounds: Bounds, factor: Factor) -> tuple[np.ndarray, bool]:
    """Moves (T, M) [rad], and whether the set stayed: they are the minimum then, and else near it and partly beyond
    bounds. As for `mrhubo.fast.together.bounded.bounded_minimum`.
    """
    x_TM, changes_before = right_TM, np.inf
    held_KTM = (bounds.upper_KTM <= _OVER) & (bounds.apply(right_TM) > 0)
    for _ in range(_MOST):
        stiff_KTM = held_KTM / GIVE
        solve = factor(matrix.plus(*bounds.stiffness(stiff_KTM)))
        x_TM = solve(right_TM + bounds.transposed(stiff_KTM * bounds.upper_KTM))
        next_KTM = bounds.apply(x_TM) - bounds.upper_KTM > np.where(held_KTM, _HELD, _OVER)
        changes = np.count_nonzero(next_KTM != held_KTM)
        if not changes:
            return x_TM, True
        if changes > _SHRINK * changes_before:
            break
        held_KTM, changes_before = next_KTM, changes
    return x_TM, False
