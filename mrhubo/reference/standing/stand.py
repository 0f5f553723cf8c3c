"""The root of a robot's motion, and its legs made to keep planted feet in their places.

First the planted feet carry the root (`path`). Where two feet are planted, legs of other proportions than the person's
cannot both keep still and point as the person's do: so the legs then give way, by the optimiser's own cost with a term
for the places of soles, within limits and limits of speed. What swings goes where it went, shifted so that it takes off
and lands where it is planted, and is kept above the floor. At last the feet carry the root once more. Of who kneels,
crawls or lies, trunk and knees lift the root out of the floor, and arms give way (`low_body`).

World: the human's, x left, y up, z forward; m. The floor is at y = 0.

Legend: T frames, P points of soles, K balls or contacts, D directions, N joints.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor, nn

from mrhubo.fast.plain.ground import UNDER_M
from mrhubo.frames import human_to_world
from mrhubo.reference.avoidance import Avoidance
from mrhubo.reference.refine import widen
from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.standing.balance import Balance
from mrhubo.reference.standing.bending import BendingArms
from mrhubo.reference.standing.carried import LIFTED_M, Carried, smooth_lift
from mrhubo.reference.standing.giving_way import GivingWay
from mrhubo.reference.standing.human import HumanSteps
from mrhubo.reference.standing.legs import Legs
from mrhubo.reference.standing.low_body import LowBody
from mrhubo.reference.standing.path import carry
from mrhubo.reference.terms import Smoothness
from mrhubo.reference.terms.soles import SoleTerm
from mrhubo.robot import LinkPoses

PLANTED, SWINGING = 2500.0, 50.0
"""Weights [1/m^2] of a planted point's place and of a swinging one's: a millimetre costs as much as a limb that is 3
degrees off, or 0.4."""
CLEAR = 5000.0
"""Weight [1/m^2] with which a swinging point is kept above the floor besides, by its height alone."""
ROUNDS = 4
"""How often the legs give way: again where soles would still be under the floor, by turns with a root that is lifted
out of it, so that feet stand on what is lowest of them, and with one that both carry, so that legs meet half-way."""
FREE_S = 0.3
"""The time [s] around in which legs are free to move."""
_RISE = 0.25
"""Of how much a point is planted, the power that counts for heights: as long as a sole is planted at all, it is to
touch the floor, while a place on the floor may be left gradually."""
_FLAT, _UP = [0, 2], 1
"""The horizontal axes of the world, and the upright one."""


@dataclass(frozen=True)
class Stand:
    """A robot's motion on the floor."""

    q_TN: Tensor
    """Joint angles [rad]."""
    position_T3: Tensor
    """Place of the base in the robot's world [m], x forward, y left, z up; the floor is at z = 0."""
    rotation_T33: Tensor
    """Its rotation there."""
    root_T3: Tensor
    """Place of the root, between the legs' first joints, in the human's world [m]."""


