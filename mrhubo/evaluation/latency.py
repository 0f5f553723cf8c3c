"""How long a retargeter takes for a frame.

Legend: T frames, J = 21 human joints.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from mrhubo.evaluation.clips import Clip
from mrhubo.runtime.threads import use_threads

_MANY = 1_000
"""Frames that are retargeted at once, beside one alone."""


def latency_us(predict: Callable[[Tensor], Tensor], local_TJ33: Tensor, batch: int, seconds: float = 0.5) -> float:
    """Median time a frame [us] of `batch` frames at once, one thread, over calls that take `seconds` together."""
    frames = local_TJ33.repeat(-(-batch // len(local_TJ33)), 1, 1, 1)[:batch]
    found = []
    with use_threads(1):
        predict(frames)
        end = time.perf_counter() + seconds
        while not found or time.perf_counter() < end:
            start = time.perf_counter()
            predict(frames)
            found.append(time.perf_counter() - start)
    return 1e6 * sorted(found)[len(found) // 2] / batch


def latencies(predict: Callable[[Tensor], Tensor], clips: Sequence[Clip], seconds: float = 0.1) -> dict[str, float]:
    """`latency_us` of one frame alone and `latency_1000_us` a frame of 1,000 at once, frames of the clips: as
    `latency_us`.
    """
    local_TJ33 = torch.cat([clip.motion.local_TJ33 for clip in clips])
    batches = {"latency_us": 1, "latency_1000_us": _MANY}
    return {name: latency_us(predict, local_TJ33, batch, seconds) for name, batch in batches.items()}
