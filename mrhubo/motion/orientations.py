"""How trunk, head, hands and feet are turned, as far as points on them tell.

Two vectors between points fix a part's rotation: the first exactly, the second by the side to which it points. Both are
compared with those of our own skeleton at rest, so that points of our skeleton give its rotations back.

Legend: T frames. World: y up, right-handed; human frame at rest: x to the body's left, y up, z forward.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mrhubo.body.joints import JOINT_NAMES, KEYPOINT_NAMES, REST_K3, SIDES
from mrhubo.fast.plain.human import cross, norm, normalize

HEAD_POINTS = {
    "nose": (0.0, 0.035, 0.115),
    "left_ear": (0.072, 0.06, -0.005),
    "right_ear": (-0.072, 0.06, -0.005),
    "head_top": (0.0, 0.18, 0.01),
}
"""Points of the head that our skeleton has not, from the head's joint [m]: round numbers of an adult; the tip of the
nose lies a little lower than the ears' holes."""
SHORTEST = 1e-6
"""Vectors between points shorter than this [m] point nowhere."""
PARALLEL = 0.05
"""Sine of the angle between two vectors, under which they fix no rotation: 3 degrees."""

Place = tuple[str, ...]
"""The mean of the points of these names."""


@dataclass(frozen=True)
class Triad:
    """Two vectors between points of one part, each from a place to a place."""

    first: tuple[Place, Place]
    second: tuple[Place, Place]

    @property
    def names(self) -> set[str]:
        """The points that it needs."""
        return {name for vector in (self.first, self.second) for place in vector for name in place}


def _both(name: str) -> Place:
    return tuple(f"{side}_{name}" for side in SIDES)


def _line(name: str) -> tuple[Place, Place]:
    """From the right to the left."""
    left, right = _both(name)
    return (right,), (left,)


def _table() -> dict[str, tuple[Triad, ...]]:
    """The triads of each joint, the best first."""
    hips, shoulders, ears, eyes = (_both(name) for name in ("hip", "shoulder", "ear", "eye"))
    upright = (hips, shoulders)
    found = {
        "pelvis": (
            Triad(_line("hip"), (("pelvis",), ("spine2",))),
            Triad(_line("hip"), upright),
            Triad(_line("hip"), (hips, ("neck",))),
        ),
        "spine3": (
            Triad(_line("collar"), (("spine2",), _both("collar"))),
            Triad(_line("shoulder"), (("spine2",), shoulders)),
            Triad(_line("shoulder"), upright),
            Triad(_line("shoulder"), (("pelvis",), ("neck",))),
        ),
        "head": (
            Triad(_line("ear"), (ears, ("nose",))),
            Triad(_line("eye"), (eyes, ("nose",))),
            Triad((("nose",), ("head_top",)), (shoulders, ("head_top",))),
        ),
    }
    for side in SIDES:
        wrist, index, pinky, middle, thumb, ankle, knee, heel, toe, foot = (
            (f"{side}_{name}",)
            for name in ("wrist", "index", "pinky", "middle", "thumb", "ankle", "knee", "heel", "toe", "foot")
        )
        found[f"{side}_wrist"] = (
            Triad((wrist, index + pinky), (pinky, index)),
            Triad((wrist, middle), (wrist, thumb)),
            Triad((wrist, index), (wrist, thumb)),
        )
        found[f"{side}_ankle"] = (
            Triad((heel, toe), (heel, ankle)),
            Triad((ankle, toe), (ankle, knee)),
            Triad((ankle, foot), (ankle, knee)),
        )
    return found


TRIADS: dict[str, tuple[Triad, ...]] = _table()
"""By the joint that carries the part."""


def rest_points() -> dict[str, np.ndarray]:
    """Points (1, 3) [m] of our skeleton at rest, float64, and those of the head that it has not; the pelvis at 0."""
    rest = dict(zip(KEYPOINT_NAMES, REST_K3.astype(np.float64)[:, None], strict=True))
    return rest | {name: rest["head"] + np.array([place]) for name, place in HEAD_POINTS.items()}


def turn_of(joint: str, points: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """Rotations (T, 3, 3) in the world of the part that a joint carries, relative to our rest pose; NaN in frames where
    points are missing or lie on one line; None where no triad's points are there at all.

    Args:
        joint: a key of `TRIADS`.
        points: points (T, 3) [m] by name, NaN where they are not known.
    """
    for triad in TRIADS[joint]:
        if not triad.names <= points.keys():
            continue
        frame_T33 = _frame(triad, points)
        if np.isfinite(frame_T33).any():
            return frame_T33 @ _frame(triad, rest_points())[0].T
    return None


def known_frames(value_TX: np.ndarray) -> np.ndarray:
    """In which frames (T,) all numbers of a value (T, ...) are known, and not NaN."""
    return np.asarray(np.isfinite(value_TX).all(axis=tuple(range(1, value_TX.ndim))))


def frame_of(first_T3: np.ndarray, second_T3: np.ndarray) -> np.ndarray:
    """Columns (T, 3, 3): a unit vector along the first, the second's part across it, and their cross product; NaN where
    they are short or nearly parallel.
    """
    x_T3 = normalize(first_T3)
    across_T3 = second_T3 - x_T3 * (x_T3 * second_T3).sum(-1, keepdims=True)
    second_T = norm(second_T3)
    wrong_T = (norm(across_T3) < PARALLEL * second_T) | (norm(first_T3) < SHORTEST) | (second_T < SHORTEST)
    y_T3 = normalize(across_T3)
    frame_T33 = np.stack((x_T3, y_T3, cross(x_T3, y_T3)), axis=-1)
    return np.where(wrong_T[:, None, None], np.nan, frame_T33)


def _frame(triad: Triad, points: Mapping[str, np.ndarray]) -> np.ndarray:
    return frame_of(*(_place(end, points) - _place(start, points) for start, end in (triad.first, triad.second)))


def _place(place: Place, points: Mapping[str, np.ndarray]) -> np.ndarray:
    return np.stack([points[name] for name in place]).mean(axis=0)


assert TRIADS.keys() <= set(JOINT_NAMES)
