"""The retargeter: networks, and the package that a user takes away."""

from mrhubo.retargeter.features import PoseFeatures
from mrhubo.retargeter.networks import RetargetNetwork
from mrhubo.retargeter.package import POLISH, Retargeter, RetargetResult, build_network

__all__ = [
    "POLISH",
    "PoseFeatures",
    "RetargetNetwork",
    "RetargetResult",
    "Retargeter",
    "build_network",
]
