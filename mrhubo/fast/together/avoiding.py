"""Frames of a motion in which the robot touches itself give way, as `mrhubo.reference.avoidance` makes them, where the
reasons stand.

Legend: T frames, D directions, N joints.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mrhubo.fast.masks import widen
from mrhubo.fast.plain.avoidance import Avoidance
from mrhubo.fast.together.banded import Factor
from mrhubo.fast.together.problem import Directions, Problem, make_problem
from mrhubo.fast.together.refine import refine_around
from mrhubo.fast.together.smoothness import Smoothness
from mrhubo.fast.together.speed import keep_speed

SWEEPS, TOLERANCE = 20, 2e-3
"""Of a motion's refinement: the tolerance of whole motions."""


@dataclass(frozen=True)
class GivingWay:
    """What makes frames give way."""

    problem: Problem
    """What frames cost with what their contacts cost, all joints in one block."""
    close: Callable[[np.ndarray], np.ndarray]
    """Which frames (T,) touch or nearly do, at joint angles (T, N) [rad]."""
    alone: Callable[[np.ndarray, np.ndarray], np.ndarray]
    """Joint angles (T, N) [rad] of frames that give way each on its own, for human directions (T, D, 3)."""

    def in_motion(
        self,
        q_TN: np.ndarray,
        target_TD3: np.ndarray,
        smoothness: Smoothness,
        step_N: np.ndarray,
        around: int,
        fixed_T: np.ndarray,
    ) -> np.ndarray:
        """A motion (T, N) [rad] of which as few frames as possible touch, and which keeps to the bound of its steps."""
        close_T = self.close(q_TN) & ~fixed_T
        if not close_T.any():
            return q_TN
        free_T = widen(close_T, around) & ~fixed_T
        found_TN = q_TN.copy()
        found_TN[close_T] = self.alone(q_TN[close_T], target_TD3[close_T])
        found_TN = refine_around(self.problem, found_TN, target_TD3, smoothness, free_T, SWEEPS, TOLERANCE)
        return keep_speed(self.problem, found_TN, target_TD3, smoothness, step_N, around, fixed_T, SWEEPS)


def make_giving_way(
    avoidance: Avoidance, directions: Directions, factor: Factor, alone: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> GivingWay:
    """That of a robot, with what solves systems and makes single frames give way."""
    return GivingWay(
        make_problem(avoidance.description, avoidance.quadratic, directions, factor), avoidance.close, alone
    )
