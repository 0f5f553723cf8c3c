"""The retargeter: networks, their training, and the package that a user takes away."""

from mrhubo.retargeter.features import PoseFeatures
from mrhubo.retargeter.module import LOG_EVERY, RetargetModule
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
