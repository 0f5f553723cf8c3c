"""From messages to the joint angles of every moment: all of a live session that needs neither clock nor socket.

Legend: N joints, X branches.
"""

from __future__ import annotations

import math
import secrets

import numpy as np

from mrhubo.config.live import LiveConfig
from mrhubo.live.body import Body, SeenPose
from mrhubo.live.doubt import Doubt
from mrhubo.live.governor import Governor
from mrhubo.live.inbox import Frame, Inbox
from mrhubo.live.messages import Landmarks, Nobody
from mrhubo.live.output import Output
from mrhubo.live.robot import LiveRobot


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
        self._body = Body()
        self._answer_N, self._confidence_X = robot.home_N, np.zeros(len(robot.branch_names))
        self._met = False
        """Whether somebody has been seen."""

    def end(self) -> None:
        """From now on the robot brakes, and frames are left alone."""
        self._ended = True

    def tick(self, now: float) -> Output:
        """The joint angles of this moment; one period after the last. `now`: our clock [s]."""
        if now - self._ticked > self.config.stop_time:  # the process was held up, and the robot has stopped by itself
            self.governor.settle()
            self._going_since = None
        self._ticked = now
        frame = self.inbox.take_frame()
        if frame is not None and not self._ended:
            self._look(frame, now)
        elif now - self.inbox.frame_at > self.config.unseen_after:
            self._doubt.see(None)
        going = self._may_go(now)
        if not going:
            self._going_since = None
            self.governor.brake()
        else:
            self._going_since = now if self._going_since is None else self._going_since
            goal_N, pace_N = self._doubt.aim(self._answer_N, self.governor.period)
            self.governor.go(goal_N, pace_N * self._ramp(now - self._going_since))
        stop_N, stop_in = self.governor.standstill()
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
        )

    def _look(self, frame: Frame, now: float) -> None:
        """Takes up what a frame shows."""
        pose: SeenPose | None
        if isinstance(frame, Landmarks):
            pose = self._body.see(frame.points, frame.sure) if frame.points else None
        else:
            pose = None if isinstance(frame, Nobody) else frame
        self._doubt.see(None if pose is None else pose.sure_J)
        if pose is None and not self._met:
            return
        self._met = True
        answer = self.robot.answer(None if pose is None else pose.local_J33, now)
        self._answer_N, self._confidence_X = answer.q_N, answer.confidence_X

    def _may_go(self, now: float) -> bool:
        inbox = self.inbox
        last = inbox.frame_at if self._frames_are_deadman else inbox.heartbeat_at
        held = self._frames_are_deadman or inbox.held
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
