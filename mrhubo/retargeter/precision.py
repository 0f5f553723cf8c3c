"""Retargeters work in float32, whatever the program around them works in."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ParamSpec, Self, TypeVar

import torch
from torch import Tensor, nn

from mrhubo.errors import UserError

_P = ParamSpec("_P")
_R = TypeVar("_R")


class Float32Module(nn.Module):
    """A module that moves to other devices, and stays in float32: its kinematics and limits have no other precision."""

    def to(self, *args: Any, **kwargs: Any) -> Self:
        """As `torch.nn.Module.to`: moves it to a device.

        Raises:
            UserError: as for `_apply`.
        """
        with _named():
            return super().to(*args, **kwargs)

    def _apply(self, fn: Callable[[Tensor], Tensor], recurse: bool = True) -> Self:
        """What `to`, `cpu`, `cuda`, `double`, `half` and their like do to each tensor.

        Raises:
            UserError: this machine, or its PyTorch, has no such device; or the precision is not float32.
        """
        with _named():
            precision = fn(torch.zeros((), dtype=torch.float32)).dtype
        if precision != torch.float32:
            raise UserError(f"retargeters work in float32 alone, not in {precision}: convert their answers instead")
        return super()._apply(fn, recurse)


@contextmanager
def _named() -> Iterator[None]:
    try:
        yield
    except (RuntimeError, AssertionError) as error:  # PyTorch that was built without CUDA asserts
        raise UserError(f"the retargeter cannot go there: {str(error).partition('; ')[0]}") from error


def in_float32(answer: Callable[_P, _R]) -> Callable[_P, _R]:
    """Makes a function compute in float32, inside `torch.autocast` too, and without gradients.

    Raises:
        UserError: at a call, where PyTorch's default is another precision.
    """

    @functools.wraps(answer)
    def wrapped(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        default = torch.get_default_dtype()
        if default != torch.float32:
            cure = "call torch.set_default_dtype(torch.float32) before"
            raise UserError(f"retargeters work in float32, and PyTorch's default is {default}: {cure}")
        with torch.no_grad(), torch.autocast("cpu", enabled=False), torch.autocast("cuda", enabled=False):
            return answer(*args, **kwargs)

    return wrapped
