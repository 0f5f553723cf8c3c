"""Where the points of a human body are, in pictures and videos of a camera; needs no PyTorch.

What works with LiteRT and PyAV (the extra `video`) is imported when it is first asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mrhubo.lazy import lazy_names

if TYPE_CHECKING:
    from mrhubo.video.estimator import Estimate, PoseEstimator
    from mrhubo.video.models import MODELS, find_models, set_up

__all__ = ["MODELS", "Estimate", "PoseEstimator", "find_models", "set_up"]
_HOMES = {
    "MODELS": ".models",
    "Estimate": ".estimator",
    "PoseEstimator": ".estimator",
    "find_models": ".models",
    "set_up": ".models",
}
"""Module of each public name."""

__getattr__ = lazy_names(__name__, _HOMES)
