"""The retargeter: networks, their training, and the package that a user takes away."""

from mrhubo.fitting.module import LOG_EVERY, RetargetModule
from mrhubo.retargeter.features import PoseFeatures
from mrhubo.retargeter.networks import RetargetNetwork
from mrhubo.retargeter.package import POLISH, Retargeter, RetargetResult, build_network

__all__ = [
    "LOG_EVERY",
    "POLISH",
    "PoseFeatures",
    "RetargetModule",
    "RetargetNetwork",
    "RetargetResult",
    "Retargeter",
    "build_network",
]
