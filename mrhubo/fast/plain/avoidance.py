"""Answers that touch the robot itself give way, as `mrhubo.reference.avoidance` makes them, where the reasons stand.

Legend: B frames, D directions, N joints, Y pairs of capsules, L bodies, A driven joints, C = 1 block.
"""

from __future__ import annotations

import dataclasses
from functools import cached_property

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.plain import steps
from mrhubo.fast.plain.collision import carries, clearances, distance_jacobian, near
from mrhubo.fast.plain.robot import place

CLEARANCE = 0.002
"""Distance [m] that collision shapes keep. The limbs pull them into it by less than that: a limb that points 30 degrees
from where it is shown pulls a shape on a lever of 0.1 m by  sin 30 / (WEIGHT * 0.1 m) = 0.5 mm."""
WEIGHT = 1e4
"""Weight of the squared lack of it [1/m^2]: a millimetre costs as much as a limb that is off by 6 degrees."""
STEPS = 10
"""Steps at most."""


class Avoidance:
    """Steps away from self-collision for one robot."""

    def __init__(self, description: Description) -> None:
        self._own = description

    @cached_property
    def description(self) -> Description:
        """The robot's, with all joints in one block: any of its parts may meet any other."""
        cost = self._own.cost
        together = np.where(cost.block_D < 0, cost.block_D, 0)
        cost = dataclasses.replace(cost, block_N=np.zeros_like(cost.block_N), block_D=together)
        return dataclasses.replace(self._own, cost=cost)

    @cached_property
    def clear_Y(self) -> np.ndarray:
        """The distance that each pair is to keep [m]."""
        return clearances(self._own, CLEARANCE)

    @cached_property
    def _carried_LAN(self) -> np.ndarray:
        return carries(self._own.kinematics, len(self._own.cost.lower_N))

    def close(self, q_BN: np.ndarray) -> np.ndarray:
        """Which frames (B,) have a pair nearer than its clearance."""
        found_B, placed = np.zeros(len(q_BN), bool), place(self._own.kinematics, q_BN)
        found_B[near(self._own.capsules, placed.rotation_BL33, placed.position_BL3, self.clear_Y).row_X] = True
        return found_B

    def quadratic(self, description: Description, q_BN: np.ndarray, target_BD3: np.ndarray) -> steps.Model:
        """Cost (B, 1) and Gauss-Newton model at joint angles (B, N) [rad], for human directions (B, D, 3)."""
        model = steps.quadratic(description, q_BN, target_BD3)
        kinematics, capsules = description.kinematics, description.capsules
        placed = place(kinematics, q_BN)
        found = near(capsules, placed.rotation_BL33, placed.position_BL3, self.clear_Y)
        short_X = self.clear_Y[found.pair_X] - found.distance_X
        row_X, rows_XN = found.row_X, -distance_jacobian(kinematics, capsules, placed, found, self._carried_LAN)
        np.add.at(model.cost_BC[:, 0], row_X, WEIGHT * short_X * short_X)
        np.add.at(model.gradient_BN, row_X, WEIGHT * short_X[:, None] * rows_XN)
        np.add.at(model.hessian_BNN, row_X, WEIGHT * rows_XN[:, :, None] * rows_XN[:, None, :])
        return model

    def __call__(self, q_BN: np.ndarray, target_BD3: np.ndarray) -> np.ndarray:
        """Joint angles (B, N) [rad], inside the limits, of which as few as possible touch; others stay as they are."""
        row_X = np.flatnonzero(self.close(q_BN))
        if not len(row_X):
            return q_BN
        found_BN, together = q_BN.copy(), self.description
        found_BN[row_X] = steps.minimise(together, q_BN[row_X], target_BD3[row_X], STEPS, quadratic=self.quadratic)[0]
        return found_BN
