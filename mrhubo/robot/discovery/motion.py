"""Where a chain takes points, from its joints' limits.

Legend: B poses, N joints of a chain.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mrhubo.robot.discovery.bodies import Chain, Hinge
from mrhubo.robot.discovery.lines import cross

_FREE = math.pi / 2
"""How far either way a joint without limits is taken to turn."""


def usual_range(hinge: Hinge) -> tuple[float, float]:
    """Limits [rad, or m]; of a rotary joint that has none, a quarter turn either way."""
    if hinge.limited:
        return float(hinge.lower or 0.0), float(hinge.upper or 0.0)
    return (-_FREE, _FREE) if hinge.rotary else (0.0, 0.0)


def turned(vector_X3: np.ndarray, axis_3: np.ndarray, angle_X: np.ndarray | float) -> np.ndarray:
    """Vectors (..., 3) turned about a unit axis by angles (...) [rad]; O. Rodrigues, 1840."""
    angle = np.asarray(angle_X)[..., None]
    along = (vector_X3 @ axis_3)[..., None] * axis_3
    return along + np.cos(angle) * (vector_X3 - along) + np.sin(angle) * np.cross(axis_3, vector_X3)


def carried(chain: Chain, q_BN: np.ndarray, point_3: np.ndarray) -> np.ndarray:
    """Where a point (3,) at a chain's end goes (B, 3) when its joints move from where they stand by q (B, N)."""
    at_B3 = np.broadcast_to(point_3, (len(q_BN), 3))
    for column in reversed(range(len(chain))):
        step, line = chain[column], chain[column].hinge.line
        if step.hinge.rotary:
            at_B3 = line.point_3 + turned(at_B3 - line.point_3, line.axis_3, step.sign * q_BN[:, column])
        else:
            at_B3 = at_B3 + step.sign * q_BN[:, column, None] * line.axis_3
    return at_B3


def reach_middle(chain: Chain, point_3: np.ndarray, count: int = 256) -> np.ndarray:
    """Mean (3,) of where a point at a chain's end goes in random poses within the limits."""
    return carried(chain, _random_poses(chain, count), point_3).mean(0)


def along_at_most(chain: Chain, axis_3: np.ndarray, line_3: np.ndarray, count: int = 256) -> float:
    """Cosine of how near an axis (3,) at a chain's end comes to a line's direction (3,) in random poses within the
    limits; both are unit vectors, and either way round.
    """
    q_BN = np.vstack([np.zeros(len(chain)), _random_poses(chain, count)])
    axes_B3 = carried(chain, q_BN, axis_3) - carried(chain, q_BN, np.zeros(3))
    return float(np.abs(axes_B3 @ line_3).max())


def _random_poses(chain: Chain, count: int) -> np.ndarray:
    ranges_N2 = np.array([usual_range(step.hinge) for step in chain]).reshape(-1, 2)
    unit_BN = np.random.default_rng(0).random((count, len(chain)))
    return ranges_N2[:, 0] + unit_BN * (ranges_N2[:, 1] - ranges_N2[:, 0])


def straight_angle(axis_3: np.ndarray, lower_3: np.ndarray, upper_3: np.ndarray) -> float:
    """By what angle about a unit axis the lower limb must turn to go on as the upper limb does (both point outwards),
    seen along the axis [rad].
    """
    lower_3, upper_3 = (vector_3 - axis_3 * (axis_3 @ vector_3) for vector_3 in (lower_3, upper_3))
    return math.atan2(float(axis_3 @ cross(lower_3, upper_3)), float(lower_3 @ upper_3))


def bend_side(lower: float, upper: float, straight: float) -> float:
    """-1..1: to which side of the straight angle a range goes further; 0 for as far on either side."""
    below, above = max(straight - lower, 0.0), max(upper - straight, 0.0)
    return (above - below) / max(above + below, 1e-9)


def mean_sign(values: Sequence[float]) -> float:
    """Mean of values, each clipped to -1..1."""
    return float(np.clip(values, -1.0, 1.0).mean()) if len(values) else 0.0
