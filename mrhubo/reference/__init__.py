"""Optimisation-based human -> robot retargeting (the ground truth, and the peer to beat), and the metrics."""

from mrhubo.reference.avoidance import Avoidance
from mrhubo.reference.jacobian import DirectionJacobian
from mrhubo.reference.metrics import (
    angle_between,
    at_limit_share,
    count_jumps,
    direction_error,
    direction_jerk,
    joint_error,
    limit_shares,
    link_error,
)
from mrhubo.reference.polish import Polish
from mrhubo.reference.result import OptimizationResult
from mrhubo.reference.retarget import OptimizationRetargeter, ReferenceResult
from mrhubo.reference.solve import DirectionProblem

__all__ = [
    "Avoidance",
    "DirectionJacobian",
    "DirectionProblem",
    "OptimizationResult",
    "OptimizationRetargeter",
    "Polish",
    "ReferenceResult",
    "angle_between",
    "at_limit_share",
    "count_jumps",
    "direction_error",
    "direction_jerk",
    "joint_error",
    "limit_shares",
    "link_error",
]
