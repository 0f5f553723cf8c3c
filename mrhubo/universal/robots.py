"""Branches of real robots, as the universal network sees them: right ones mirrored, senses of turn canonical.

Whatever a description calls its links and joints, in which order it lists them, which way their axes point, where its
zero pose is and how its base is turned: the branch is the same.

Legend: T frames, N joints of the robot, X of them in a branch (at most), C branches, B rows, D directions, S = 5 slots.
"""

from __future__ import annotations

import contextlib
from typing import cast

import torch
from torch import Tensor, nn

from mrhubo.reference import DirectionProblem
from mrhubo.robot import BodyMap, LinkPoses
from mrhubo.robot.parts import BendPart, LimbPart
from mrhubo.universal.chains import Local
from mrhubo.universal.iterations import unroll
from mrhubo.universal.network import UniversalNetwork
from mrhubo.universal.objective import Bounds
from mrhubo.universal.problem import Problem
from mrhubo.universal.slots import AXIAL_S, MIRROR_3, SIGN_3, SLOTS, on_the_right, slot_of


class UnfitBranch(ValueError):
    """A branch has other directions than the network knows."""


class RobotBranch(nn.Module):
    """One branch of a robot; every row is the same one."""

    joints_X: Tensor
    """Its joints, as columns of q,"""
    sense_X: Tensor
    """and -1 for those whose canonical sense of turn is the other one."""
    view_axes_33: Tensor
    mirror_3: Tensor
    flip_S3: Tensor
    axial_3: Tensor
    children_X: Tensor
    axes_X3: Tensor

    def __init__(self, problem: DirectionProblem, block: int) -> None:
        """`block` is the branch's number among the problem's blocks.

        Raises:
            UnfitBranch: two of its directions are of the same kind, or it has none.
        """
        super().__init__()
        self.problem, robot, body_map = problem, problem.robot, problem.body_map
        self._keep("joints_X", torch.nonzero(problem.blocks.joints_NC[:, block])[:, 0])
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
        view = shared.view_D[places[0]]
        self._view_row = robot.link_index(shared.view_links[int(view)])
        self._keep("view_axes_33", shared.view_axes_V33[view])
        like = robot.lower_N
        mirrored = self._mirrored(places)
        mirror_3 = like.new_tensor(MIRROR_3 if mirrored else [1.0, 1.0, 1.0])
        axial_S = like.new_tensor(AXIAL_S if mirrored else [1.0] * len(SLOTS))
        self._keep("mirror_3", mirror_3)
        self._keep("flip_S3", axial_S[:, None] * mirror_3)
        self._keep("axial_3", -mirror_3 if mirrored else mirror_3)
        driven = [robot.driven_joints.index(robot.joint_names[n]) for n in self.joints_X.tolist()]
        self._keep("children_X", problem.kinematics._children_A[driven])
        self._keep("axes_X3", problem.kinematics._axes_A3[driven])
        self._keep("sense_X", torch.ones_like(like[self.joints_X]))
        middle_1X = ((robot.lower_N + robot.upper_N) / 2)[None, self.joints_X]
        along_X = self.local(middle_1X).axis_BN3[0] @ like.new_tensor(SIGN_3)
        self.sense_X = torch.where(along_X < 0, -1.0, 1.0).to(like)

    def _mirrored(self, places: list[int]) -> bool:
        """Whether it is the mirror image of a left branch; without limbs, its parts' directions at rest say so."""
        body_map = self.problem.body_map
        parts = [body_map.directions[d].part for d in places]
        limb = next((part for part in parts if isinstance(part, LimbPart)), None)
        if limb is not None:
            return on_the_right(body_map.skeleton, limb)
        outer = next(d for d, part in zip(places, parts, strict=True) if not isinstance(part, BendPart))
        return bool(body_map.shared.rest_D3[body_map.shared.order_D[outer], 0] < -_SIDEWAYS)

    def _keep(self, name: str, tensor: Tensor) -> None:
        self.register_buffer(name, tensor.to(self.problem.device), persistent=False)

    def local(self, q_BX: Tensor) -> Local:
        """Directions and Jacobian at canonical angles (B, X) [rad], the other joints in the middle of their ranges."""
        robot = self.problem.robot
        q_BN = ((robot.lower_N + robot.upper_N) / 2).expand(len(q_BX), -1).clone()
        q_BN[:, self.joints_X] = (q_BX * self.sense_X).to(q_BN)
        poses = robot.forward(q_BN)
        return self.seen(poses, *self.problem.kinematics.at(poses))

    def seen(self, poses: LinkPoses, direction_BD3: Tensor, jacobian_BD3N: Tensor) -> Local:
        """The same from the whole robot's link poses, directions and their Jacobian."""
        direction_BS3 = direction_BD3.new_zeros(len(direction_BD3), len(SLOTS), 3)
        jacobian_BS3X = direction_BD3.new_zeros(len(direction_BD3), len(SLOTS), 3, len(self.joints_X))
        for slot, place in self.places.items():
            direction_BS3[:, slot] = direction_BD3[:, place] * self.flip_S3[slot]
            jacobian_BS3X[:, slot] = jacobian_BD3N[:, place][..., self.joints_X] * self.flip_S3[slot][:, None]
        view_B33 = poses.rotation_BL33[:, self._view_row] @ self.view_axes_33
        axis_BX3 = (poses.rotation_BL33.index_select(1, self.children_X) @ self.axes_X3[..., None])[..., 0] @ view_B33
        axis_BX3 = axis_BX3 * self.axial_3 * self.sense_X[:, None]
        return Local(direction_BS3, jacobian_BS3X * self.sense_X, axis_BX3)

    def asked(self, target_TD3: Tensor) -> Tensor:
        """Targets (T, S, 3) of human directions (T, D, 3); 0 in slots that the branch has not."""
        target_TS3 = target_TD3.new_zeros(len(target_TD3), len(SLOTS), 3)
        for slot, place in self.places.items():
            target_TS3[:, slot] = target_TD3[:, place] * self.flip_S3[slot]
        return target_TS3


