"""The retargeter: networks, and the package that a user takes away."""

from mrhubo.fast.retargeter import POLISH
from mrhubo.retargeter.architecture import build_network
from mrhubo.retargeter.features import PoseFeatures
from mrhubo.retargeter.networks import JointNetwork, RetargetNetwork
from mrhubo.retargeter.package import Retargeter
from mrhubo.retargeter.result import RetargetResult, join_results
from mrhubo.retargeter.saving import read_package_robot
from mrhubo.retargeter.universal import UniversalJoints
from mrhubo.retargeter.without_training import optimised, untrained

__all__ = [
    "POLISH",
    "JointNetwork",
    "PoseFeatures",
    "RetargetNetwork",
    "RetargetResult",
    "Retargeter",
    "UniversalJoints",
    "build_network",
    "join_results",
    "optimised",
    "read_package_robot",
    "untrained",
]
