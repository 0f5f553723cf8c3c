"""What is told of a robot motion that was written: length, nearness to the person, trust, self-collision.

Legend: T frames, D directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from mrhubo.robot_motion import RobotMotion
from mrhubo.runtime.tables import aligned


@dataclass(frozen=True)
class Summary:
    """Figures of one motion; NaN: not known."""

    name: str
    frames: int
    frame_rate: float
    limb_deg: float
    """Mean angle [deg] between the robot's and the person's limbs."""
    confidence: float
    """Mean over frames."""
    collision: float
    """Share of frames in which the robot touches itself; NaN: shapes of what moves are missing."""

    @classmethod
    def of(cls, motion: RobotMotion, limbs: Sequence[str]) -> Summary:
        """The figures of a motion whose directions of these names are limbs."""
        columns = [motion.direction_names.index(name) for name in limbs if name in motion.direction_names]
        error_TD = motion.direction_error_deg
        return cls(
            motion.name,
            motion.frames,
            nan if motion.frame_rate is None else motion.frame_rate,
            _mean(error_TD[:, columns]) if error_TD is not None and columns else nan,
            _mean(motion.confidence),
            _mean(motion.collision),
        )


def _mean(values: np.ndarray | None) -> float:
    return nan if values is None or not values.size else float(values.mean(dtype=np.float64))


_HEADS = {
    "frames": ("frames", "{:,}"),
    "frame_rate": ("per second", "{:g}"),
    "limb_deg": ("limbs off [deg]", "{:.1f}"),
    "confidence": ("confidence", "{:.2f}"),
    "collision": ("touches itself", "{:.1%}"),
}
_UNKNOWN = "whether it touches itself is unknown: collision shapes of links that move are missing"


def table(summaries: Sequence[Summary], is_told: bool = False) -> str:
    """A row a motion; what is known of none has no column, and self-collision a sentence, unless it is told already
    which shapes are missing.
    """
    unknown = [] if is_told or any(row.collision == row.collision for row in summaries) else [_UNKNOWN]
    return "\n".join([*aligned("motion", summaries, _HEADS), *unknown])
