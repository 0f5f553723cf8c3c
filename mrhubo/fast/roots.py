"""Where a person with a root is, and which points of the soles are planted, as a user gives them to a stream.

Legend: H points of soles.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from mrhubo.errors import UserError
from mrhubo.fast.poses import to_array

CROOKED = 1e-2
"""How far a rotation's numbers may be from those of one: files round them."""
FAR_M = 1e5
"""No motion goes so far [m]; in float32, places out there are centimetres apart."""


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
    if np.abs(turn_33.T @ turn_33 - np.eye(3)).max() > CROOKED:
        raise UserError("stream: the root's matrix is no rotation")
    return Root(turn_33, place_3, given_H)
