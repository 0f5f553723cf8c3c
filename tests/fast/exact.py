"""Retargeters in float64, which leaves rounding no say."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from contextlib import contextmanager

import torch

from mrhubo.retargeter import Retargeter


def in_double(retargeter: Retargeter) -> Retargeter:
    """The same in float64; collision shapes are read in float32 before."""
    assert retargeter.avoidance.collision is retargeter.collision
    return copy.deepcopy(retargeter).double()


@contextmanager
def double() -> Iterator[None]:
    """PyTorch works in float64."""
    torch.set_default_dtype(torch.float64)
    try:
        yield
    finally:
        torch.set_default_dtype(torch.float32)
