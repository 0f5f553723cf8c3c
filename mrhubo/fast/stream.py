"""Poses come in one after the other, joint angles go out at once, without PyTorch: `mrhubo.Stream` for one person.

    stream = FastStream(mrhubo.load_fast("package"), rate=60)
    for pose in camera:                     # local rotations of SMPL's joints 1..21, or None where nobody is seen
        answer = stream(pose)               # stream(pose, root=(turn, place)): where the robot's base is, too
        robot.move(answer.q)

Legend: D directions, N joints, C blocks of joints, J = 21 human joints; 1 and 2 answers.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from mrhubo.errors import UserError
from mrhubo.fast.answers import Ground
from mrhubo.fast.pelvis import Pelvises
from mrhubo.fast.plain.crossing import Crossing
from mrhubo.fast.plain.following import Filtered, Followed, cross_over, follow_goal, one_euro, room
from mrhubo.fast.plain.ground import Base, Seen, Stance
from mrhubo.fast.plain.human import orthonormal_columns
from mrhubo.fast.plain.judging import quaternions
from mrhubo.fast.plain.limits import Joints, Limits
from mrhubo.fast.plain.root_turn import root_turn
from mrhubo.fast.poses import check_frame_rate, has_gaps, is_motion, read_poses, refuse, to_array
from mrhubo.fast.retargeter import POLISH, FastRetargeter
from mrhubo.fast.roots import Ways, read_root
from mrhubo.fast.stream_clock import StreamClock
from mrhubo.fast.stream_settings import StreamSettings, checked
from mrhubo.robot_motion import RobotMotion

_REST_J33 = np.tile(np.eye(3, dtype=np.float32), (21, 1, 1))


class FastStream:
    """A retargeter that goes on from its last answer. One thread at a time may use a stream."""

    def __init__(
        self,
        retargeter: FastRetargeter,
        rate: float = 60.0,
        settings: StreamSettings | None = None,
        floor: float | None = None,
    ) -> None:
        """A stream that has seen nobody. Everything is compiled by now, so that no frame waits for it.

        Args:
            retargeter: as it was loaded.
            rate: frames per second, for frames that come without a time.
            settings: times and speeds; default: `StreamSettings()`.
            floor: height of the floor in the person's world [m], for robots with feet; None: it is learned on the way.

        Raises:
            UserError: the rate is not positive, floor or settings are none, or the retargeter is one with PyTorch.
        """
        check_frame_rate(rate, needed=True)
        if not isinstance(retargeter, FastRetargeter):
            raise UserError("stream: expected a retargeter of mrhubo.load_fast; the stream of others is mrhubo.Stream")
        self.settings, self.floor = checked(settings, floor)
        self.retargeter, self.rate = retargeter, float(rate)
        self._engine, self._cost = retargeter.engine, retargeter.description.cost
        self._longest_step = self.settings.longest_step(self.rate)
        self._limits = Limits.of_cost(self._cost, self.settings.ramp_time)
        self.reset()
        stands = (np.eye(3), np.zeros(3)) if self.contact_points else None
        for _ in range(2):  # a first frame, and one that follows
            self(_REST_J33, root=stands)
        self.reset()

    @property
    def contact_points(self) -> tuple[str, ...]:
        """The human keypoints of the soles on which the robot stands; none if it has no feet."""
        return tuple(self.retargeter.description.settings.facts.get("contact_points", ()))

    def reset(self, q: Any = None) -> None:
        """Forgets everything. The next pose may have any time, and its answer is taken up at once.

        Args:
            q: where the robot stands (N,) [rad]: it then goes from there within its limits.

        Raises:
            UserError: q has another shape, is no number, or lies outside the joints' limits.
        """
        cost = self._cost = self.retargeter.description.cost
        stand_N = np.clip(0.0, cost.lower_N, cost.upper_N).astype(np.float32) if q is None else self._standing(q)
        self._filtered: Filtered | None = None
        """None: nobody has been seen."""
        stand_at_N = stand_N.astype(np.float64)
        self._followed = Followed(stand_at_N, np.zeros(cost.joints_NC.shape[1]), stand_at_N)
        self._joints, self._crossing = Joints(stand_N, np.zeros(len(stand_N))), Crossing.none(len(stand_N))
        self._ground: Ground | None = None
        """None: no root has come with a pose, or the robot has no feet."""
        self._base: Base | None = None
        self._quaternion_4: np.ndarray | None = None
        self._unseen, self._placed = math.inf, q is not None
        self._seen_1J33 = _REST_J33[None].copy()
        self._clock, self._ways = StreamClock(self.rate), Ways(1, self.floor is not None)
        self._pelvis = Pelvises(1)

    def __call__(
        self, pose: Any, time: float | None = None, root: tuple[Any, Any] | None = None, contacts: Any = None
    ) -> RobotMotion:
        """The answer to one frame, as a retargeter gives it for a single pose.

        Args:
            pose: local rotations in any form that a retargeter takes, (21, 3, 3), (63,) or (21, 6). None: nobody is
                seen, so the robot goes to where it was going, and stays; the same where the pose holds NaN or infinite
                numbers. Confidence is then 0.
            time: of the frame [s], on any clock; default: 1 / rate after the last one. A time that has already been
                answered gets the same answer again.
            root: rotation (3, 3) and place (3,) [m] of the person's pelvis in a world whose y is up, as a `Motion` has
                them. Then a robot with feet stands on its floor, and the answer tells where its base is; root comes
                with every pose or with none. Other robots do not look.
            contacts: whether each point of the person's soles is planted, rear and front of each foot
                (`contact_points`); None: it is found.

        Raises:
            UserError: the pose, the root or the contacts have another shape or hold what is no rotation, the time is no
                number or before the last one, or roots came with some poses alone. The stream is as it was.
        """
        seen, target_1D3 = self._advance(pose, time, root, contacts)
        found = self._engine.answer(self._joints.q_N[None], target_1D3, 0, False, None)
        if not seen:
            found.trust_BX[:] = 0.0
        return self.retargeter.told(found, (), None, stands=self._stands())

    def _stands(self) -> dict[str, Any]:
        """What an answer tells of the floor."""
        if self._base is None or self._ground is None:
            return {}
        quaternion_4 = quaternions(self._base.turn_33)[[3, 0, 1, 2]]
        if self._quaternion_4 is not None and quaternion_4 @ self._quaternion_4 < 0:
            quaternion_4 = -quaternion_4  # it goes on from the last one without a change of sign
        self._quaternion_4 = quaternion_4
        return {
            "root_position": self._base.place_3.astype(np.float32),
            "root_quaternion_wxyz": quaternion_4.astype(np.float32),
            "contact": self._ground.planted_R,
            "contact_names": tuple(self.retargeter.description.settings.facts["feet"]),
        }

    @property
    def stance(self) -> Stance | None:
        """How the robot stood after the last frame; None where no root has come, or the robot has no feet."""
        if self._base is None or self._ground is None:
            return None
        return Stance(self._base, self._ground.weight_H, self._joints.q_N.astype(np.float64))

    def joints(
        self, pose: Any, time: float | None = None, root: tuple[Any, Any] | None = None, contacts: Any = None
    ) -> np.ndarray:
        """The joint angles (N,) [rad] of `__call__` alone, in less time."""
        self._advance(pose, time, root, contacts)
        return self._joints.q_N.copy()

    def _advance(
        self, pose: Any, time: float | None, root: tuple[Any, Any] | None, contacts: Any
    ) -> tuple[bool, np.ndarray]:
        """Works on a frame; whether somebody is seen, and the directions (1, D, 3) of the last pose that was."""
        local_1J33, seen = self._read(pose)
        stands = None
        if root is not None and self.contact_points:
            if self._ground is None and self._filtered is not None:
                raise UserError("stream: earlier poses came without a root; reset() begins anew")
            stands = read_root(root, contacts, self.contact_points)
            seen = seen and stands is not None
        elif self._ground is not None and pose is not None:
            raise UserError("stream: earlier poses came with a root, this one has none; reset() begins anew")
        passed, time = self._clock.passed(time)
        if root is not None and self.contact_points and self._ground is None:
            self._stand_up()
        person = None
        if passed > 0 and stands is not None and seen:
            one, since_1 = np.array([True]), np.array([self._unseen + passed])
            way_13 = self._ways.follow(stands.place_3[None], one, since_1)
            turn_133, local_1J33 = self._pelvis.follow(stands.turn_33[None], local_1J33, one, since_1)
            person = Seen(local_1J33[0], turn_133[0], way_13[0], stands.given_H)
        target_1D3 = self._engine.directions(local_1J33)
        if passed > 0:
            self._work(local_1J33, target_1D3[0], seen, person, passed)
        self._seen_1J33, self._clock.time = local_1J33, time
        return seen, target_1D3

    def _stand_up(self) -> None:
        """From now on there is a floor."""
        self._cost = self.retargeter.description.standing.cost
        self._followed = replace(self._followed, worse_C=np.zeros(self._cost.joints_NC.shape[1]))
        self._ground = self._engine.ground(self._longest_step, self.floor)

    def _work(
        self, local_1J33: np.ndarray, target_D3: np.ndarray, seen: bool, person: Seen | None, passed: float
    ) -> None:
        """Filter, two answers, limits, for a frame some time [s] after the last one."""
        self._unseen += passed
        velocity_N, begun_N = np.zeros(len(self._joints.q_N)), np.zeros(len(self._joints.q_N), bool)
        if seen:
            aim_D3, wanted_X3 = self._look(target_D3, person)
            if math.isinf(self._unseen):
                self._begin(local_1J33, aim_D3, wanted_X3)
            else:
                velocity_N, begun_N = self._follow(local_1J33, aim_D3, wanted_X3)
            self._unseen = 0.0
        elif self._ground is not None:
            self._ground.pass_by()
        step = min(passed, self._longest_step)
        last, goal = (self._joints, self._crossing), (self._followed.goal_N, velocity_N)
        found = follow_goal(self._limits, self._cost, self.settings, last, goal, begun_N, step)
        self._joints, self._crossing = found
        self._placed = True
        if self._ground is not None:
            self._base = self._ground.stand(self._joints.q_N)

    def _look(self, target_D3: np.ndarray, person: Seen | None) -> tuple[np.ndarray, np.ndarray]:
        """Directions of a person, filtered, and the same with places of soles after them, where there is a floor."""
        raw_X3, partial_X = target_D3, self._cost.partial_D
        if person is not None:  # the turn of what carries the legs is filtered along
            raw_X3 = np.concatenate((target_D3, self._carrier(person)[:, :2].T))
            partial_X = np.append(partial_X, (0, 0))
        if self._filtered is None:
            self._filtered = Filtered(raw_X3, np.zeros_like(raw_X3), raw_X3)
        else:
            self._filtered = one_euro(self._filtered, raw_X3, self._unseen, partial_X, self.settings)
        aim_X3 = self._filtered.filtered_D3
        if person is None or self._ground is None:
            return aim_X3, aim_X3
        passed = self._longest_step if math.isinf(self._unseen) else self._unseen
        return self._ground.look(person, aim_X3[:-2], orthonormal_columns(aim_X3[-2:].T), passed)

    def _carrier(self, person: Seen) -> np.ndarray:
        """Human axes (3, 3) that what carries the robot's legs is to have, in the world."""
        root = self.retargeter.description.root
        return person.turn_33 if root is None else person.turn_33 @ root_turn(root, person.local_J33[None])[0]

    def _begin(self, local_1J33: np.ndarray, aim_D3: np.ndarray, wanted_X3: np.ndarray) -> None:
        """Takes up the whole answer to a person who is seen for the first time."""
        network_1N = self._engine.network(local_1J33, aim_D3[None])
        first_N = self._engine.polish(network_1N, aim_D3[None], POLISH, False)[0].astype(np.float64)
        if self._ground is not None:
            first_N = self._engine.minimise(first_N[None], wanted_X3[None], POLISH)[0]
        goal_N = self._free(first_N, wanted_X3)
        self._followed = Followed(first_N, np.zeros_like(self._followed.worse_C), goal_N)
        if not self._placed:
            self._joints = Joints(goal_N.astype(np.float32), np.zeros(len(first_N)))

    def _free(self, q_N: np.ndarray, wanted_X3: np.ndarray) -> np.ndarray:
        """Joint angles (N,) [rad] after steps away from self-collision, if the settings ask for them."""
        return self._engine.avoid(q_N[None], wanted_X3[None], True)[0] if self.settings.avoid_collisions else q_N

    def _follow(
        self, local_1J33: np.ndarray, aim_D3: np.ndarray, wanted_X3: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Follows both answers; how fast the goal moves (N,) [rad/s], and which joints begin to cross over (N,)."""
        cost, settings, since = self._cost, self.settings, min(self._unseen, self._longest_step)
        network_1N = self._engine.network(local_1J33, aim_D3[None])
        start_2N = np.concatenate((self._followed.kept_N[None], network_1N))
        limits = room(cost, settings, self._followed.kept_N, since)
        both_2N, cost_2C = self._engine.follow(start_2N, np.stack((wanted_X3, wanted_X3)), *limits)
        found = cross_over(cost, settings, self._followed, both_2N, cost_2C, wanted_X3, since)
        kept_N, worse_C, left_N, begun_N = found
        goal_N, last_N = self._free(kept_N, wanted_X3), self._followed.goal_N
        self._followed = Followed(kept_N, worse_C, goal_N)
        return np.where(left_N, 0.0, (goal_N - last_N) / since), begun_N

    def _read(self, pose: Any) -> tuple[np.ndarray, bool]:
        """A pose (1, 21, 3, 3), the last one where nobody is seen, and whether somebody is."""
        if pose is None:
            return self._seen_1J33, False
        own_rest = self.retargeter.description.settings.own_rest
        if is_motion(pose):
            poses = read_poses(pose, None, own_rest)
            raise UserError(
                f"stream: expected a pose, found a motion of {poses.shape[0]} frames; give its frames one by one"
            )
        given = to_array(pose)[None]
        seen = not has_gaps(given)
        poses = read_poses(given if seen else given[:0], None, own_rest)
        if len(poses.shape) != 1:
            raise UserError(
                f"stream: expected poses of one frame, a single one, found an array of shape {given.shape[1:]}"
            )
        if not seen:
            return self._seen_1J33, False
        local_1J33 = poses.local_TJ33.copy()  # the caller's array may hold another pose by the next frame
        refuse(self._engine.wrong(local_1J33), ())
        return local_1J33, True

    def _standing(self, q: Any) -> np.ndarray:
        """Joint angles (N,), float32, that a user gives."""
        cost, q_N = self._cost, to_array(q)
        if q_N.dtype.kind not in "fiu" or q_N.shape != cost.lower_N.shape:
            raise UserError(f"stream: q must have {len(cost.lower_N)} angles, found {q_N.dtype} of shape {q_N.shape}")
        q_N = q_N.astype(np.float32)
        if not ((q_N >= cost.lower_N) & (q_N <= cost.upper_N)).all():  # nor NaN
            raise UserError("stream: q lies outside the joints' limits")
        return q_N
