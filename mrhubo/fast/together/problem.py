"""The cost of frames, by which a motion is refined; who works it out is a form's own.

Legend: B problems, D directions, N joints, C blocks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.plain.steps import Model, Quadratic, minimise
from mrhubo.fast.sections import Cost
from mrhubo.fast.together.banded import Factor

Directions = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""For joint angles (B, N) [rad]: directions (B, D, 3) as they are seen from their parts, and how they turn (B, D, 3, N)
[1/rad]."""


@dataclass(frozen=True)
class Problem:
    """What frames cost, and how systems of all of them are solved."""

    cost: Cost
    quadratic: Callable[[np.ndarray, np.ndarray], Model]
    """Cost and Gauss-Newton model at joint angles (B, N) [rad] for human directions (B, D, 3)."""
    minimise: Callable[[np.ndarray, np.ndarray, int, float], tuple[np.ndarray, np.ndarray]]
    """Joint angles (B, N) [rad] and costs (B, C) after so many steps at most, each of some problems on its own; a block
    whose joints all move by less than the last number [rad] in a step has converged."""
    directions: Directions
    factor: Factor


def make_problem(description: Description, quadratic: Quadratic, directions: Directions, factor: Factor) -> Problem:
    """The problem of a description, with what works its frames' costs, directions and systems out."""

    def models(q_BN: np.ndarray, target_BD3: np.ndarray) -> Model:
        return quadratic(description, q_BN, target_BD3)

    def minima(q_BN: np.ndarray, target_BD3: np.ndarray, steps: int, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
        return minimise(description, q_BN, target_BD3, steps, tolerance, quadratic)

    return Problem(description.cost, models, minima, directions, factor)
