"""Poses come in one after the other, joint angles go out at once: no jump, no joint faster than it can turn.

    stream = Stream(retargeter, rate=60)
    for pose in camera:                     # local rotations of SMPL's joints 1..21, or None where nobody is seen
        answer = stream(pose)
        robot.move(answer.q)

Legend: B people, T frames, D directions, N joints, J = 21 human joints.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import torch
from torch import Tensor

from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.errors import UserError
from mrhubo.fast import StreamSettings
from mrhubo.fast.stream_clock import StreamClock
from mrhubo.motion import Motion, MotionLike, read_poses, to_tensor
from mrhubo.motion.checks import check_frame_rate
from mrhubo.retargeter import Retargeter, RetargetResult, join_results
from mrhubo.streaming.follow import Follower, StreamState

_MOST_PEOPLE = 10_000
_PART = 8_192
"""Frames that are worked on at a time where that is possible."""


class Stream:
    """A retargeter that goes on from its last answer. One thread at a time may use a stream."""

    def __init__(
        self,
        retargeter: Retargeter,
        rate: float = 60.0,
        people: int | None = None,
        settings: StreamSettings | None = None,
    ) -> None:
        """A stream that has seen nobody.

        Args:
            retargeter: as it was loaded; where it is on a GPU, so is the stream.
            rate: frames per second, for frames that come without a time.
            people: how many people, each with a robot of their own, are in every frame; poses and answers then have a
                leading axis of this size. None: one, and no such axis.
            settings: times and speeds; default: `StreamSettings()`.

        Raises:
            UserError: the rate is not positive, or the number of people none.
        """
        check_frame_rate(rate, needed=True)
        if people is not None and (type(people) is not int or not 1 <= people <= _MOST_PEOPLE):
            raise UserError(
                f"stream: people must be a whole number from 1 to {_MOST_PEOPLE:,}, or None, found {people}"
            )
        self.retargeter, self.rate, self.people = retargeter, float(rate), people
        self.settings = settings or StreamSettings()
        self.reset()

    def reset(self, q: MotionLike | None = None) -> None:
        """Forgets everything. The next pose may have any time, and its answer is taken up at once.

        Args:
            q: where the robot stands [rad], (N,) or (people, N): it then goes from there within its limits.

        Raises:
            UserError: q has another shape, is no number, or lies outside the joints' limits.
        """
        self._follower = Follower(self.retargeter, self.settings, self.settings.longest_step(self.rate))
        self._state = self._follower.begin(self.people or 1, None if q is None else self._standing(q))
        rest_33 = torch.eye(3, device=self.retargeter.device)
        self._seen_BJ33 = rest_33.expand(self.people or 1, len(POSED_JOINT_NAMES), 3, 3)
        self._clock = StreamClock(self.rate)

    def __call__(self, pose: MotionLike | None, time: float | None = None) -> RetargetResult:
        """The answer to one frame, as a retargeter gives it for a single pose, or for (people,) poses.

        Args:
            pose: local rotations in any form that a retargeter takes, (21, 3, 3), (63,) or (21, 6), with a leading axis
                if there are several people. None: nobody is seen, so the robot goes to where it was going, and stays;
                the same for those whose pose holds NaN or infinite numbers. Their confidence is 0.
            time: of the frame [s], on any clock; default: 1 / rate after the last one. A time that has already been
                answered gets the same answer again.

        Raises:
            UserError: the pose has another shape or holds what is no rotation, or the time is no number or before the
                last one. The stream is as it was.
        """
        seen_B = self._advance(pose, time)
        result = self.retargeter.judge(self._state.joints.q_BN, self._seen_BJ33)
        result = _without_confidence(result, ~seen_B)
        return result.with_leading(() if self.people is None else (self.people,), None)

    def joints(self, pose: MotionLike | None, time: float | None = None) -> Tensor:
        """The joint angles (N,) or (people, N) [rad] of `__call__` alone, which take half of its time."""
        self._advance(pose, time)
        return self._state.joints.q_BN[0] if self.people is None else self._state.joints.q_BN

    @torch.no_grad()
    def _advance(self, pose: MotionLike | None, time: float | None) -> Tensor:
        """Works on a frame; who is seen (B,)."""
        local_BJ33, seen_B = self._read(pose)
        passed, time = self._clock.passed(time)
        if passed > 0:
            target_BD3 = self.retargeter.body_map.human_directions(local_BJ33)
            self._state = self._follower.advance(self._state, local_BJ33, target_BD3, seen_B, passed)
        self._seen_BJ33, self._clock.time = local_BJ33, time
        return seen_B

    def _read(self, pose: MotionLike | None) -> tuple[Tensor, Tensor]:
        """Poses (B, 21, 3, 3), the last ones of those who are not seen, and who is seen (B,)."""
        people = self.people or 1
        if pose is None:
            return self._seen_BJ33, torch.zeros(people, dtype=torch.bool, device=self.retargeter.device)
        given = to_tensor(pose, self.retargeter.body_map.skeleton)
        given = given[None] if self.people is None else given
        if given.ndim < 2 or len(given) != people:
            found, wanted = tuple(to_tensor(pose).shape), "a single one" if self.people is None else f"{people} of them"
            raise UserError(f"stream: expected poses of one frame, {wanted}, found an array of shape {found}")
        seen_B = given.flatten(1).isfinite().all(dim=1)
        poses = read_poses(given[seen_B])
        if len(poses.shape) != 1:
            raise UserError(f"stream: expected one pose a person, found an array of shape {tuple(given.shape)}")
        local_BJ33, seen_B = self._seen_BJ33.clone(), seen_B.to(self.retargeter.device)
        local_BJ33[seen_B] = poses.local_TJ33.to(local_BJ33)
        return local_BJ33, seen_B

    def _standing(self, q: MotionLike) -> Tensor:
        robot, people = self.retargeter.body_map.robot, self.people or 1
        q_BN = to_tensor(q).to(self.retargeter.device, torch.float32)
        q_BN = q_BN[None] if self.people is None else q_BN
        if tuple(q_BN.shape) != (people, len(robot.joint_names)):
            raise UserError(f"stream: q must have {len(robot.joint_names)} angles a robot, found {tuple(q_BN.shape)}")
        if not bool(((q_BN >= robot.lower_N) & (q_BN <= robot.upper_N)).all()):  # nor NaN
            raise UserError("stream: q lies outside the joints' limits")
        return q_BN

    def retarget(self, motion: Motion) -> RetargetResult:
        """A motion as this stream's settings would have it: all of its frames, one after the other. The stream itself
        stays as it is.
        """
        return self.retarget_all([motion])[0]

    @torch.no_grad()
    def retarget_all(self, motions: Sequence[Motion]) -> list[RetargetResult]:
        """As `retarget`, for motions of any lengths and frame rates, those of one rate at the same time."""
        answers: dict[int, Tensor] = {}
        for rate in sorted({motion.frame_rate for motion in motions}):
            chosen = [i for i, motion in enumerate(motions) if motion.frame_rate == rate and len(motion)]
            if chosen:
                answers |= dict(zip(chosen, self._run([motions[i] for i in chosen], rate), strict=True))
        results = []
        for i, motion in enumerate(motions):
            local_TJ33 = self._poses(motion)
            q_TN = answers.get(i, local_TJ33.new_zeros(0, len(self.retargeter.joint_names)))
            parts = zip(q_TN.split(_PART), local_TJ33.split(_PART), strict=True)
            result = join_results(
                [self.retargeter.judge(*part, motion.frame_rate if len(motion) else None) for part in parts]
            )
            results.append(result.with_leading((len(motion),), motion.frame_rate, motion.name, motion.source))
        return results

    def _run(self, motions: Sequence[Motion], rate: float) -> list[Tensor]:
        """Joint angles (T, N) of motions of one rate, each of which is a person."""
        follower = Follower(self.retargeter, self.settings, self.settings.longest_step(rate))
        poses = [self._poses(motion) for motion in motions]
        targets = [torch.cat([self.retargeter.body_map.human_directions(part) for part in local.split(_PART)])
                   for local in poses]  # fmt: skip
        lengths_B = torch.tensor([len(motion) for motion in motions], device=self.retargeter.device)
        local_TBJ33, target_TBD3 = (torch.nn.utils.rnn.pad_sequence(found) for found in (poses, targets))
        state: StreamState = follower.begin(len(motions))
        found = []
        for frame, (local_BJ33, target_BD3) in enumerate(zip(local_TBJ33, target_TBD3, strict=True)):
            state = follower.advance(state, local_BJ33, target_BD3, frame < lengths_B, 1 / rate)
            found.append(state.joints.q_BN)
        q_TBN = torch.stack(found)
        return [q_TBN[: len(motion), i] for i, motion in enumerate(motions)]

    def _poses(self, motion: Motion) -> Tensor:
        poses = read_poses(motion, skeleton=self.retargeter.body_map.skeleton)
        return poses.local_TJ33.to(self.retargeter.device)


def _without_confidence(result: RetargetResult, chosen_B: Tensor) -> RetargetResult:
    """No confidence in those who are not seen."""
    return dataclasses.replace(
        result,
        confidence=torch.where(chosen_B, 0.0, result.confidence),
        branch_confidence=torch.where(chosen_B[:, None], 0.0, result.branch_confidence),
    )
