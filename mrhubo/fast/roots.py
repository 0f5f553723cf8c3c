"""Where a person with a root is, and which points of the soles are planted, as a user gives them to a stream; and what
no person's way does.

Who tracks a person loses sight of them, and finds them elsewhere in the next frame: the root jumps. A robot's base that
did the same would be torn away from its feet. So the way goes on after a jump from where it was before.

Legend: B people, T frames, H points of soles.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from mrhubo.errors import UserError
from mrhubo.fast.poses import to_array
from mrhubo.fast.rotations import are_crooked

FAR_M = 1e5
"""No motion goes so far [m]; in float32, places out there are centimetres apart."""

JUMP_M, JUMP_SPEED = 0.5, 15.0
"""A root that goes farther [m] and faster [m/s] from one frame to the next has jumped: nobody runs faster than 12.4."""
_UP = 1


class Root(NamedTuple):
    """A person's root and contacts."""

    turn_33: np.ndarray
    """Rotation in a world whose y is up, float64."""
    place_3: np.ndarray
    """[m]"""
    given_H: np.ndarray | None
    """Which points are planted; None: it is not told."""


def read_root(root: Any, contacts: Any, points: Sequence[str]) -> Root | None:
    """A root; None where it holds NaN, infinite numbers or a place out of this world, so that nobody is seen.

    Args:
        root: rotation (3, 3) and place (3,) [m].
        contacts: whether each point is planted (H,); None: it is not told.
        points: names of the H points.

    Raises:
        UserError: one of them has another shape or holds no numbers, or the matrix is no rotation.
    """
    try:
        turn, place = (to_array(part) for part in root)
    except (TypeError, ValueError, UserError) as error:
        raise UserError(f"stream: a root is a rotation (3, 3) and a place (3,) [m]: {error}") from error
    if turn.dtype.kind not in "fiu" or place.dtype.kind not in "fiu" or turn.shape != (3, 3) or place.shape != (3,):
        raise UserError(
            f"stream: a root is a rotation (3, 3) and a place (3,) [m]; found {turn.dtype} of shape {turn.shape} and "
            f"{place.dtype} of shape {place.shape}"
        )
    given_H = None
    if contacts is not None:
        given_H = to_array(contacts)
        if given_H.dtype.kind not in "biu" or given_H.shape != (len(points),):
            raise UserError(f"stream: expected contacts of {len(points)} points: {', '.join(points)}")
        given_H = given_H.astype(bool)
    turn_33, place_3 = turn.astype(np.float64), place.astype(np.float64)
    if not (np.isfinite(turn_33).all() and (np.abs(place_3) < FAR_M).all()):
        return None
    if are_crooked(turn_33):
        raise UserError("stream: the root's matrix is no rotation")
    return Root(turn_33, place_3, given_H)


class Ways:
    """The ways of some people, frame after frame, without jumps."""

    def __init__(self, people: int, keep_height: bool) -> None:
        """Nobody has been seen. `keep_height`: a jump's height stays, as the floor's is told."""
        self._last_B3, self._away_B3 = np.zeros((people, 3)), np.zeros((people, 3))
        self._keep_height = keep_height

    def follow(self, place_B3: np.ndarray, seen_B: np.ndarray, since_B: np.ndarray) -> np.ndarray:
        """Places (B, 3) [m], float64, of the people who are seen (B,), and were last some time (B,) [s] ago; infinite:
        never.
        """
        jump_B3 = _jumps(place_B3 - self._last_B3, since_B, self._keep_height)
        self._away_B3 = np.where(seen_B[:, None], self._away_B3 + jump_B3, self._away_B3)
        self._last_B3 = np.where(seen_B[:, None], place_B3, self._last_B3)
        return place_B3 - self._away_B3


def without_jumps(place_T3: np.ndarray, frame_rate: float, keep_height: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """A way (T, 3) [m] as `Ways` has it, float64, and how far it jumps from the frame before to each (T, 3) [m]."""
    step_T3 = np.diff(place_T3.astype(np.float64), axis=0, prepend=place_T3[:1])
    jump_T3 = _jumps(step_T3, 1 / frame_rate, keep_height)
    return place_T3 - jump_T3.cumsum(axis=0), jump_T3


def _jumps(step_X3: np.ndarray, passed_X: Any, keep_height: bool) -> np.ndarray:
    """What of steps (X, 3) [m] in some time [s] is a jump."""
    far_X = np.sqrt((step_X3 * step_X3).sum(axis=1)) > np.maximum(JUMP_M, JUMP_SPEED * passed_X)
    jump_X3 = np.where(far_X[:, None], step_X3, 0.0)
    if keep_height:
        jump_X3[:, _UP] = 0.0
    return jump_X3
