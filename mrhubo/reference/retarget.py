"""The reference retargeter: human motion -> robot motion by optimisation, the ground truth for the network.

Frames are solved from several starts (`candidates`); the best path through the solutions is chosen; then all frames are
refined together, with a small cost on joint velocity that carries joints over frames which do not determine them (the
twist of a straight arm). `collision_free` then makes a second motion of it in which the robot does not touch itself.

Legend: T frames (or B independent ones), S starts, D directions, N joints, J = 21 human joints, C blocks (see `solve`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import torch
from torch import Tensor, nn

from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.errors import UserError
from mrhubo.fast.poses import check_frame_rate
from mrhubo.motion.motion import Motion
from mrhubo.motion.poses import MotionLike, read_poses, to_tensor
from mrhubo.motion.steady import steady_root
from mrhubo.reference.avoidance import Avoidance
from mrhubo.reference.candidates import along_motion, from_starts
from mrhubo.reference.collision_free import CollisionFreeProblem, avoid_collisions
from mrhubo.reference.metrics import angle_between, at_limit_share, count_jumps, direction_error
from mrhubo.reference.result import OptimizationResult
from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.speed import speed_bound
from mrhubo.reference.standing import HumanSteps, Legs, Stand, Standing, flatten, read_steps, standing_fields
from mrhubo.reference.starts import StartPool
from mrhubo.reference.terms import Smoothness, pull_at
from mrhubo.reference.trajectory import MotionTask, pick, smooth_motion
from mrhubo.robot import BodyMap, Robot, robot_facts


@dataclass(frozen=True)
class ReferenceResult:
    """A robot motion and how good it is."""

    q_TN: Tensor
    """Joint angles [rad], inside the limits."""
    residual_deg_TD: Tensor
    """Angle between the robot's and the human's measured directions (`BodyMap.measured`)."""
    at_limit_share: float
    """Share of all joint angles that are at a limit (within 0.001 rad)."""
    jumps: int
    """Steps of an arm or the neck faster than 0.5 rad per 1/24 s while its human directions turn less than 0.25 rad."""
    rests_T: Tensor
    """Frames (T,) that `retarget_collision_free` could not free, which hold the nearest free pose."""


class OptimizationRetargeter(nn.Module):
    """Optimisation-based retargeter of one robot. Deterministic for a seed."""

    def __init__(self, robot: Robot | BodyMap, smoothness: float = 0.02, starts: int = 12, seed: int = 0) -> None:
        """Prepares the starts.

        Args:
            robot: a robot that knows which of its links stand for which body part (`Robot.from_urdf`,
                `Robot.from_config`), or its body map.
            smoothness: weight of |q_t - q_(t-1)|^2 at 24 frames per second [1/rad^2]; at other rates the same for the
                same velocity. 0: every frame on its own.
            starts: starting points per frame.
            seed: of the random robot poses that serve as starting points.

        Raises:
            UserError: the robot knows no body parts, or a number makes no sense.
        """
        if not (math.isfinite(smoothness) and smoothness >= 0):
            raise UserError(f"reference retargeter: smoothness must be 0 or more, found {smoothness}")
        if starts < 2:
            raise UserError(f"reference retargeter: needs at least 2 starts, found {starts}")
        super().__init__()
        self.body_map = robot if isinstance(robot, BodyMap) else BodyMap.of(robot)
        self.smoothness, self.starts = smoothness, starts
        self.problem = DirectionProblem(self.body_map)
        self._pool = StartPool(self.problem, starts, seed)
        self._free: CollisionFreeProblem | None = None
        self._avoidance: Avoidance | None = None
        self._legs = Legs(self.body_map)
        self._standing = Standing(self._legs) if self._legs.has_feet else None

    if TYPE_CHECKING:

        def __call__(
            self, motion: MotionLike, frame_rate: float | None = None, avoid_collisions: bool = False
        ) -> OptimizationResult:
            """`forward`."""
            ...

    @torch.no_grad()
    def forward(
        self, motion: MotionLike, frame_rate: float | None = None, avoid_collisions: bool = False
    ) -> OptimizationResult:
        """Joint angles of a human motion, and where the base of a robot with feet goes, if the motion tells of its root
        (`mrhubo.reference.standing`): then planted feet stand flat and stay where they are.

        Args:
            motion: a `Motion`, or an array of local rotations of SMPL's joints 1..21: matrices (..., 21, 3, 3),
                axis-angle [rad] (..., 63) or 6D (..., 21, 6). The answer has its leading axes, of which the last is the
                time, and the others are motions of their own; none for a single pose.
            frame_rate: frames per second of an array; a `Motion` has its own. Without one, every frame is solved on its
                own.
            avoid_collisions: frames in which the robot would touch itself give way (`mrhubo.reference.avoidance`).

        Raises:
            UserError: the array has another shape, holds NaN, infinite numbers or what is no rotation (says in which
                frame), or the frame rate is not positive.
        """
        as_seen = motion if isinstance(motion, Motion) else None
        if as_seen is not None and self._legs.has_feet:
            motion = steady_root(as_seen)
        poses = read_poses(motion, frame_rate, self.body_map.skeleton)
        local_TJ33, shape = poses.local_TJ33.to(self.problem.device), poses.shape
        steps = read_steps(motion, local_TJ33, self._legs, as_seen) if isinstance(motion, Motion) else None
        stand = None if steps is None else self._stand(local_TJ33, steps, avoid_collisions)
        clips = local_TJ33.split(max(1, shape[-1])) if shape and poses.frame_rate is not None else [local_TJ33]
        options = (poses.frame_rate, avoid_collisions)
        answers = [stand.q_TN] if stand else [self._solve(clip_TJ33, *options) for clip_TJ33 in clips if len(clip_TJ33)]
        robot = self.body_map.robot
        q_TN = torch.cat(answers) if answers else local_TJ33.new_zeros(0, len(robot.joint_names))
        links = robot.forward(q_TN)
        error_TD = direction_error(self.body_map, q_TN, local_TJ33, links)
        touches_T = self.body_map.collision.touches(q_TN, links)

        def shaped(tensor: Tensor) -> Tensor:
            return tensor.unflatten(0, shape) if shape else tensor[0]

        return OptimizationResult(
            shaped(q_TN), robot.joint_names, shaped(error_TD), None if touches_T is None else shaped(touches_T),
            self.body_map.measured_names, poses.frame_rate,
            *((motion.name, motion.source) if isinstance(motion, Motion) else ("", "")),
            robot_facts(robot, "the optimiser of mrhubo", robot.description.kinematics),
            **({} if stand is None or steps is None else standing_fields(
                stand.position_T3, stand.rotation_T33, self._legs.planted(steps.contacts.planted_TP), self._legs)),
        )  # fmt: skip

    def _solve(self, local_TJ33: Tensor, frame_rate: float | None, avoid_collisions: bool) -> Tensor:
        """Joint angles (T, N) [rad] of one motion, or of frames on their own."""
        if frame_rate is not None:
            return self.retarget(local_TJ33, frame_rate, avoid_collisions).q_TN
        q_TN = self.solve_frames(local_TJ33)[0]
        return self.avoidance(q_TN, self._targets(local_TJ33)) if avoid_collisions else q_TN

    def _stand(self, local_TJ33: Tensor, steps: HumanSteps, avoid_collisions: bool) -> Stand:
        """One motion on the floor."""
        assert self._standing is not None, "who has no feet has no steps"
        target_TD3 = flatten(self._targets(local_TJ33), steps, self._legs)
        rate = steps.frame_rate
        q_TN = self._motion(target_TD3, self._along(target_TD3, rate), rate)
        return self._standing(q_TN, target_TD3, steps, self._smoothness(rate), avoid_collisions)

    @property
    def avoidance(self) -> Avoidance:
        """What makes answers give way that touch the robot itself; made when first asked for."""
        if self._avoidance is None:
            self._avoidance = Avoidance(self.body_map)
        return self._avoidance

    @torch.no_grad()
    def retarget(self, local_TJ33: MotionLike, frame_rate: float, avoid_collisions: bool = False) -> ReferenceResult:
        """The robot's motion for human poses, local rotations (T, 21, 3, 3) at `frame_rate` frames per second;
        `avoid_collisions`: as for a call.

        Raises:
            UserError: the pose has the wrong shape or a frame that is no pose, or the frame rate is not positive.
        """
        check_frame_rate(frame_rate, needed=True)
        target_TD3 = self._targets(local_TJ33)
        avoidance = self.avoidance if avoid_collisions else None
        q_TN = self._motion(target_TD3, self._along(target_TD3, frame_rate), frame_rate, avoidance)
        return self._result(q_TN, target_TD3, frame_rate)

    @torch.no_grad()
    def motion_and_optima(self, local_TJ33: MotionLike, frame_rate: float) -> tuple[Tensor, Tensor]:
        """The joint angles (T, N) [rad] of `retarget`, of all starts in each frame, and those of `solve_frames`, in
        little more time than the latter take.

        Raises:
            UserError: as for `retarget`.
        """
        check_frame_rate(frame_rate, needed=True)
        target_TD3 = self._targets(local_TJ33)
        candidates = self._candidates(target_TD3)
        return self._motion(target_TD3, candidates, frame_rate), self._polish(*candidates, target_TD3)[0]

    def _motion(
        self,
        target_TD3: Tensor,
        candidates: tuple[Tensor, Tensor],
        frame_rate: float,
        avoidance: Avoidance | None = None,
    ) -> Tensor:
        """The motion (T, N) [rad] among and near candidates (T, S, N), whose blocks have a cost (T, S, C) each."""
        smoothness = self._smoothness(frame_rate)
        if smoothness.pull == 0 or len(target_TD3) == 1:
            q_TN = self._polish(*candidates, target_TD3)[0]
            return q_TN if avoidance is None else avoidance(q_TN, target_TD3)
        bound = speed_bound(self.body_map.robot.velocity_N, frame_rate)
        task = MotionTask(target_TD3, smoothness, frame_rate, *bound, avoidance=avoidance)
        return smooth_motion(self.problem, *candidates, task)

    @torch.no_grad()
    def retarget_collision_free(
        self, local_TJ33: MotionLike, frame_rate: float, q_TN: Tensor | None = None
    ) -> ReferenceResult:
        """A motion in which the robot never touches itself, as near to the human's as that allows. Unlike that of
        `retarget`, it does not keep to the limits of joints' speeds.

        Args:
            local_TJ33: human poses, local rotations (T, 21, 3, 3).
            frame_rate: frames per second.
            q_TN: what `retarget` gave for the same poses, if it is there already.

        Raises:
            UserError: as for `retarget`; or no pose that was tried, nor the robot's home pose, is free of collision.
        """
        if q_TN is None:
            q_TN = self.retarget(local_TJ33, frame_rate).q_TN
        target_TD3 = self._targets(local_TJ33)
        pull = self._smoothness(frame_rate).pull
        q_TN, rests_T = avoid_collisions(self._free_problem, self._pool, q_TN.to(target_TD3), target_TD3, pull)
        return self._result(q_TN, target_TD3, frame_rate, rests_T)

    @property
    def _free_problem(self) -> CollisionFreeProblem:
        if self._free is None:
            self._free = CollisionFreeProblem(self.body_map)
        return self._free

    def _smoothness(self, frame_rate: float) -> Smoothness:
        return Smoothness(pull_at(self.smoothness, frame_rate))

    @torch.no_grad()
    def solve_frames(self, local_BJ33: MotionLike) -> tuple[Tensor, Tensor]:
        """The best joint angles (B, N) [rad] of independent human poses (B, 21, 3, 3), and their cost (B,).

        Raises:
            UserError: the pose has the wrong shape or a frame that is no pose.
        """
        target_BD3 = self._targets(local_BJ33)
        q_BN, cost_BC = self._polish(*self._candidates(target_BD3), target_BD3)
        return q_BN, cost_BC.sum(dim=1)

    def _targets(self, local_BJ33: MotionLike) -> Tensor:
        local_BJ33, joints = to_tensor(local_BJ33, self.body_map.skeleton), len(POSED_JOINT_NAMES)
        if local_BJ33.ndim != 4 or tuple(local_BJ33.shape[1:]) != (joints, 3, 3) or not len(local_BJ33):
            raise UserError(f"human motion: expected rotations of shape (frames, {joints}, 3, 3), one frame or more, "
                            f"found {tuple(local_BJ33.shape)}")  # fmt: skip
        local_BJ33 = local_BJ33.to(self.problem.device, torch.float32)
        target_BD3 = self.body_map.human_directions(local_BJ33)
        measured_BD3 = target_BD3[:, self.body_map.measured]
        for wrong_B, what in (
            (~local_BJ33.isfinite().flatten(1).all(dim=1), "has numbers that are NaN or infinite"),
            (((measured_BD3.norm(dim=-1) - 1).abs() > 1e-3).any(dim=1), "has a matrix that is no rotation"),
        ):
            if bool(wrong_B.any()):
                frames = torch.nonzero(wrong_B)[:, 0]
                more = f" (and {len(frames) - 1} more)" if len(frames) > 1 else ""
                raise UserError(f"human motion: frame {int(frames[0])}{more}, counted from 0, {what}")
        return target_BD3

    def _candidates(self, target_BD3: Tensor) -> tuple[Tensor, Tensor]:
        """Nearly converged solutions (B, S, N) from the starts, and the cost of their blocks (B, S, C)."""
        return from_starts(self.problem, self._pool, target_BD3)

    def _along(self, target_TD3: Tensor, frame_rate: float) -> tuple[Tensor, Tensor]:
        """The same for one motion. Motions of arms are what networks are measured by: there, no start is spared."""
        pull = self._smoothness(frame_rate).pull
        if not (self._legs.has_feet and pull):
            return self._candidates(target_TD3)
        return along_motion(self.problem, self._pool, target_TD3, frame_rate, pull)

    def _polish(self, candidates_BSN: Tensor, cost_BSC: Tensor, target_BD3: Tensor) -> tuple[Tensor, Tensor]:
        """Each block's best candidate, converged: angles (B, N) and costs (B, C)."""
        best_BN = pick(candidates_BSN, cost_BSC.argmin(dim=1), self.problem.blocks.joints_NC)
        return self.problem.minimise(best_BN, target_BD3)

    def _result(
        self, q_TN: Tensor, target_TD3: Tensor, frame_rate: float, rests_T: Tensor | None = None
    ) -> ReferenceResult:
        problem = self.problem
        robot = self.body_map.robot
        robot_TD3, columns = self.body_map.robot_directions(robot.forward(q_TN)), self.body_map.measured
        off_TD = torch.rad2deg(angle_between(robot_TD3[:, columns], target_TD3[:, columns]))
        return ReferenceResult(
            q_TN, off_TD, float(at_limit_share(robot, q_TN).mean()),
            count_jumps(problem, q_TN, target_TD3, frame_rate),
            torch.zeros(len(q_TN), dtype=torch.bool) if rests_T is None else rests_T.cpu(),
        )  # fmt: skip
