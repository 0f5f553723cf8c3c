"""How many threads torch works with.

Two threads round a long sum otherwise than one, so that a training may differ in its last digits: threads are counted,
never tried out for speed, and whoever wants another number sets OMP_NUM_THREADS.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence, Sized
from contextlib import contextmanager
from typing import TypeVar

import torch

from mrhubo.fast.side_by_side import side_by_side, wanted_threads

_Item = TypeVar("_Item", bound=Sized)
_Result = TypeVar("_Result")


@contextmanager
def use_threads(count: int | None = None) -> Iterator[None]:
    """Inside, torch works with `count` threads; default: `wanted_threads`."""
    before = torch.get_num_threads()
    torch.set_num_threads(count or wanted_threads())
    try:
        yield
    finally:
        torch.set_num_threads(before)


def each_in_a_thread(work: Callable[[_Item], _Result], items: Sequence[_Item]) -> list[_Result]:
    """The results of torch's work on each item, in their order: each in one thread, `wanted_threads` of them side by
    side, the longest first. Two threads that share small products of matrices wait for each other, and those that have
    an item each do not; and what comes out does not depend on how many there are. Where torch works with one thread, so
    does this.
    """
    longest = sorted(range(len(items)), key=lambda place: -len(items[place]))

    def alone(place: int) -> _Result:
        torch.set_num_threads(1)  # each thread has a number of its own
        return work(items[place])

    if torch.get_num_threads() == 1:
        return [work(item) for item in items]
    with use_threads(1):
        found = dict(zip(longest, side_by_side(alone, longest), strict=True))
    return [found[place] for place in range(len(items))]
