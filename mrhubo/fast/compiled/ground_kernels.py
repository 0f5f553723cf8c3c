"""The functions that Python calls for robots that stand on feet, and where no network answers; kept on disk as those of
`mrhubo.fast.compiled.kernels`.

Legend: B frames, D directions, N joints, H points of soles.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled import contacts, ground, steps, tables
from mrhubo.fast.compiled import robot as robots
from mrhubo.fast.compiled.reading import read_quickly
from mrhubo.fast.kept import checksum, drop_others


class GroundKernels(NamedTuple):
    """Compiled functions."""

    start: Callable[..., Any]
    look: Callable[..., Any]
    stand: Callable[..., Any]


@cache
def make_ground_kernels() -> GroundKernels:
    """The functions, the same for all robots."""
    version = checksum()

    @njit(cache=True, **tables.COMPILED)
    def start(t, target_BX3, most, q_BN):
        """As many steps at most from `q_BN`, where the answers will stand; 0: from the nearest poses."""
        _ = version
        work = robots.make_work(t)
        for b in range(len(q_BN)):
            if most:
                steps.aim(t, work, target_BX3, b)
                steps.minimise(t, work, q_BN[b], most)
            else:
                steps.nearest(t, work, target_BX3, b, q_BN[b])

    @njit(cache=True, **tables.COMPILED)
    def look(t, f, local_J33, root_43, given_H, floor, longest_step, passed, aim_X3):
        """What a frame asks for, into `aim_X3`, whose first D rows are directions; `root_43`: the person's place and
        rotation, and the turn of what carries the legs stands in `f` already.
        """
        _ = version
        root = ground.person(t, f, local_J33, root_43[1:], root_43[0])
        contacts.next_contacts(f, passed, floor, given_H, root[1])
        ground.stand_flat(t, f, aim_X3)
        ground.ask(t, f, root, aim_X3, passed, longest_step)

    @njit(cache=True, **tables.COMPILED)
    def stand(t, f, q_N):
        """Where the base is, into `f`, for joint angles [rad]."""
        _ = version
        work = robots.make_work(t)
        robots.place(t, work, q_N)
        ground.stand(t, work, f)

    drop_others(start.stats.cache_path)
    return GroundKernels(*map(read_quickly, (start, look, stand)))
