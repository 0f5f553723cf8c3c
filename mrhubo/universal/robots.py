"""Branches of real robots, as the universal network sees them: right ones mirrored, senses of turn canonical.

Whatever a description calls its links and joints, in which order it lists them, which way their axes point, where its
zero pose is and how its base is turned: the branch is the same.

Legend: T frames, N joints of the robot, X of them in a branch, D directions, S = 5 slots.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.reference import DirectionProblem
from mrhubo.robot import BodyMap
from mrhubo.robot.keypoints import Limb
from mrhubo.robot.parts import BendPart
from mrhubo.universal.chains import Local
from mrhubo.universal.iterations import unroll
from mrhubo.universal.network import UniversalNetwork
from mrhubo.universal.objective import Bounds
from mrhubo.universal.problem import Problem
from mrhubo.universal.slots import AXIAL_S, MIRROR_3, SIGN_3, SLOTS, slot_of


class UnfitBranch(ValueError):
    """A branch has other directions than the network knows."""


class RobotBranch:
    """One branch of a robot; every row is the same one."""

    def __init__(self, problem: DirectionProblem, block: int) -> None:
        """`block` is the branch's number among the problem's blocks.

        Raises:
            UnfitBranch: two of its directions are of the same kind, or it has none.
        """
        self.problem, robot, body_map = problem, problem.robot, problem.body_map
        self.joints_X = torch.nonzero(problem.blocks.joints_NC[:, block])[:, 0]
        places = torch.nonzero(problem.blocks.directions_DC[:, block])[:, 0].tolist()
        parts = [body_map.directions[d].part for d in places]
        names = {part.name for part in parts}
        self.places: dict[int, int] = {}
        """The direction in each slot."""
        for d, part in zip(places, parts, strict=True):
            words = part.direction_names
            slot = slot_of(part, words.index(body_map.direction_names[d]), part.hangs_on in names)
            if slot in self.places:
                raise UnfitBranch(f"two directions of one branch are a {SLOTS[slot]}")
            self.places[slot] = d
        if not self.places:
            raise UnfitBranch("a branch has no direction")
        shared = body_map.shared
        rest_D3 = shared.rest_D3.index_select(0, shared.order_D)
        outer = [d for d, part in zip(places, parts, strict=True) if not isinstance(part, BendPart)]
        limbs = [d for d in outer if isinstance(body_map.directions[d], Limb)]
        view = shared.view_D[places[0]]
        self._view_row = robot.link_index(shared.view_links[int(view)])
        self._view_axes_33 = shared.view_axes_V33[view]
        like = robot.lower_N
        mirrored = bool(rest_D3[(limbs or outer)[0], 0] < -_SIDEWAYS)
        self._mirror_3 = like.new_tensor(MIRROR_3 if mirrored else [1.0, 1.0, 1.0])
        axial_S = like.new_tensor(AXIAL_S if mirrored else [1.0] * len(SLOTS))
        self._flip_S3 = axial_S[:, None] * self._mirror_3
        self._axial_3 = -self._mirror_3 if mirrored else self._mirror_3
        driven = [robot.driven_joints.index(robot.joint_names[n]) for n in self.joints_X.tolist()]
        self._children = problem.kinematics._children_A[driven]
        self._axes_X3 = problem.kinematics._axes_A3[driven]
        self.sense_X = torch.ones_like(like[self.joints_X])
        middle_1X = ((robot.lower_N + robot.upper_N) / 2)[None, self.joints_X]
        along_X = self.local(middle_1X).axis_BN3[0] @ like.new_tensor(SIGN_3)
        self.sense_X = torch.where(along_X < 0, -1.0, 1.0).to(like)

    def rows(self, rows: Tensor) -> RobotBranch:
        """The same: all rows are."""
        return self

    def local(self, q_BN: Tensor) -> Local:
        """Directions and Jacobian at canonical angles (B, X) [rad]."""
        robot = self.problem.robot
        q_TN = ((robot.lower_N + robot.upper_N) / 2).expand(len(q_BN), -1).clone()
        q_TN[:, self.joints_X] = (q_BN * self.sense_X).to(q_TN)
        poses = robot.forward(q_TN)
        direction_BD3, jacobian_BD3N = self.problem.kinematics.at(poses)
        direction_BS3 = direction_BD3.new_zeros(len(q_BN), len(SLOTS), 3)
        jacobian_BS3X = direction_BD3.new_zeros(len(q_BN), len(SLOTS), 3, len(self.joints_X))
        for slot, place in self.places.items():
            direction_BS3[:, slot] = direction_BD3[:, place] * self._flip_S3[slot]
            jacobian_BS3X[:, slot] = jacobian_BD3N[:, place][..., self.joints_X] * self._flip_S3[slot][:, None]
        view_B33 = poses.rotation_BL33[:, self._view_row] @ self._view_axes_33
        axis_BX3 = (poses.rotation_BL33.index_select(1, self._children) @ self._axes_X3[..., None])[..., 0] @ view_B33
        axis_BX3 = axis_BX3 * self._axial_3 * self.sense_X[:, None]
        return Local(direction_BS3, jacobian_BS3X * self.sense_X, axis_BX3)

    def ask(self, target_TD3: Tensor) -> Problem:
        """The problem of human directions (T, D, 3)."""
        robot, frames = self.problem.robot, len(target_TD3)
        target_TS3 = target_TD3.new_zeros(frames, len(SLOTS), 3)
        weight_TS = target_TD3.new_zeros(frames, len(SLOTS))
        for slot, place in self.places.items():
            target_TS3[:, slot] = target_TD3[:, place] * self._flip_S3[slot]
            weight_TS[:, slot] = self.problem.directions.weight_D[place]
        ends_2X = torch.stack((robot.lower_N, robot.upper_N))[:, self.joints_X] * self.sense_X
        lower_X, upper_X = ends_2X.amin(dim=0), ends_2X.amax(dim=0)
        bounds = Bounds(*(x.expand(frames, -1) for x in (lower_X, upper_X, torch.ones_like(lower_X))))
        return Problem(self, bounds, target_TS3, weight_TS)


_SIDEWAYS = 0.5
"""What points as far to the right, on a person at rest with the arms spread, is the mirror image of a left part."""
_CHUNK = 2048


class UniversalRetargeter:
    """A robot's joint angles by the universal network: no training, no table of poses."""

    def __init__(self, body_map: BodyMap, network: UniversalNetwork) -> None:
        """Branches that the network does not know are left to Levenberg-Marquardt from the middle of all ranges."""
        self.network, self.problem = network, DirectionProblem(body_map)
        self.branches: list[RobotBranch] = []
        for block in range(self.problem.blocks.joints_NC.shape[1]):
            try:
                self.branches.append(RobotBranch(self.problem, block))
            except UnfitBranch:
                continue

    @torch.no_grad()
    def __call__(self, target_TD3: Tensor, more: int = 0) -> Tensor:
        """Joint angles (T, N) [rad], inside the limits, for human directions (T, D, 3)
        (`BodyMap.human_directions`), each frame for itself; `more` steps of Levenberg-Marquardt at most refine them.
        """
        parts = [self._answer(part_TD3, more) for part_TD3 in target_TD3.split(_CHUNK)]
        return torch.cat(parts)

    def _answer(self, target_TD3: Tensor, more: int) -> Tensor:
        problem = self.problem
        q_TN = ((problem.lower_N + problem.upper_N) / 2).expand(len(target_TD3), -1).clone()
        known_N = torch.zeros_like(problem.lower_N, dtype=torch.bool)
        for branch in self.branches:
            found_TX = unroll(self.network, branch.ask(target_TD3)).q_BN
            q_TN[:, branch.joints_X] = found_TX * branch.sense_X
            known_N[branch.joints_X] = True
        if not bool(known_N.all()):
            other_TN, _ = problem.minimise(q_TN, target_TD3, steps=5)
            q_TN = torch.where(known_N, q_TN, other_TN)
        if more:
            q_TN, _ = problem.minimise(q_TN, target_TD3, steps=more)
        return torch.clamp(q_TN, problem.lower_N, problem.upper_N)
