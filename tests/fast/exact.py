"""Retargeters in float64, which leaves rounding no say."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from contextlib import contextmanager

import torch
from torch import nn

from mrhubo.retargeter import Retargeter


class _Exact(Retargeter):
    """A retargeter that may be in float64, which is for tests alone."""

    _apply = nn.Module._apply
    predict, judge, answer = (
        torch.no_grad()(method.__wrapped__)  # pyright: ignore[reportFunctionMemberAccess]
        for method in (Retargeter.predict, Retargeter.judge, Retargeter.answer)
    )


def in_double(retargeter: Retargeter) -> Retargeter:
    """The same in float64; collision shapes are read in float32 before."""
    assert retargeter.avoidance.collision is retargeter.collision
    exact = copy.deepcopy(retargeter)
    exact.__class__ = _Exact
    return exact.double()


@contextmanager
def double() -> Iterator[None]:
    """PyTorch works in float64."""
    torch.set_default_dtype(torch.float64)
    try:
        yield
    finally:
        torch.set_default_dtype(torch.float32)
