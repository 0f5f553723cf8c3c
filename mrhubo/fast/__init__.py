"""A trained retargeter without PyTorch: the run-time path as plain arrays, compiled by numba, or in NumPy."""

from mrhubo.fast.description import Description
from mrhubo.fast.retargeter import FastRetargeter

__all__ = ["Description", "FastRetargeter"]
