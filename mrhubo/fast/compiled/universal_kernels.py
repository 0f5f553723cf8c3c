"""The function that Python calls for the universal network; kept on disk as those of `mrhubo.fast.compiled.kernels`.

Legend: B frames, D directions, N joints.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled import robot, steps, tables, universal
from mrhubo.fast.kept import checksum, drop_others


@cache
def make_universal_kernel() -> Callable[..., Any]:
    """The function, the same for all robots."""
    version = checksum()

    @njit(cache=True, **tables.COMPILED)
    def unroll(t, u, w, target_BD3, out_BN):
        """Joint angles (B, N) [rad], inside the limits, for human directions (B, D, 3)."""
        _ = version
        joints = out_BN.shape[1]
        work, tried = robot.make_work(t), universal.make_tried(t, u)
        room = universal.make_layers(t, u, w)
        q_N = np.empty(joints)
        for b in range(len(target_BD3)):
            steps.aim(t, work, target_BD3, b)
            universal.unroll(t, u, w, work, tried, room, q_N)
            for n in range(joints):
                low, high = np.float32(tables.real(t, tables.LOWER_N, n)), np.float32(tables.real(t, tables.UPPER_N, n))
                out_BN[b, n] = min(max(np.float32(q_N[n]), low), high)

    drop_others(unroll.stats.cache_path)
    return unroll
