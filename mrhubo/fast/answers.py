"""What a form of the run-time path can do, and what it answers.

Legend: B frames, J = 21 posed joints, D directions, M measured ones, N joints, X branches.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.plain.ground import Base, Seen
from mrhubo.fast.together.avoiding import GivingWay
from mrhubo.fast.together.problem import Problem

NO_ROTATION = "a matrix that is no rotation"
CHUNK = 2_048
"""Frames that are worked on at a time."""


@dataclass(frozen=True)
class Answers:
    """What `mrhubo.robot_motion.RobotMotion` says of each frame (B)."""

    q_BN: np.ndarray
    error_BM: np.ndarray
    phi_B: np.ndarray
    collision_B: np.ndarray
    trust_BX: np.ndarray

    @classmethod
    def empty(cls, description: Description, frames: int) -> Answers:
        """Room for the answers to some frames."""
        trust = description.trust
        shapes = (len(description.cost.lower_N),), (len(trust.measured),), ()
        q_BN, error_BM, phi_B = (np.zeros((frames, *shape), np.float32) for shape in shapes)
        return cls(
            q_BN, error_BM, phi_B, np.zeros(frames, np.bool_), np.zeros((frames, len(trust.column_XD)), np.float32)
        )


class Ground(Protocol):
    """The floor under one robot, as `mrhubo.fast.plain.ground.PlainGround`."""

    @property
    def planted_R(self) -> np.ndarray:
        """Whether each foot is planted."""
        ...

    @property
    def weight_H(self) -> np.ndarray:
        """How much the contact of each point of a sole counts, 0..1."""
        ...

    def pass_by(self) -> None:
        """Nobody is seen in this frame."""
        ...

    def look(self, seen: Seen, aim_D3: np.ndarray, turn_33: np.ndarray, passed: float) -> tuple[np.ndarray, np.ndarray]:
        """What a frame asks for."""
        ...

    def stand(self, q_N: np.ndarray) -> Base:
        """Where the robot's base is."""
        ...


class Engine(Protocol):
    """A form of the run-time path. Poses are local rotations (B, 21, 3, 3), float32. `avoid`, `follow` and `minimise`
    also take targets with the places of soles after the directions (`mrhubo.fast.plain.soles`).
    """

    description: Description

    @property
    def kept_in(self) -> Collection[str]:
        """The folders in which what is compiled is kept; none, where nothing is."""
        ...

    def look(self, local_BJ33: np.ndarray, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Directions (B, D, 3) of poses, float64, and the networks' joint angles (B, N) [rad], float32.

        Raises:
            UserError: a frame holds no rotations; `shape` says by which axes it is named.
        """
        ...

    def wrong(self, local_BJ33: np.ndarray) -> tuple[int, str] | None:
        """The first frame that holds no rotations, and what it holds; None: all are good."""
        ...

    def directions(self, local_BJ33: np.ndarray) -> np.ndarray:
        """Directions (B, D, 3) of poses, float64."""
        ...

    def network(self, local_BJ33: np.ndarray, target_BD3: np.ndarray) -> np.ndarray:
        """Joint angles (B, N) [rad] of the networks, float32."""
        ...

    def polish(self, q_BN: np.ndarray, target_BD3: np.ndarray, polish: int, avoid: bool) -> np.ndarray:
        """Joint angles (B, N) [rad] after steps of optimisation, float32; `avoid`: if there are any, then after steps
        away from self-collision.
        """
        ...

    def avoid(self, q_BN: np.ndarray, target_BD3: np.ndarray, staying: bool = False) -> np.ndarray:
        """Joint angles (B, N) [rad] after steps away from self-collision, float64; as near to the human's directions
        as can be, or, if `staying`, to their own.
        """
        ...

    def follow(
        self, q_BN: np.ndarray, target_BD3: np.ndarray, pull_B: np.ndarray, lower_BN: np.ndarray, upper_BN: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """As `mrhubo.fast.plain.steps.follow`: joint angles (B, N) [rad] and costs of blocks (B, C), float64."""
        ...

    def minimise(self, q_BN: np.ndarray, target_BX3: np.ndarray, steps: int) -> np.ndarray:
        """Joint angles (B, N) [rad] after as many steps at most, float64."""
        ...

    def ground(self, longest_step: float, floor: float | None) -> Ground:
        """A floor under the robot, on which nobody has been seen; arguments as of `PlainGround`."""
        ...

    @property
    def problem(self) -> Problem:
        """What frames cost, for whole motions."""
        ...

    @property
    def giving_way(self) -> GivingWay:
        """What makes frames of whole motions give way that touch."""
        ...

    def answer(
        self, q_BN: np.ndarray, target_BD3: np.ndarray, polish: int, avoid: bool, shake_BX: np.ndarray | None
    ) -> Answers:
        """After steps as `polish` makes them, with all that is told of them; shaking of branches in degrees, where
        known.
        """
        ...
