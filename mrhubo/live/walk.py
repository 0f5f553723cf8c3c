"""What a session does of a robot with legs beside its joints: roots are checked, legs ramp up, the base is carried.

Legend: N joints, X branches, R feet.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mrhubo.fast.plain.ground import Stance
from mrhubo.live.body import SeenPose
from mrhubo.live.floating_base import FloatingBase
from mrhubo.live.governor import Governor
from mrhubo.live.output import BasePose, Standing
from mrhubo.live.robot import LiveRobot, StreamRoot
from mrhubo.live.roots import Roots
from mrhubo.live.turns import quaternion_of


class Walk:
    """Legs and base of one robot."""

    def __init__(self, robot: LiveRobot, governor: Governor) -> None:
        """A robot that stands at home."""
        assert robot.standing is not None and robot.standing.legs is not None, "who has no feet does not walk"
        self._names = robot.foot_names
        self._legs_N = np.append(robot.legs_X, False)[robot.branch_N]
        self._roots, self._governor = Roots(robot.standing.legs), governor
        self._base = FloatingBase(robot.standing, governor.q_N, governor.period, governor.brake_time)
        self._quaternion_4 = quaternion_of(self._base.base.turn_33)
        self._seen_since: float | None = None
        """Since when legs are seen [s]; None: they are in doubt."""
        self.stance: Stance | None = None
        """The stream's newest; None: nobody has been seen."""
        self._share = 0.0

    @property
    def still(self) -> bool:
        """Whether the base has come to rest, if joints have."""
        return self._base.still

    def root(self, pose: SeenPose, now: float) -> tuple[SeenPose, StreamRoot]:
        """As `Roots.see`."""
        return self._roots.see(pose, now)

    def pace(self, pace_N: np.ndarray, seen: float, now: float, ramp: Callable[[float], float]) -> np.ndarray:
        """How fast joints may turn (N,) [rad/s]: those of legs rise to it again whenever they are seen again.

        Args:
            pace_N: how fast they may turn otherwise.
            seen: how far legs are to follow what is seen, 0..1.
            now: our clock [s].
            ramp: share of the full speed, some time [s] after a start.
        """
        if seen == 0:
            self._seen_since, self._share = None, 0.0
            return pace_N
        self._seen_since = now if self._seen_since is None else self._seen_since
        risen = ramp(now - self._seen_since)
        self._share = seen * risen
        return np.where(self._legs_N, risen * pace_N, pace_N)

    def step(self, stop_N: np.ndarray, share: float) -> None:
        """Carries the base with the joints as they are sent, and would stand at `stop_N` (N,) [rad]; `share`: of the
        full speed, 0 if the robot is stopped.
        """
        self._base.step(self._governor.q_N, stop_N, self.stance, share * self._share)

    def settle(self) -> None:
        """The base is where it would have come to rest: nothing was sent for longer than that takes."""
        self._base.settle()

    def told(self) -> Standing:
        """Where the base is, where it comes to rest if the robot brakes, and which feet are planted."""
        self._quaternion_4 = quaternion_of(self._base.base.turn_33, self._quaternion_4)
        rest = self._base.standstill()
        return Standing(
            BasePose(self._base.base.place_3, self._quaternion_4),
            BasePose(rest.place_3, quaternion_of(rest.turn_33, self._quaternion_4)),
            dict(zip(self._names, self._base.planted_R.tolist(), strict=True)),
        )
