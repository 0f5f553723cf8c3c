"""The robot that follows: who answers a pose, where it is at home, and which joints hang on what is seen.

Legend: N joints, X branches (an arm, the head), J = 21 human joints.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.body.joints import POSED_JOINT_NAMES, SIDES
from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.fast import Description, FastRetargeter, FastStream, StreamSettings
from mrhubo.retargeting.answering import has_feet
from mrhubo.robot_motion import RobotFacts

_CHEST = POSED_JOINT_NAMES.index("spine3")


@dataclass(frozen=True)
class Answer:
    """What a robot would do like a person."""

    q_N: np.ndarray
    """Joint angles (N,) [rad]."""
    confidence_X: np.ndarray
    """The retargeter's (X,), 0..1."""


@dataclass(frozen=True)
class LiveRobot:
    """A robot that follows a person."""

    facts: RobotFacts
    joint_names: tuple[str, ...]
    branch_names: tuple[str, ...]
    branch_N: np.ndarray
    """Which branch each joint is part of (N,); -1: none."""
    sees_XJ: np.ndarray
    """Which human joints each branch hangs on (X, J), bool."""
    home_N: np.ndarray
    """Joint angles (N,) [rad] at which it starts and rests."""
    answer: Callable[[np.ndarray | None, float], Answer]
    """To a pose (21, 3, 3), or to nobody, at a time [s]."""
    urdf: Path | None = None
    """Its model, where it is known; a package does not tell."""
    figure: Callable[[], dict[str, Any]] | None = None
    """How it looks on the page (`mrhubo.live.figure`); None: nobody knows."""

    @classmethod
    def of_package(cls, source: str, config: LiveConfig, form: str | None = None) -> LiveRobot:
        """By a package, without PyTorch; `form` as for `mrhubo.load_fast`.

        Raises:
            UserError: there is no such package, it is damaged, not for poses of our own skeleton, or moves the robot's
                legs.
        """
        import mrhubo

        folder = mrhubo.package_folder(source)
        fast = mrhubo.load_fast(folder, form)
        if has_feet(fast.description):
            raise _moves_legs(f"--retargeter {source}: its robot")
        found = cls.of_retargeter(fast, config)

        def figure() -> dict[str, Any]:
            from mrhubo.live.figure import figure_of
            from mrhubo.retargeter import read_package_robot

            return figure_of(read_package_robot(folder), found.joint_names)

        return replace(found, figure=figure)

    @classmethod
    def of_robot(cls, name: str, config: LiveConfig, form: str | None = None) -> LiveRobot:
        """By the universal network, without training; as `mrhubo.for_robot`.

        Raises:
            UserError: the robot cannot be used, or its config moves its legs, and nothing here keeps it on its feet.
        """
        from mrhubo.describing.run import open_robot
        from mrhubo.retargeter import untrained

        robot = open_robot(name)
        if robot.keypoints is not None and robot.keypoints.standing:
            raise _moves_legs(f"--robot {name}: its config")
        retargeter = untrained(robot)
        urdf = retargeter.body_map.robot.urdf
        found = cls.of_retargeter(FastRetargeter(retargeter.describe(), form), config, urdf)

        def figure() -> dict[str, Any]:
            from mrhubo.live.figure import figure_of

            return figure_of(robot, found.joint_names)

        return replace(found, figure=figure)

    @classmethod
    def of_retargeter(cls, retargeter: FastRetargeter, config: LiveConfig, urdf: Path | None = None) -> LiveRobot:
        """By a retargeter.

        Raises:
            UserError: it is for a body model with a rest pose of its own.
        """
        description = retargeter.description
        if not description.settings.own_rest:
            raise UserError("this retargeter is for a body model with a rest pose of its own, which no stream sends")
        lower_N, upper_N = description.cost.lower_N, description.cost.upper_N
        home_N = np.clip(np.zeros(len(lower_N)), lower_N, upper_N)
        if config.home == "hanging":
            home_N = np.clip(retargeter.predict(hanging_pose(), 10).astype(np.float64), lower_N, upper_N)
        settings = StreamSettings(avoid_collisions=config.avoid_collisions)
        stream = FastStream(retargeter, config.rate, settings)
        stream.reset(np.clip(home_N.astype(np.float32), lower_N.astype(np.float32), upper_N.astype(np.float32)))

        def answer(pose: np.ndarray | None, time: float) -> Answer:
            found = stream(pose, time)
            assert found.branch_confidence is not None
            return Answer(found.q.astype(np.float64), found.branch_confidence)

        names = description.settings.joint_names, description.settings.branch_names
        return cls(retargeter.facts, *names, *_branches(description), home_N, answer, urdf)


def _moves_legs(what: str) -> UserError:
    return UserError(
        f"{what} moves its legs, and mrhubo live keeps no robot on its feet; name one of its arms, hands and head alone"
    )


def hanging_pose() -> np.ndarray:
    """A pose (21, 3, 3) of a person who stands, arms hanging."""
    local_J33 = np.tile(np.eye(3, dtype=np.float32), (len(POSED_JOINT_NAMES), 1, 1))
    for side, sign in zip(SIDES, (-1.0, 1.0), strict=True):  # from sideways down, a little apart from the body
        angle = sign * np.radians(80.0)
        turn_33 = [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
        local_J33[POSED_JOINT_NAMES.index(f"{side}_shoulder")] = turn_33
    return local_J33


def _branches(description: Description) -> tuple[np.ndarray, np.ndarray]:
    """`branch_N` and `sees_XJ`."""
    cost, trust, reading = description.cost, description.trust, description.reading
    branches = len(description.settings.branch_names)
    branch_of_block = np.full(int(cost.block_N.max()) + 1, -1)
    sees_XJ = np.zeros((branches, len(POSED_JOINT_NAMES)), bool)
    sees_XJ[:, _CHEST] = True
    for branch in range(branches):
        blocks = cost.block_D[trust.column_XD[branch] > 0]
        branch_of_block[blocks[blocks >= 0]] = branch
        sees_XJ[branch, reading.joint_T[trust.slot_XT[branch] > 0]] = True
    return branch_of_block[cost.block_N], sees_XJ