class Standing(nn.Module):
    """Stands one robot on the floor."""

    def __init__(self, legs: Legs) -> None:
        super().__init__()
        self.legs, self.robot = legs, legs.body_map.robot
        soles = SoleTerm(legs)
        moved = set().union(*soles.couplings())
        legs_N = torch.tensor([n in moved for n in range(len(self.robot.joint_names))])
        self._legs_way = GivingWay(legs.body_map, [soles], legs_N)
        self.low_body = LowBody(legs)
        """What besides soles touches the floor."""
        self._bending: BendingArms | None = None
        self.balance = Balance(legs) if self.robot.balance else None
        """What shifts the root of whole motions; None: nothing looks at the centre of mass."""

    @property
    def problem(self) -> DirectionProblem:
        """The cost of legs that give way."""
        return self._legs_way.problem

    @property
    def avoidance(self) -> Avoidance:
        """What makes answers give way that touch the robot itself, with soles in place."""
        return self._legs_way.avoidance

    def forward(
        self,
        q_TN: Tensor,
        target_TD3: Tensor,
        steps: HumanSteps,
        smoothness: Smoothness,
        avoid_collisions: bool = False,
    ) -> Stand:
        """The motion on the floor.

        Args:
            q_TN: joint angles [rad] inside limits and limits of speed, which point as the person does.
            target_TD3: the person's directions, with feet that stand flat (`flatten`).
            steps: the person's.
            smoothness: of the motion.
            avoid_collisions: frames in which the robot would touch itself give way.
        """
        carried, rate = self._carried(q_TN, steps), steps.frame_rate
        if (carried.body_T < -LIFTED_M).any():  # feet that are not planted then go with the root
            steps = steps.raised(smooth_lift(np.maximum(-carried.body_T, 0.0), rate))
            carried = self._carried(q_TN, steps).lifted(rate)
        wanted = self._wanted(carried, steps)
        free_T = torch.ones(len(q_TN), dtype=torch.bool, device=q_TN.device)
        for again in range(ROUNDS):
            if again:
                lifted_T = torch.from_numpy(carried.lift_T > LIFTED_M).to(q_TN.device)
                free_T = widen(lifted_T, round(FREE_S * rate))
                if not bool(free_T.any()):
                    break
                carried = carried.lifted(rate) if again % 2 else carried
                wanted = self._reached(carried, steps, wanted[1])
            elif self.balance is not None:
                off_TP3, poses = wanted[0] - carried.point_TP3, self.robot.forward(q_TN)
                carried = carried.shifted(self.balance.shift(poses, steps, carried.root_T3, off_TP3))
            extended_TX3 = self._extended(target_TD3, carried, wanted, steps)
            q_TN = self._legs_way(q_TN, extended_TX3, free_T, rate, smoothness, avoid_collisions)
            carried = self._carried(q_TN, steps, carried.place_K2)
        if np.isfinite(carried.body_T).all():
            q_TN, carried = self._out_of_floor(q_TN, target_TD3, carried, steps, smoothness, avoid_collisions)
        root_T3 = torch.from_numpy(carried.root_T3)
        root_T3[:, _UP] += torch.from_numpy(carried.lift_T)  # no sole is under the floor
        turn_T33 = steps.turn_T33.to(q_TN)
        base_T3, base_T33 = self.legs.base(self.robot.forward(q_TN), human_to_world(root_T3.to(q_TN)), turn_T33)
        return Stand(q_TN, base_T3, base_T33, root_T3)

    def _carried(self, q_TN: Tensor, steps: HumanSteps, place_K2: np.ndarray | None = None) -> Carried:
        """Where planted feet carry the root; `place_K2` are the contacts' places, where they are decided."""
        contacts, rate = steps.contacts, steps.frame_rate
        poses = self.robot.forward(q_TN)
        point_TP3, low_TP = self._soles(poses, steps)
        path_T3 = steps.path_T3.double().cpu().numpy()
        off_T2, place_K2 = carry(
            path_T3[:, None, _FLAT] + point_TP3[..., _FLAT], contacts.weight_TP, contacts.phase_TP, rate, place_K2
        )
        above_TP, weight_TP = path_T3[:, None, _UP] + low_TP, contacts.weight_TP
        level = float((weight_TP * above_TP).sum() / max(weight_TP.sum(), 1e-9))  # hips lie elsewhere on a robot
        floor_TP = np.zeros(low_TP.shape, dtype=int)
        rise_T1, _ = carry(above_TP[..., None] - level, weight_TP**_RISE, floor_TP, rate, np.zeros((1, 1)))
        root_T3 = path_T3 + np.stack((off_T2[:, 0], rise_T1[:, 0] - level, off_T2[:, 1]), axis=1)
        up_T3, height_T = steps.turn_T33[:, _UP].to(q_TN), torch.from_numpy(root_T3[:, _UP]).to(q_TN)
        body_T = np.full(len(root_T3), np.inf)
        if self.low_body.near(poses, up_T3, height_T):
            body_T, arm_TS2 = (x.double().cpu().numpy() for x in self.low_body.lowest(poses, up_T3, height_T))
            clear_T = np.maximum(np.minimum(body_T, low_TP.min(axis=1) + root_T3[:, _UP]), 0.0)
            arm_T = arm_TS2.min(axis=(1, 2), initial=np.inf)
            body_T = np.minimum(body_T, np.maximum(arm_T, -clear_T))  # who stands on the hands is lifted by them
        return Carried(root_T3, place_K2, point_TP3 + root_T3[:, None], low_TP + root_T3[:, [_UP]], body_T)

    def _soles(self, poses: LinkPoses, steps: HumanSteps) -> tuple[np.ndarray, np.ndarray]:
        """Points of soles (T, P, 3) from the root, and the height of the lowest ball at each (T, P) [m]."""
        legs, seen = self.legs, self.legs.places(poses)
        point_TP3, ball_TK3 = (self._in_world(x, steps).double().cpu().numpy() for x in (seen.point_BP3, seen.ball_BK3))
        return point_TP3, legs.lowest(ball_TK3[..., _UP])

    def _in_world(self, seen_TX3: Tensor, steps: HumanSteps) -> Tensor:
        """What is seen from what carries the legs, along the world's axes."""
        return seen_TX3 @ steps.turn_T33.to(seen_TX3).mT

    def _wanted(self, carried: Carried, steps: HumanSteps) -> tuple[np.ndarray, np.ndarray]:
        """Where points of soles are to be (T, P, 3) in the world, and how much that counts (T, P), 0..1."""
        phase_TP, weight_TP = steps.contacts.phase_TP, steps.contacts.weight_TP
        found_TP3, low_TP, frame_T = carried.point_TP3.copy(), carried.low_TP.copy(), np.arange(len(phase_TP))
        for p in range(found_TP3.shape[1]):
            there_T = phase_TP[:, p] >= 0
            if there_T.any():
                flat_X2 = carried.place_K2[phase_TP[there_T, p]] - found_TP3[there_T, p][:, _FLAT]
                off_X3 = np.stack((flat_X2[:, 0], -low_TP[there_T, p], flat_X2[:, 1]), axis=1)
                off_T3 = np.stack([np.interp(frame_T, frame_T[there_T], off_X) for off_X in off_X3.T], axis=1)
                found_TP3[:, p] += off_T3
                low_TP[:, p] += off_T3[:, _UP]
        under_TP = np.maximum(-low_TP, 0.0)
        under_TP[phase_TP >= 0] = 0.0
        found_TP3[..., _UP] += under_TP
        return found_TP3, np.maximum(weight_TP, np.minimum(under_TP / UNDER_M, 1.0))

    def _reached(self, carried: Carried, steps: HumanSteps, counted_TP: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same where legs gave way already: feet that could not be turned flat are to stand on what is lowest, and
        what had to be kept above the floor has to be still.
        """
        found_TP3, counts_TP = self._wanted(carried, steps)
        low_TS = carried.low_TP.reshape(len(carried.low_TP), -1, 2).min(axis=-1)
        up_TP = carried.point_TP3[..., _UP] - np.repeat(low_TS, 2, axis=1)
        there_TP = np.repeat((steps.contacts.phase_TP >= 0).reshape(*low_TS.shape, 2).any(axis=-1), 2, axis=1)
        found_TP3[..., _UP] = np.where(there_TP, up_TP, found_TP3[..., _UP])
        return found_TP3, np.maximum(counts_TP, counted_TP)

    def _extended(
        self, target_TD3: Tensor, carried: Carried, wanted: tuple[np.ndarray, np.ndarray], steps: HumanSteps
    ) -> Tensor:
        """The directions with the places of soles after them, as `SoleTerm` has it."""
        wanted_TP3, counts_TP = wanted
        seen_TP3 = torch.from_numpy(wanted_TP3 - carried.root_T3[:, None]).to(target_TD3)
        weight_TP3 = torch.zeros_like(seen_TP3)
        weight_TP3[..., 0] = SWINGING + (PLANTED - SWINGING) * torch.from_numpy(counts_TP).to(seen_TP3)
        planted_TP = steps.contacts.weight_TP
        high_TP = np.where(steps.contacts.phase_TP >= 0, PLANTED * (planted_TP**_RISE - planted_TP), CLEAR * counts_TP)
        up_T3 = steps.turn_T33[:, _UP].to(seen_TP3)
        high_TP3 = torch.from_numpy(high_TP).to(seen_TP3).sqrt()[..., None] * up_T3[:, None]
        return torch.cat((target_TD3, seen_TP3 @ steps.turn_T33.to(seen_TP3), weight_TP3, high_TP3), dim=1)

    def _out_of_floor(
        self,
        q_TN: Tensor,
        target_TD3: Tensor,
        carried: Carried,
        steps: HumanSteps,
        smoothness: Smoothness,
        avoid_collisions: bool,
    ) -> tuple[Tensor, Carried]:
        """Joint angles of which arms bend where they would be under the floor, and a root that is lifted by what is
        left.
        """
        rate, low = steps.frame_rate, self.low_body
        carried = carried.lifted(rate) if (carried.body_T < 0).any() else carried
        up_T3, height_T = steps.turn_T33[:, _UP].to(q_TN), torch.from_numpy(carried.root_T3[:, _UP]).to(q_TN)
        still = carried.point_TP3, np.ones_like(carried.low_TP)
        if (low.lowest(self.robot.forward(q_TN), up_T3, height_T)[1] < -LIFTED_M).any():
            if self._bending is None:
                self._bending = BendingArms(low)
            q_TN = self._bending(
                q_TN, target_TD3, lambda raised_TD3: self._extended(raised_TD3, carried, still, steps), up_T3, height_T,
                rate, smoothness, avoid_collisions,
            )  # fmt: skip
            point_TP3, low_TP = self._soles(self.robot.forward(q_TN), steps)  # which give way to the robot's own arms
            root_T3 = carried.root_T3
            carried = replace(carried, point_TP3=point_TP3 + root_T3[:, None], low_TP=low_TP + root_T3[:, [_UP]])
        lowest_T = low.lowest_of_any(self.robot.forward(q_TN), up_T3, height_T).double().cpu().numpy()
        left = replace(carried, body_T=lowest_T)
        return q_TN, left.lifted(rate) if (lowest_T < 0).any() else left