class RobotBranches(nn.Module):
    """All branches of a robot that the network knows. Rows are those of the first, then those of the second and so on;
    as the branches turn apart from each other, one pose of the robot serves a row of each.
    """

    present_CX: Tensor
    lower_CX: Tensor
    upper_CX: Tensor
    weight_CS: Tensor
    known_N: Tensor
    """Which joints they have."""

    def __init__(self, problem: DirectionProblem) -> None:
        super().__init__()
        self.problem, branches = problem, []
        for block in range(problem.blocks.joints_NC.shape[1]):
            with contextlib.suppress(UnfitBranch):
                branches.append(RobotBranch(problem, block))
        self._parts = nn.ModuleList(branches)
        longest = max((len(part.joints_X) for part in branches), default=0)
        like = problem.lower_N
        present_CX, weight_CS = like.new_zeros(len(branches), longest), like.new_zeros(len(branches), len(SLOTS))
        lower_CX, upper_CX = -torch.ones_like(present_CX), torch.ones_like(present_CX)
        known_N = torch.zeros_like(like, dtype=torch.bool)
        for c, part in enumerate(branches):
            ends_2X = torch.stack((problem.lower_N, problem.upper_N))[:, part.joints_X] * part.sense_X
            present_CX[c, : len(part.joints_X)] = 1
            lower_CX[c, : len(part.joints_X)], upper_CX[c, : len(part.joints_X)] = ends_2X.amin(0), ends_2X.amax(0)
            known_N[part.joints_X] = True
            for slot, place in part.places.items():
                weight_CS[c, slot] = problem.directions.weight_D[place]
        tensors = {"present_CX": present_CX, "lower_CX": lower_CX, "upper_CX": upper_CX, "weight_CS": weight_CS}
        for name, tensor in {**tensors, "known_N": known_N}.items():
            self.register_buffer(name, tensor, persistent=False)

    @property
    def parts(self) -> list[RobotBranch]:
        """The branches."""
        return cast(list[RobotBranch], list(self._parts))

    def rows(self, rows: Tensor) -> RobotBranches:
        """The same: as many rows of each branch are always asked for."""
        return self

    def local(self, q_BN: Tensor) -> Local:
        """Directions and Jacobian at canonical angles (B, X) [rad]."""
        poses, longest = self.problem.robot.forward(self.joined(q_BN)), q_BN.shape[1]
        found = self.problem.kinematics.at(poses)
        locals_C = [part.seen(poses, *found) for part in self.parts]
        direction_BS3 = torch.cat([local.direction_BS3 for local in locals_C])
        jacobian_BS3X = torch.cat([_padded(local.jacobian_BS3N, longest, -1) for local in locals_C])
        axis_BX3 = torch.cat([_padded(local.axis_BN3, longest, -2) for local in locals_C])
        return Local(direction_BS3, jacobian_BS3X, axis_BX3)

    def joined(self, q_BX: Tensor) -> Tensor:
        """The robot's angles (B / C, N) [rad] of those of all branches (B, X); the middle of their ranges for joints
        of other branches.
        """
        problem, each = self.problem, len(q_BX) // len(self.parts)
        q_TN = ((problem.lower_N + problem.upper_N) / 2).expand(each, -1).clone()
        for part, own_TX in zip(self.parts, q_BX.split(each), strict=True):
            q_TN[:, part.joints_X] = (own_TX[:, : len(part.joints_X)] * part.sense_X).to(q_TN)
        return q_TN

    def apart(self, q_TN: Tensor) -> Tensor:
        """The angles (C T, X) of all branches of the robot's (T, N); 0 where a branch has no more joints."""
        longest = self.present_CX.shape[1]
        return torch.cat([_padded(q_TN[:, part.joints_X] * part.sense_X, longest, -1) for part in self.parts])

    def ask(self, target_TD3: Tensor) -> Problem:
        """The problems of human directions (T, D, 3), of all frames for each branch."""
        frames = len(target_TD3)
        target_BS3 = torch.cat([part.asked(target_TD3) for part in self.parts])
        bounds = Bounds(*(x.repeat_interleave(frames, 0) for x in (self.lower_CX, self.upper_CX, self.present_CX)))
        return Problem(self, bounds, target_BS3, self.weight_CS.repeat_interleave(frames, 0))


