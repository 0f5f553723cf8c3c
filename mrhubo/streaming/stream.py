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
from typing import Any

import torch
from torch import Tensor

from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.errors import UserError
from mrhubo.fast import FastRetargeter, StreamSettings
from mrhubo.fast.pelvis import Pelvises
from mrhubo.fast.poses import check_frame_rate
from mrhubo.fast.roots import Ways
from mrhubo.fast.stream_clock import StreamClock
from mrhubo.fast.stream_settings import checked
from mrhubo.motion import Motion, MotionLike, read_poses
from mrhubo.motion.steady import steady_frames
from mrhubo.reference import OptimizationRetargeter
from mrhubo.reference.standing import (
    Legs,
    Standing,
    given_contacts,
    has_root,
    motion_root,
    standing_fields,
)
from mrhubo.retargeter import Retargeter, RetargetResult, join_results
from mrhubo.retargeter.without_training import optimised
from mrhubo.streaming.follow import Follower, StreamState
from mrhubo.streaming.ground import GroundState, Seen
from mrhubo.streaming.people import without_confidence
from mrhubo.streaming.reading import FrameReader, Root

_PART = 8_192
"""Frames that are worked on at a time where that is possible."""


class Stream:
    """A retargeter that goes on from its last answer. One thread at a time may use a stream."""

    def __init__(
        self,
        retargeter: Retargeter | OptimizationRetargeter,
        rate: float = 60.0,
        people: int | None = None,
        settings: StreamSettings | None = None,
        floor: float | None = None,
    ) -> None:
        """A stream that has seen nobody.

        Args:
            retargeter: as it was loaded; where it is on a GPU, so is the stream. The optimiser needs some seconds until
                the stream is there.
            rate: frames per second, for frames that come without a time.
            people: how many people, each with a robot of their own, are in every frame; poses and answers then have a
                leading axis of this size. None: one, and no such axis.
            settings: times and speeds; default: `StreamSettings()`.
            floor: height of the floor in the people's world [m], for robots with feet; None: it is learned on the way.

        Raises:
            UserError: the rate is not positive, the number of people none, the floor no number, or the retargeter one
                of `mrhubo.load_fast`.
        """
        check_frame_rate(rate, needed=True)
        if isinstance(retargeter, FastRetargeter):
            raise UserError("stream: this retargeter is without PyTorch, so its stream is mrhubo.FastStream")
        if isinstance(retargeter, OptimizationRetargeter):
            retargeter = optimised(retargeter.body_map)
        if not isinstance(retargeter, Retargeter):
            kind = type(retargeter).__name__
            raise UserError(f"stream: expected a retargeter of mrhubo.load or for_robot, or an optimiser, found {kind}")
        self.retargeter, self.rate, self.people = retargeter, float(rate), people
        self.settings, self.floor = checked(settings, floor)
        self._legs = Legs(retargeter.body_map)
        self._reader = FrameReader(retargeter.body_map, self._legs, people)
        self._standing: Standing | None = None
        self.reset()

    def reset(self, q: MotionLike | None = None) -> None:
        """Forgets everything. The next pose may have any time, and its answer is taken up at once.

        Args:
            q: where the robot stands [rad], (N,) or (people, N): it then goes from there within its limits.

        Raises:
            UserError: q has another shape, is no number, or lies outside the joints' limits.
        """
        rest_33 = torch.eye(3, device=self.retargeter.device)
        self._begin_BN = None if q is None else self._reader.angles(q, rest_33)
        self._state: StreamState | None = None
        """None: no frame has come, so it is not known whether roots will come with them."""
        self._seen_BJ33 = rest_33.expand(self.people or 1, len(POSED_JOINT_NAMES), 3, 3)
        self._root_B33, self._place_B3 = rest_33.expand(self.people or 1, 3, 3), rest_33.new_zeros(self.people or 1, 3)
        self._ways, self._pelvis = Ways(self.people or 1, self.floor is not None), Pelvises(self.people or 1)
        self._turn_B4: Tensor | None = None
        self._clock = StreamClock(self.rate)

    def __call__(
        self, pose: MotionLike | None, time: float | None = None, root: Root | None = None, contacts: Any = None
    ) -> RetargetResult:
        """The answer to one frame, as a retargeter gives it for a single pose, or for (people,) poses.

        Args:
            pose: local rotations in any form that a retargeter takes, (21, 3, 3), (63,) or (21, 6), with a leading axis
                if there are several people. None: nobody is seen, so the robot goes to where it was going, and stays;
                the same for those whose pose holds NaN or infinite numbers. Their confidence is 0.
            time: of the frame [s], on any clock; default: 1 / rate after the last one. A time that has already been
                answered gets the same answer again.
            root: rotation (3, 3) and place (3,) [m] of the person's pelvis in a world whose y is up, as a `Motion` has
                them, with a leading axis if there are several people. Then a robot with feet stands on its floor, and
                the answer tells where its base is; root comes with every pose or with none. Other robots do not look.
            contacts: whether each point of the person's soles is planted (P,), rear and front of each foot
                (`Stream.contact_points`), with a leading axis if there are several people; None: it is found.

        Raises:
            UserError: the pose, the root or the contacts have another shape or hold what is no rotation, the time is no
                number or before the last one, or roots came with some poses alone. The stream is as it was.
        """
        seen_B = self._advance(pose, time, root, contacts)
        assert self._state is not None
        q_BN = self._state.joints.q_BN.clone()  # whoever changes an answer does not move the robot
        result = without_confidence(self.retargeter.judge(q_BN, self._seen_BJ33), ~seen_B)
        if self._state.ground is not None:
            result = dataclasses.replace(result, **self._stands(self._state.ground, q_BN))
        return result.with_leading(() if self.people is None else (self.people,), None)

    def _stands(self, ground: GroundState, q_BN: Tensor) -> dict[str, Any]:
        """What an answer tells of the floor."""
        assert self._follower.ground is not None
        base = self._follower.ground.base(ground, self.retargeter.body_map.robot.forward(q_BN))
        found = standing_fields(*base, self._follower.ground.planted(ground), self._legs)
        turn_B4 = found["root_quaternion_wxyz"]
        if self._turn_B4 is not None:  # it goes on from the last one without a change of sign
            turn_B4 = torch.where((turn_B4 * self._turn_B4).sum(-1, keepdim=True) < 0, -turn_B4, turn_B4)
        self._turn_B4 = turn_B4
        return {**found, "root_quaternion_wxyz": turn_B4.clone()}

    def joints(
        self, pose: MotionLike | None, time: float | None = None, root: Root | None = None, contacts: Any = None
    ) -> Tensor:
        """The joint angles (N,) or (people, N) [rad] of `__call__` alone, in less time."""
        self._advance(pose, time, root, contacts)
        assert self._state is not None
        return (self._state.joints.q_BN[0] if self.people is None else self._state.joints.q_BN).clone()

    @property
    def contact_points(self) -> tuple[str, ...]:
        """The human keypoints of the soles on which the robot stands; none if it has no feet."""
        return self._reader.contact_points

    @torch.no_grad()
    def _advance(self, pose: MotionLike | None, time: float | None, root: Root | None, contacts: Any) -> Tensor:
        """Works on a frame; who is seen (B,)."""
        local_BJ33, seen_B = self._reader.poses(pose, self._seen_BJ33)
        root_B33, place_B3, given_BP = self._root_B33, self._place_B3, None
        if root is not None and self._legs.has_feet:
            if self._state is not None and not self._is_rooted and not self._unmet:
                raise UserError("stream: earlier poses came without a root; reset() begins anew")
            root_B33, place_B3, seen_B = self._reader.roots(root, root_B33, place_B3, seen_B)
            given_BP = self._reader.contacts(contacts)
        elif self._is_rooted and pose is not None:
            raise UserError("stream: earlier poses came with a root, this one has none; reset() begins anew")
        passed, time = self._clock.passed(time)
        if self._state is None or (root is not None and self._unmet):
            self._follower = self._make(self.rate, root is not None)
            at_BN = self._begin_BN if self._state is None else self._state.joints.q_BN
            self._state = self._follower.begin(self.people or 1, at_BN)
        if passed > 0:
            way_B3, turn_B33 = place_B3, root_B33
            if root is not None and self._is_rooted:
                times = (seen_B.cpu().numpy(), (self._state.unseen_B + passed).double().cpu().numpy())
                way_B3 = torch.from_numpy(self._ways.follow(place_B3.double().cpu().numpy(), *times)).to(place_B3)
                found = self._pelvis.follow(root_B33.cpu().numpy(), local_BJ33.cpu().numpy(), *times)
                turn_B33, local_BJ33 = (torch.from_numpy(part).to(place_B3) for part in found)
            target_BD3 = self.retargeter.body_map.human_directions(local_BJ33)
            seen = Seen(local_BJ33, turn_B33, way_B3, given_BP)
            self._state = self._follower.advance(self._state, local_BJ33, target_BD3, seen_B, passed, seen)
        self._seen_BJ33, self._clock.time = local_BJ33, time
        self._root_B33, self._place_B3 = root_B33, place_B3
        return seen_B

    @property
    def _is_rooted(self) -> bool:
        """Whether roots come with poses, and are looked at."""
        return self._state is not None and self._state.ground is not None

    @property
    def _unmet(self) -> bool:
        """Whether nobody has been seen, so that it is open whether roots come with poses."""
        return self._state is not None and not self._is_rooted and bool(self._state.unseen_B.isinf().all())

    def _make(self, rate: float, rooted: bool) -> Follower:
        """What follows people with a root, or without."""
        standing = None
        if rooted and self._legs.has_feet:
            standing = self._standing = self._standing or Standing(self._legs)
        return Follower(self.retargeter, self.settings, self.settings.longest_step(rate), standing, self.floor)

    def retarget(self, motion: Motion) -> RetargetResult:
        """A motion as this stream's settings would have it: all of its frames, one after the other. The stream itself
        stays as it is.
        """
        return self.retarget_all([motion])[0]

    @torch.no_grad()
    def retarget_all(self, motions: Sequence[Motion]) -> list[RetargetResult]:
        """As `retarget`, for motions of any lengths and frame rates, those of one rate at the same time. Those with a
        root move the base of a robot with feet.
        """
        answers: dict[int, _Answer] = {}
        motions = [steady_frames(motion) if self._legs.has_feet else motion for motion in motions]
        kinds = [
            (motion.frame_rate, self._legs.has_feet and has_root(motion), motion.contact_T4 is not None)
            for motion in motions
        ]
        for kind in sorted(set(kinds)):
            chosen = [i for i, motion in enumerate(motions) if kinds[i] == kind and len(motion)]
            if chosen:
                answers |= dict(zip(chosen, self._run([motions[i] for i in chosen], *kind[:2]), strict=True))
        results = []
        for i, motion in enumerate(motions):
            local_TJ33 = self._poses(motion)
            nothing = _Answer(local_TJ33.new_zeros(0, len(self.retargeter.joint_names)), {})
            answer = answers.get(i, nothing)
            parts = zip(answer.q_TN.split(_PART), local_TJ33.split(_PART), strict=True)
            result = join_results(
                [self.retargeter.judge(*part, motion.frame_rate if len(motion) else None) for part in parts]
            )
            result = dataclasses.replace(result, **answer.stands)
            results.append(result.with_leading((len(motion),), motion.frame_rate, motion.name, motion.source))
        return results

    def _run(self, motions: Sequence[Motion], rate: float, rooted: bool) -> list[_Answer]:
        """Answers to motions of one rate, each of which is a person."""
        follower = self._make(rate, rooted)
        poses = [self._poses(motion) for motion in motions]
        targets = [torch.cat([self.retargeter.body_map.human_directions(part) for part in local.split(_PART)])
                   for local in poses]  # fmt: skip
        lengths_B = torch.tensor([len(motion) for motion in motions], device=self.retargeter.device)
        local_TBJ33, target_TBD3 = (torch.nn.utils.rnn.pad_sequence(found) for found in (poses, targets))
        seen_T = self._people(motions, poses) if rooted else [None] * len(local_TBJ33)
        state: StreamState = follower.begin(len(motions))
        found, bases = [], []
        for frame, (local_BJ33, target_BD3, seen) in enumerate(zip(local_TBJ33, target_TBD3, seen_T, strict=True)):
            state = follower.advance(state, local_BJ33, target_BD3, frame < lengths_B, 1 / rate, seen)
            found.append(state.joints.q_BN)
            if follower.ground is not None and state.ground is not None:
                poses_B = self.retargeter.body_map.robot.forward(state.joints.q_BN)
                planted_BS = torch.from_numpy(follower.ground.planted(state.ground))
                bases.append((*follower.ground.base(state.ground, poses_B), planted_BS))
        q_TBN, answers = torch.stack(found), []
        columns = [torch.stack(column) for column in zip(*bases, strict=True)]
        for i, motion in enumerate(motions):
            part = [column[: len(motion), i] for column in columns]
            stands = standing_fields(part[0], part[1], part[2].numpy(), self._legs) if part else {}
            answers.append(_Answer(q_TBN[: len(motion), i], stands))
        return answers

    def _people(self, motions: Sequence[Motion], poses: Sequence[Tensor]) -> list[Seen]:
        """People with a root, frame by frame."""
        roots = [motion_root(motion, local, self._legs, self.floor is not None)
                 for motion, local in zip(motions, poses, strict=True)]  # fmt: skip
        pad = torch.nn.utils.rnn.pad_sequence
        local_TBJ33, turn_TB33, place_TB3 = (
            pad(list(found)) for found in (poses, [turn for turn, _ in roots], [place for _, place in roots])
        )
        given = [given_contacts(motion, self._legs) for motion in motions]
        known = (
            None
            if any(contact_TP is None for contact_TP in given)
            else pad([torch.from_numpy(contact_TP) for contact_TP in given if contact_TP is not None]).numpy()
        )
        frames = zip(local_TBJ33, turn_TB33, place_TB3, strict=True)
        return [Seen(*frame, None if known is None else known[t]) for t, frame in enumerate(frames)]

    def _poses(self, motion: Motion) -> Tensor:
        poses = read_poses(motion, skeleton=self.retargeter.body_map.skeleton)
        return poses.local_TJ33.to(self.retargeter.device)


@dataclasses.dataclass(frozen=True)
class _Answer:
    """To one motion."""

    q_TN: Tensor
    stands: dict[str, Any]
    """What is told of the floor: fields of a result."""
