"""Pieces of work that do not need each other, side by side in threads, one a core if OMP_NUM_THREADS says nothing.

It gains where most of the work lets other threads run meanwhile, as compiled functions and NumPy's on long arrays do.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
FEW = 32
"""Up to so many frames are worked on by one thread: others would have to be woken first."""
_PARTS = 8
"""That each thread's share of many frames is divided into."""


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def wanted_threads() -> int:
    """What OMP_NUM_THREADS says, as of every library that works in threads; else one a core.

    torchrun sets it to 1 for its processes unless the user has set it, so that there 1 counts as not set.
    """
    text = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0].strip()  # a list has a number for each level
    number = int(text) if text.isdecimal() else 0
    if number == 1 and "TORCHELASTIC_RUN_ID" in os.environ:
        number = 0
    return number or available_cores()


def side_by_side(work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """The results of work on each item, in their order. Threads take one item after the other, and the caller's is one
    of them; so work may itself be done side by side, and is, where threads are idle.
    """
    found: dict[int, Result] = {}
    numbers = itertools.count()

    def run() -> None:
        nonlocal numbers
        try:
            while (number := next(numbers)) < len(items):
                found[number] = work(items[number])
        except BaseException:
            numbers = itertools.count(len(items))  # the others need not go on
            raise

    others = min(len(items), wanted_threads()) - 1
    helpers = [_pool().submit(run) for _ in range(others)]
    try:
        run()
    finally:
        # One that has not begun would find nothing left to do, and may have to wait behind others for long.
        begun = [helper for helper in helpers if not helper.cancel()]
        wait(begun)
    for helper in begun:
        helper.result()
    return [found[number] for number in range(len(items))]


def in_parts(frames: int, work: Callable[[slice], Result]) -> list[Result]:
    """Work on all of some frames, side by side where they are many; each thread takes one part after the other, as some
    frames take ten times as long as others.
    """
    threads = 1 if frames <= FEW else wanted_threads()
    if threads == 1:
        return [work(slice(0, frames))]
    length = max(FEW, -(-frames // (_PARTS * threads)))
    return side_by_side(work, [slice(first, first + length) for first in range(0, frames, length)])


_pools: dict[tuple[int, int], ThreadPoolExecutor] = {}
"""By process, as a fork has none of its parent's threads, and by how many threads are wanted beside the caller's."""


def _pool() -> ThreadPoolExecutor:
    key = os.getpid(), max(1, wanted_threads() - 1)
    # Of two threads that come first, one's pool is taken; the other's has begun no thread.
    return _pools.get(key) or _pools.setdefault(key, ThreadPoolExecutor(key[1], "mrhubo"))
