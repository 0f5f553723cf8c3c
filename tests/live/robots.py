"""Robots for live sessions that answer at once: at random, as they are told, or by untrained networks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mrhubo.body.joints import POSED_JOINT_NAMES
from mrhubo.config.live import LiveConfig
from mrhubo.live.robot import Answer, LiveRobot
from mrhubo.robot_motion import RobotFacts

NAMES = ("left_a", "left_b", "right_a", "right_b", "other")
LOWER, UPPER = np.array([-1.0, -0.25, -2.0, 0.125, -3.0]), np.array([1.0, 0.25, 2.0, 2.5, 3.0])
SPEED = np.array([2.0, 8.0, 20.0, 0.5, 5.0])
"""Numbers that float32 has exactly."""
AT_ONCE = LiveConfig(ramp_time=0.0)
"""The robot follows at full speed from the beginning."""


def make_robot(answer: Callable[[Any, float], np.ndarray] | None = None) -> LiveRobot:
    """Two arms of two joints, and one joint more; the first arm hangs on the left elbow, the second on the right."""
    sees = np.zeros((2, len(POSED_JOINT_NAMES)), bool)
    sees[0, POSED_JOINT_NAMES.index("left_elbow")] = sees[1, POSED_JOINT_NAMES.index("right_elbow")] = True
    home = np.clip(np.zeros(5), LOWER, UPPER)
    found = answer or (lambda pose, time: home)
    return LiveRobot(
        RobotFacts("toy", lower=LOWER, upper=UPPER, velocity=SPEED),
        NAMES,
        ("left", "right"),
        np.array([0, 0, 1, 1, -1]),
        sees,
        home,
        lambda pose, time: Answer(np.asarray(found(pose, time), float), np.ones(2)),
    )


def random_robot(seed: int, far: float = 4.0) -> LiveRobot:
    """One whose answers leap anywhere, beyond all limits too."""
    generator = np.random.default_rng(seed)
    return make_robot(lambda pose, time: generator.uniform(-far, far, 5))
