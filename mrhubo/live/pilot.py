"""From messages to the joint angles of every moment: all of a live session that needs neither clock nor socket.

Legend: N joints, X branches.
"""

from __future__ import annotations

import math
import secrets

import numpy as np

from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.live.body import Body, SeenPose
from mrhubo.live.doubt import Doubt
from mrhubo.live.governor import Governor
from mrhubo.live.handedness import Handedness
from mrhubo.live.inbox import Frame, Inbox
from mrhubo.live.messages import Landmarks, Nobody
from mrhubo.live.output import Output
from mrhubo.live.robot import LiveRobot
from mrhubo.live.roots import Jumped
from mrhubo.live.silences import Silences
from mrhubo.live.walk import Walk


class Pilot:
    """Steers one robot. `inbox` is given what comes; `tick` is called once a period, and gives what is to be sent."""

    def __init__(self, robot: LiveRobot, config: LiveConfig, frames_are_deadman: bool) -> None:
        """A robot that stands at home.

        Args:
            robot: who answers.
            config: the settings.
            frames_are_deadman: whether frames say that the robot may move; else held heartbeats do.

        Raises:
            UserError: the robot's limits are not known, or the settings leave no time to brake in.
        """
        self.robot, self.config, self.inbox = robot, config, Inbox(config.late)
        self.governor = Governor(robot.facts, config, robot.home_N)
        self._doubt = Doubt(robot, config, self.governor.speed_N)
        self._frames_are_deadman = frames_are_deadman
        self._session, self._number = secrets.token_hex(8), 0
        self._ended = False
        self._going_since: float | None = None
        """Since when the robot may move [s]; None: it may not."""
        self._ticked = -math.inf
        """When the last moment was [s]."""
        self.pauses = 0
        """How often a period took longer than `stop_time`, so that the robot had stopped by itself."""
        self.silences = Silences(config, frames_are_deadman)
        self._body = Body(has_legs=robot.standing is not None)
        self._handedness = Handedness()
        self._answer_N, self._confidence_X = robot.home_N, np.zeros(len(robot.branch_names))
        self._met = False
        """Whether somebody has been seen."""
        self.legs: Walk | None = None
        """Of a robot with legs."""
        if robot.standing is not None:
            self.legs = Walk(robot, self.governor)
            self.inbox.counts["jumped"] = 0

    @property
    def still(self) -> bool:
        """Whether nothing of the robot moves."""
        return self.governor.still and (self.legs is None or self.legs.still)

    def end(self) -> None:
        """From now on the robot brakes, and frames are left alone."""
        self._ended = True

    def tick(self, now: float) -> Output:
        """The joint angles of this moment; one period after the last. `now`: our clock [s]."""
        if now - self._ticked > self.config.stop_time:  # the process was held up, and the robot has stopped by itself
            self.pauses += math.isfinite(self._ticked)
            self.governor.settle()
            if self.legs is not None:
                self.legs.settle()
            self._going_since = None
        if now - self._ticked > self.config.heartbeat_timeout:
            self.silences.skip()
        self._ticked = now
        frame = self.inbox.take_frame()
        if frame is not None and not self._ended:
            self._look(frame, now)
        elif now - self.inbox.frame_at > self.config.unseen_after:
            self._doubt.see(None)
        going, ramp = self._may_go(now), 0.0
        if not going:
            self._going_since = None
            self.governor.brake()
        else:
            self._going_since = now if self._going_since is None else self._going_since
            goal_N, pace_N = self._doubt.aim(self._answer_N, self.governor.period)
            ramp = self._ramp(now - self._going_since)
            if self.legs is not None:
                pace_N = self.legs.pace(pace_N, self._doubt.share_of_legs, now, self._ramp)
            self.governor.go(goal_N, pace_N * ramp)
        stop_N, stop_in = self.governor.standstill()
        if self.legs is not None:
            self.legs.step(stop_N, ramp)
        self._number += 1
        sure_X = np.minimum(self._doubt.sure_X, self._confidence_X).tolist()
        return Output(
            number=self._number,
            time=now,
            state=self._state(going),
            joint_names=self.robot.joint_names,
            q_N=self.governor.q_N,
            velocity_N=self.governor.velocity_N,
            stop_N=stop_N,
            stop_in=stop_in,
            confidence=dict(zip(self.robot.branch_names, sure_X, strict=True)),
            session=self._session,
            counts=self.inbox.counts,
            standing=None if self.legs is None else self.legs.told(),
        )

    def _look(self, frame: Frame, now: float) -> None:
        """Takes up what a frame shows."""
        pose, root = self._pose(frame), None
        if pose is not None and self.legs is not None:
            try:
                pose, root = self.legs.root(pose, now)
            except Jumped:
                self.inbox.counts["jumped"] += 1
                return
        self._doubt.see(None if pose is None else pose.sure_J)
        if pose is None and not self._met:
            return
        given = (None if pose is None else pose.local_J33, now)
        try:
            answer = self.robot.answer(*given) if root is None else self.robot.answer(*given, root)
        except UserError:  # the retargeter is stricter about rotations than the message's reader was
            self.inbox.counts["malformed"] += 1
            self._doubt.see(None)
            return
        self._met = True
        self._answer_N, self._confidence_X = answer.q_N, answer.confidence_X
        if self.legs is not None:
            self.legs.stance = answer.stance

    def _pose(self, frame: Frame) -> SeenPose | None:
        """The pose of a frame; None: nobody is seen."""
        if isinstance(frame, Landmarks):
            points = frame.points if frame.axes_known else self._handedness.right(frame.points)
            return self._body.see(points, frame.sure, frame.in_world) if points else None
        return None if isinstance(frame, Nobody) else frame

    def _may_go(self, now: float) -> bool:
        inbox = self.inbox
        last = inbox.frame_at if self._frames_are_deadman else inbox.heartbeat_at
        held = self._frames_are_deadman or inbox.held
        self.silences.hear(last, held and not self._ended)
        return held and not self._ended and now - last <= self.config.heartbeat_timeout

    def _ramp(self, passed: float) -> float:
        """Share of the full speed, some time [s] after the robot was let go."""
        return 1.0 if passed >= self.config.ramp_time else passed / self.config.ramp_time

    def _state(self, going: bool) -> str:
        if self._ended:
            return "ended"
        if not going:
            return "stopped"
        if not self._met:
            return "waiting"
        return "doubtful" if self._doubt.doubtful else "following"
