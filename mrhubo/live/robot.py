"""The robot that follows: who answers a pose, where it is at home, and which joints hang on what is seen.

Legend: N joints, X branches (an arm, the head), J = 21 human joints.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.body.joints import POSED_JOINT_NAMES, SIDES
from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.fast import Description, FastRetargeter, FastStream, StreamSettings
from mrhubo.fast.plain.ground import Stance
from mrhubo.retargeting.answering import has_feet
from mrhubo.robot_motion import RobotFacts

_CHEST = POSED_JOINT_NAMES.index("spine3")


Known = Callable[[FastRetargeter, Path | None], object]
"""Is told of what answers, and of the robot's model where it is known, before anything is compiled; what it raises ends
the rest."""
StreamRoot = tuple[np.ndarray, np.ndarray]
"""A pelvis' rotation (3, 3) and place (3,) [m] in a world whose y is up."""


@dataclass(frozen=True)
class Answer:
    """What a robot would do like a person."""

    q_N: np.ndarray
    """Joint angles (N,) [rad]."""
    confidence_X: np.ndarray
    """The retargeter's (X,), 0..1."""
    stance: Stance | None = None
    """How a robot with legs stands; None: it has none, or nobody has been seen."""


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
    answer: Callable[..., Answer]
    """To a pose (21, 3, 3), or to nobody, at a time [s]; of a robot with legs a third argument is the `StreamRoot` of
    the pose."""
    urdf: Path | None = None
    """Its model, where it is known; a package does not tell."""
    figure: Callable[[], dict[str, Any]] | None = None
    """How it looks on the page (`mrhubo.live.figure`); None: nobody knows."""
    standing: Description | None = None
    """What is known of a robot that stands on feet; None: it has none, and its base is fixed."""
    legs_X: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    """Which branches are legs (X,), bool; empty: none."""

    @property
    def foot_names(self) -> tuple[str, ...]:
        """The feet on which it stands; none if it has no legs."""
        return () if self.standing is None else tuple(self.standing.settings.facts["feet"])

    @classmethod
    def of_package(
        cls, source: str, config: LiveConfig, form: str | None = None, known: Known = lambda *_: None
    ) -> LiveRobot:
        """By a package, without PyTorch; `form` as for `mrhubo.load_fast`.

        Raises:
            UserError: there is no such package, it is damaged, not for poses of our own skeleton, or moves legs without
                knowing how they stand.
        """
        import mrhubo

        folder = mrhubo.package_folder(source)
        fast = mrhubo.load_fast(folder, form)
        if has_feet(fast.description) and fast.description.legs is None:
            raise UserError(
                f"--retargeter {source}: was made before packages told how a robot stands; `mrhubo fit` makes it anew"
            )
        known(fast, None)
        found = cls.of_retargeter(fast, config)

        def figure() -> dict[str, Any]:
            from mrhubo.live.figure import figure_of
            from mrhubo.retargeter import read_package_robot

            return figure_of(read_package_robot(folder), found.joint_names)

        return replace(found, figure=figure)

    @classmethod
    def of_robot(
        cls,
        name: str,
        config: LiveConfig,
        form: str | None = None,
        whole_body: bool = False,
        known: Known = lambda *_: None,
    ) -> LiveRobot:
        """By the universal network, without training; as `mrhubo.for_robot`, whose `whole_body` it is.

        Raises:
            UserError: the robot cannot be used.
        """
        from mrhubo.describing.run import open_robot
        from mrhubo.retargeter import untrained

        robot = open_robot(name, whole_body)
        retargeter = untrained(robot)
        urdf = retargeter.body_map.robot.urdf
        fast = FastRetargeter(retargeter.describe(), form)
        known(fast, urdf)
        found = cls.of_retargeter(fast, config, urdf)

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
        stands = description.legs is not None
        settings = StreamSettings(avoid_collisions=config.avoid_collisions)
        stream = FastStream(retargeter, config.rate, settings)
        home_N = np.clip(np.zeros(len(lower_N)), lower_N, upper_N)
        if config.home == "hanging":
            hanging_N = _standing(stream) if stands else retargeter.predict(hanging_pose(), 10)
            home_N = np.clip(hanging_N.astype(np.float64), lower_N, upper_N)
        stream.reset(np.clip(home_N.astype(np.float32), lower_N.astype(np.float32), upper_N.astype(np.float32)))

        def answer(pose: np.ndarray | None, time: float, root: StreamRoot | None = None) -> Answer:
            found = stream(pose, time, root)
            assert found.branch_confidence is not None
            return Answer(found.q.astype(np.float64), found.branch_confidence, stream.stance)

        names = description.settings.joint_names, description.settings.branch_names
        found = cls(retargeter.facts, *names, *_branches(description), home_N, answer, urdf)
        return replace(found, standing=description, legs_X=_legs(description)) if stands else found


def _standing(stream: FastStream) -> np.ndarray:
    """Joint angles (N,) [rad] of a robot that stands on the floor like a person whose arms hang."""
    return stream(hanging_pose(), root=(np.eye(3), np.zeros(3))).q


def hanging_pose() -> np.ndarray:
    """A pose (21, 3, 3) of a person who stands, arms hanging."""
    local_J33 = np.tile(np.eye(3, dtype=np.float32), (len(POSED_JOINT_NAMES), 1, 1))
    for side, sign in zip(SIDES, (-1.0, 1.0), strict=True):  # from sideways down, a little apart from the body
        angle = sign * np.radians(80.0)
        turn_33 = [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
        local_J33[POSED_JOINT_NAMES.index(f"{side}_shoulder")] = turn_33
    return local_J33


def _legs(description: Description) -> np.ndarray:
    """`legs_X`."""
    assert description.legs is not None
    of_legs_D = np.concatenate((description.legs.limb_R2, description.legs.foot_R2)).ravel()
    return np.asarray((description.trust.column_XD[:, of_legs_D] > 0).any(axis=1))


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
