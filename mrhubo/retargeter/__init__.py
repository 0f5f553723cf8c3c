"""The retargeter: networks, and the package that a user takes away."""

from mrhubo.retargeter.architecture import build_network
from mrhubo.retargeter.features import PoseFeatures
from mrhubo.retargeter.networks import RetargetNetwork
from mrhubo.retargeter.package import POLISH, Retargeter
from mrhubo.retargeter.result import RetargetResult, join_results

__all__ = ["POLISH", "PoseFeatures", "RetargetNetwork", "RetargetResult", "Retargeter", "build_network", "join_results"]
