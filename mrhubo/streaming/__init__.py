"""Retargeting frame after frame: the last answer, filters, and the limits of speed and acceleration."""

from mrhubo.fast import StreamSettings
from mrhubo.streaming.stream import Stream

__all__ = ["Stream", "StreamSettings"]
