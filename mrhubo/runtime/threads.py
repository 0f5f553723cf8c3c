"""How many threads torch works with.

Two threads round a long sum otherwise than one, so that a training may differ in its last digits: threads are counted,
never tried out for speed, and whoever wants another number sets OMP_NUM_THREADS.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

import torch

from mrhubo.fast.side_by_side import available_cores


def wanted_threads() -> int:
    """What OMP_NUM_THREADS says, else one a core.

    torchrun sets it to 1 for its processes unless the user has set it, so that there 1 counts as not set.
    """
    text = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0].strip()  # a list has a number for each level
    number = int(text) if text.isdecimal() else 0
    if number == 1 and "TORCHELASTIC_RUN_ID" in os.environ:
        number = 0
    return number or available_cores()


@contextmanager
def use_threads(count: int | None = None) -> Iterator[None]:
    """Inside, torch works with `count` threads; default: `wanted_threads`."""
    before = torch.get_num_threads()
    torch.set_num_threads(count or wanted_threads())
    try:
        yield
    finally:
        torch.set_num_threads(before)
