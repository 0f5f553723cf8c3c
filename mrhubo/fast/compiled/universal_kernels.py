"""The function that Python calls for the universal network; kept on disk as those of `mrhubo.fast.compiled.kernels`.

Legend: B frames, D directions, N joints.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled import lane_arrays, lanes, polishing, robot, tables, universal
from mrhubo.fast.compiled.reading import read_quickly
from mrhubo.fast.kept import checksum, drop_others


@cache
def make_universal_kernel() -> Callable[..., Any]:
    """The function, the same for all robots."""
    version = checksum()

    @njit(cache=True, **tables.COMPILED)
    def unroll(t, u, w, target_BD3, out_BN):
        """Joint angles (B, N) [rad], inside the limits, for human directions (B, D, 3)."""
        _ = version
        joints, directions = out_BN.shape[1], target_BD3.shape[1]
        work, tried = robot.make_lane_work(t), universal.make_tried(t, u)
        room = universal.make_layers(t, u, w)
        target_1D3 = lane_arrays.zeros(lanes.filled(0.0), (1, directions, 3))
        at, frames, frame_L = 0, len(target_BD3), np.empty(lanes.LANES, np.intp)
        while at < frames:
            count, together = min(lanes.LANES, frames - at), 1
            while together < count:
                together *= 2
            for lane in range(lanes.LANES):
                frame_L[lane] = at + min(lane % together, count - 1)
            polishing.aim_at(t, work, target_1D3, target_BD3, frame_L)
            universal.unroll(t, u, w, work, tried, room, together)
            for n in range(joints):
                low, high = np.float32(tables.real(t, tables.LOWER_N, n)), np.float32(tables.real(t, tables.UPPER_N, n))
                for f in range(count):
                    out_BN[at + f, n] = min(max(np.float32(tried.best_FN[f, n]), low), high)
            at += count

    drop_others(unroll.stats.cache_path)
    return read_quickly(unroll)
