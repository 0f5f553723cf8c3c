"""A trained retargeter without PyTorch: the run-time path as plain arrays, compiled by numba, or in NumPy."""

from mrhubo.fast.description import Description
from mrhubo.fast.retargeter import FastRetargeter
from mrhubo.fast.stream import FastStream
from mrhubo.fast.stream_settings import StreamSettings

__all__ = ["Description", "FastRetargeter", "FastStream", "StreamSettings"]
