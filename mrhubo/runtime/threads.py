"""How many threads torch works with.

Two threads round a long sum otherwise than one, so that a training may differ in its last digits: threads are counted,
never tried out for speed, and whoever wants another number sets OMP_NUM_THREADS.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from mrhubo.fast.side_by_side import wanted_threads


@contextmanager
def use_threads(count: int | None = None) -> Iterator[None]:
    """Inside, torch works with `count` threads; default: `wanted_threads`."""
    before = torch.get_num_threads()
    torch.set_num_threads(count or wanted_threads())
    try:
        yield
    finally:
        torch.set_num_threads(before)
