"""Who is who in a video through which one body at a time was followed.

An estimator that has lost somebody goes on with whoever is there: behind somebody who walks past, after a cut, or where
another comes into the picture. Nobody gets far in no time; who seems to is somebody else.

Legend: T frames, K points.
"""

from __future__ import annotations

import numpy as np

_JUMP_M, _SPEED = 0.5, 6.0
"""So far [m], and so much farther a second [m/s], a trunk may get across the picture from one frame in which it is seen
to the next. Of people who walk, hop and jump, trunks do 0.15 m from frame to frame, errors and all; who is followed by
mistake, 2 m and more."""
_REMEMBERED = 20
"""People who may come back at most."""


def tell_apart(time_T: np.ndarray, point_TK3: np.ndarray, pixel_TK2: np.ndarray, trunk: list[int]) -> np.ndarray:
    """Who is seen in each frame (T,): people counted as they come, -1 for nobody.

    Who is away and comes back is the same person, if they can have got there; of several, who was seen last.

    Args:
        time_T: of the frames [s].
        point_TK3: points in space [m], x to the right of the picture and y up; NaN where nobody is there.
        pixel_TK2: the same points in the picture.
        trunk: which points are shoulders and hips.
    """
    who_T = np.full(len(time_T), -1)
    people, last = 0, dict[int, int]()  # the frame in which each was seen, who was seen last at the end
    size_T, place_T2 = _pixels_per_metre(point_TK3[..., :2], pixel_TK2), pixel_TK2[:, trunk].mean(1)
    for frame in np.flatnonzero(np.isfinite(place_T2).all(1)).tolist():
        there = (who for who, before in reversed(last.items()) if _near(time_T, size_T, place_T2, before, frame))
        who = next(there, people)
        people = max(people, who + 1)
        last = {other: before for other, before in list(last.items())[-_REMEMBERED:] if other != who} | {who: frame}
        who_T[frame] = who
    return who_T


def _near(time_T: np.ndarray, size_T: np.ndarray, place_T2: np.ndarray, before: int, frame: int) -> bool:
    """Whether who was in one frame can be in another."""
    metres = float(np.linalg.norm(place_T2[frame] - place_T2[before])) / float(np.sqrt(size_T[before] * size_T[frame]))
    return not metres > _JUMP_M + _SPEED * float(time_T[frame] - time_T[before])


def _pixels_per_metre(point_TK2: np.ndarray, pixel_TK2: np.ndarray) -> np.ndarray:
    """How large a body is in the picture (T,), however it is turned: the spread of its points there, over that across
    the line of sight; NaN where either is none.
    """
    spread_TX = np.stack(
        [np.nan_to_num(x - x.mean(1, keepdims=True)).std((1, 2)) for x in (pixel_TK2, point_TK2)], axis=1
    )
    spread_TX = np.where(spread_TX > 0, spread_TX, np.nan)
    return spread_TX[:, 0] / spread_TX[:, 1]
