"""What is sent to a robot at every moment, and its JSON (docs/live.md specifies it).

Legend: N joints.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mrhubo.live.messages import VERSION

STATES = {
    "stopped": "nobody holds the button, or the stream has broken off: the robot brakes, and stands",
    "waiting": "the button is held, and nobody has been seen",
    "following": "the robot follows the person",
    "doubtful": "some of its parts are hardly seen, or nobody is",
    "ended": "the session ends: the last angles",
}
"""By name, what a session is doing."""


@dataclass(frozen=True)
class BasePose:
    """Where a robot's base is, in a world with x forward, y left, z up, whose floor is at z = 0."""

    position_3: np.ndarray
    """[m]"""
    quaternion_wxyz_4: np.ndarray

    def told(self) -> dict[str, list[float]]:
        """As messages have it."""
        return {"position": _rounded(self.position_3), "quaternion_wxyz": _rounded(self.quaternion_wxyz_4)}


@dataclass(frozen=True)
class Standing:
    """How a robot with legs stands."""

    base: BasePose
    stop: BasePose
    """Where the base comes to rest if the robot brakes from now on."""
    contact: Mapping[str, bool]
    """Whether each foot is planted, by its name."""


@dataclass(frozen=True)
class Output:
    """The joint angles of one moment."""

    number: int
    """Greater by 1 each time."""
    time: float
    """On our clock [s]."""
    state: str
    """A key of `STATES`."""
    joint_names: tuple[str, ...]
    q_N: np.ndarray
    """Joint angles (N,) [rad], float64."""
    velocity_N: np.ndarray
    """How fast the joints turn (N,) [rad/s]."""
    stop_N: np.ndarray
    """Where they stand (N,) [rad] if they brake from now on: where a robot is to go that hears no more of us."""
    stop_in: float
    """How long that takes [s]."""
    confidence: Mapping[str, float]
    """Of the robot's parts, 0..1: the lesser of the source's and the retargeter's."""
    session: str = ""
    """Another one each time that a session starts."""
    counts: Mapping[str, int] = field(default_factory=dict)
    """Messages that came until now, by kind."""
    standing: Standing | None = None
    """None: the robot's base is fixed."""

    def message(self, with_counts: bool = False) -> str:
        """The JSON message."""
        told: dict[str, Any] = {
            "mrhubo": VERSION,
            "kind": "joints",
            "session": self.session,
            "number": self.number,
            "time": round(self.time, 6),
            "state": self.state,
            "names": self.joint_names,
            "angles": _rounded(self.q_N),
            "velocities": _rounded(self.velocity_N),
            "stop": {"angles": _rounded(self.stop_N), "in": round(self.stop_in, 6)},
            "confidence": {name: round(value, 4) for name, value in self.confidence.items()},
        }
        if self.standing is not None:
            told["base"], told["contact"] = self.standing.base.told(), dict(self.standing.contact)
            told["stop"]["base"] = self.standing.stop.told()
        if with_counts:
            told["counts"] = dict(self.counts)
        return json.dumps(told, separators=(",", ":"))


def _rounded(value_N: np.ndarray) -> list[float]:
    return [round(value, 9) for value in value_N.tolist()]
