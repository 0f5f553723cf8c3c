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
from mrhubo.fast.plain.contact_steps import REACH, Contacts, foreseeing_step
from mrhubo.fast.plain.human import norm
from mrhubo.fast.plain.robot import place, seen_directions
from mrhubo.fast.plain.steps import DAMPING, EASIER, HARDER, LEAST, MOST, STUCK, TOLERANCE

CLEARANCE = 0.002
"""Distance [m] that collision shapes keep. The limbs pull them into it by less than that: a limb that points 30 degrees
from where it is shown pulls a shape on a lever of 0.1 m by  sin 30 / (WEIGHT * 0.1 m) = 0.5 mm."""
WEIGHT = 1e4
"""Weight of the squared lack of it [1/m^2]: a millimetre costs as much as a limb that is off by 6 degrees."""
STEPS = 10
"""Steps at most; hardly any frame makes more than four."""
WORTH = 1e-5
"""A step that promises to win less is not made: a limb that is off by 6 degrees would be so by 0.003 less."""
_CHUNK = 512
"""Frames that are worked on at a time: their contacts are in memory."""


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
        cost_B, model, touching = self._look(description, q_BN, target_BD3)
        touching.add_to(touching.short_X, model.gradient_BN, model.hessian_BNN)
        return steps.Model(cost_B[:, None], model.gradient_BN, model.hessian_BNN)

    def _look(
        self, description: Description, q_BN: np.ndarray, target_BD3: np.ndarray, more: float = 0.0
    ) -> tuple[np.ndarray, steps.Model, Contacts]:
        """What frames cost (B,), the model of that without contacts, and pairs that are so much farther apart than
        their clearance [m] at most.
        """
        kinematics, capsules, scale = description.kinematics, description.capsules, np.sqrt(WEIGHT)
        model = steps.quadratic(description, q_BN, target_BD3)
        placed = place(kinematics, q_BN)
        found = near(capsules, placed.rotation_BL33, placed.position_BL3, self.clear_Y + more)
        short_X = scale * (self.clear_Y[found.pair_X] - found.distance_X)
        rows_XN = -scale * distance_jacobian(kinematics, capsules, placed, found, self._carried_LAN)
        touching = Contacts(found.row_X, short_X, rows_XN)
        return model.cost_BC[:, 0] + touching.costs(short_X, len(q_BN)), model, touching

    def _give_way(self, q_BN: np.ndarray, target_BD3: np.ndarray) -> np.ndarray:
        together, found_BN, row_B = self.description, q_BN.copy(), np.arange(len(q_BN))
        damping_B = np.full(len(q_BN), DAMPING)
        cost_B, model, touching = self._look(together, q_BN, target_BD3, REACH)
        for _ in range(STEPS):
            trial_BN, won_B = foreseeing_step(together.cost, q_BN, model, damping_B, touching)
            worth_B = won_B > WORTH
            if not worth_B.any():
                break
            row_B, q_BN, trial_BN, target_BD3, cost_B, damping_B = (
                own_B[worth_B] for own_B in (row_B, q_BN, trial_BN, target_BD3, cost_B, damping_B)
            )
            trial_cost_B, model, touching = self._look(together, trial_BN, target_BD3, REACH)
            better_B, moved_B = trial_cost_B < cost_B, np.abs(trial_BN - q_BN).max(axis=1)
            found_BN[row_B[better_B]] = trial_BN[better_B]
            going_B = ~((moved_B < TOLERANCE) | (~better_B & (damping_B > STUCK)))
            if not going_B.any():
                break
            q_BN, cost_B = np.where(better_B[:, None], trial_BN, q_BN), np.where(better_B, trial_cost_B, cost_B)
            damping_B = np.clip(damping_B * np.where(better_B, EASIER, HARDER), LEAST, MOST)
            row_B, q_BN, target_BD3, cost_B, damping_B = (
                own_B[going_B] for own_B in (row_B, q_BN, target_BD3, cost_B, damping_B)
            )
            if better_B[going_B].all():
                model, touching = model.rows(going_B), touching.rows(going_B)
            else:  # some are where they were
                _, model, touching = self._look(together, q_BN, target_BD3, REACH)
        return found_BN

    def __call__(self, q_BN: np.ndarray, target_BD3: np.ndarray, staying: bool = False) -> np.ndarray:
        """Joint angles (B, N) [rad], inside the limits, of which as few as possible touch; others stay as they are.
        `staying`: those that touch keep to their own directions, and not to the human's.
        """
        found_BN, row_X = q_BN.copy(), np.flatnonzero(self.close(q_BN))
        for rows in steps.chunks(len(row_X), _CHUNK):
            x = row_X[rows]
            target_XD3 = self._own_directions(q_BN[x], target_BD3[x]) if staying else target_BD3[x]
            found_BN[x] = self._give_way(q_BN[x], target_XD3)
        return found_BN

    def _own_directions(self, q_BN: np.ndarray, target_BD3: np.ndarray) -> np.ndarray:
        """Targets with the robot's directions in place of the human's, which count as much."""
        own_BD3 = seen_directions(place(self._own.kinematics, q_BN), self._own.human.seen_D)
        human_BD3, more_BX3 = np.split(target_BD3, [own_BD3.shape[1]], axis=1)
        return np.concatenate((own_BD3 * norm(human_BD3)[..., None], more_BX3), axis=1)
