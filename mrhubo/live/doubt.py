"""What a robot's parts do while they are hardly seen: they are held, slowed down, or relaxed to the rest pose.

Legend: N joints, X branches (an arm, the head), J = 21 human joints.
"""

from __future__ import annotations

import numpy as np

from mrhubo.config.live import LiveConfig
from mrhubo.live.robot import LiveRobot


class Doubt:
    """Goals and paces of one robot's joints, by how sure a source is of what it sees."""

    def __init__(self, robot: LiveRobot, config: LiveConfig, speed_N: np.ndarray) -> None:
        """`speed_N`: how fast joints may turn (N,) [rad/s]."""
        self._robot, self._config, self._speed_N = robot, config, speed_N
        self._goal_N = robot.home_N.copy()
        self._since_N = np.zeros(len(self._goal_N))
        """For how long [s] each joint's part has been in doubt."""
        self.sure_X = np.zeros(len(robot.branch_names))
        """How sure each part is seen, 0..1."""
        self._sure_N = np.zeros(len(self._goal_N))

    @property
    def doubtful(self) -> bool:
        """Whether some part is hardly seen."""
        return bool((self._sure_N < self._config.doubt_below).any())

    @property
    def share_of_legs(self) -> float:
        """How fast legs and base follow the person, as a share of their full speed; 0: they are held."""
        sure = float(self.sure_X[self._robot.legs_X].min(initial=1.0))
        if sure >= self._config.doubt_below:
            return 1.0
        return sure / self._config.doubt_below if self._config.doubt == "slow" else 0.0

    def see(self, sure_J: np.ndarray | None) -> None:
        """How sure the joints of a person are (J,), 0..1; None: nobody is seen."""
        sees_XJ, branch_N = self._robot.sees_XJ, self._robot.branch_N
        if sure_J is None:
            self.sure_X, least = np.zeros(len(sees_XJ)), 0.0
        else:
            self.sure_X, least = np.where(sees_XJ, sure_J, 1.0).min(axis=1), float(sure_J.min())
            legs_X = self._robot.legs_X
            if legs_X.any():  # no leg moves without the other: a robot stands on both
                self.sure_X = np.where(legs_X, self.sure_X[legs_X].min(), self.sure_X)
        self._sure_N = np.where(branch_N >= 0, np.append(self.sure_X, least)[branch_N], least)

    def aim(self, answer_N: np.ndarray, passed: float) -> tuple[np.ndarray, np.ndarray]:
        """Goals (N,) [rad] and paces (N,) [rad/s] of the joints, some time [s] after the last.

        Args:
            answer_N: the retargeter's newest answer (N,) [rad].
            passed: the time.
        """
        config = self._config
        doubtful_N = self._sure_N < config.doubt_below
        self._since_N = np.where(doubtful_N, self._since_N + passed, 0.0)
        if config.doubt == "slow":
            self._goal_N = np.where(self._sure_N > 0, answer_N, self._goal_N)
            share_N = np.where(doubtful_N, self._sure_N / max(config.doubt_below, 1e-9), 1.0)
            return self._goal_N, share_N * self._speed_N
        self._goal_N = np.where(doubtful_N, self._goal_N, answer_N)
        if config.doubt == "hold":
            return self._goal_N, self._speed_N
        relaxed_N = doubtful_N & (self._since_N > config.relax_after)
        self._goal_N = np.where(relaxed_N, self._robot.home_N, self._goal_N)
        pace_N = np.where(relaxed_N, np.minimum(config.relax_speed, self._speed_N), self._speed_N)
        return self._goal_N, pace_N