def _padded(tensor: Tensor, size: int, axis: int) -> Tensor:
    """With zeros behind, along an axis."""
    shape = list(tensor.shape)
    shape[axis] = size - shape[axis]
    return torch.cat((tensor, tensor.new_zeros(shape)), dim=axis)


_SIDEWAYS = 0.5
"""What points as far to the right, on a person at rest with the arms spread, is the mirror image of a left part."""
_CHUNK = 2048


class UniversalRetargeter(nn.Module):
    """A robot's joint angles by the universal network: no training, no table of poses."""

    def __init__(self, body_map: BodyMap, network: UniversalNetwork) -> None:
        """Branches that the network does not know are left to Levenberg-Marquardt from the middle of all ranges."""
        super().__init__()
        self.network, self.problem = network, DirectionProblem(body_map)
        self.branches = RobotBranches(self.problem)

    @torch.no_grad()
    def forward(self, target_TD3: Tensor, more: int = 0) -> Tensor:
        """Joint angles (T, N) [rad], inside the limits, for human directions (T, D, 3)
        (`BodyMap.human_directions`), each frame for itself; `more` steps of Levenberg-Marquardt at most refine them.
        """
        parts = [self._answer(part_TD3, more) for part_TD3 in target_TD3.split(_CHUNK)]
        return torch.cat(parts)

    def _answer(self, target_TD3: Tensor, more: int) -> Tensor:
        problem, branches = self.problem, self.branches
        q_TN = ((problem.lower_N + problem.upper_N) / 2).expand(len(target_TD3), -1)
        if len(branches.parts) and len(target_TD3):
            q_TN = branches.joined(unroll(self.network, branches.ask(target_TD3)).q_BN)
        if not bool(branches.known_N.all()):
            other_TN, _ = problem.minimise(q_TN, target_TD3, steps=5)
            q_TN = torch.where(branches.known_N, q_TN, other_TN)
        if more:
            q_TN, _ = problem.minimise(q_TN, target_TD3, steps=more)
        return torch.clamp(q_TN, problem.lower_N, problem.upper_N)
