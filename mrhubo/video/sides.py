"""Left and right of a body in a video, which an estimator may exchange from one frame to the next.

Seen from the front and from behind bodies look alike, above all where a face cannot be seen. An estimator that is in
doubt tells now the one and now the other: hips and shoulders are turned round, and back after some frames. No body does
that.

Legend: T frames, S frames in which somebody is seen, K = 33 points.
"""

from __future__ import annotations

import numpy as np

EXCHANGED = np.array([0, 4, 5, 6, 1, 2, 3, 8, 7, 10, 9, *np.arange(11, 33).reshape(-1, 2)[:, ::-1].ravel()])
"""The point on the other side, of each: nose, eyes, ears, mouth, and pairs from the shoulders down."""
SHOULDERS, HIPS = (11, 12), (23, 24)
"""The left one, and the right one."""
_UPPER, _LOWER = slice(0, 23), slice(23, 33)
"""The points that go with shoulders, and with hips."""
_TURNED = 0.0
"""Cosine between the lines from shoulder to shoulder in two frames of who is turned round: by 90 degrees and more."""
_TWISTED = -0.2
"""Cosine between shoulders and hips of a trunk that is twisted by more than it can be: 102 degrees."""
_NEXT_S = 0.05
"""From frame to frame [s]: who turns by 90 degrees in that does five turns a second."""
_SHORT_S = 1.0
"""For how long sides are exchanged at most, and how far to either side it is looked how they are [s]."""


def exchanged_points(time_T: np.ndarray, point_TK3: np.ndarray, who_T: np.ndarray) -> np.ndarray:
    """Which points (T, K) are to be exchanged for those of the other side: of the upper body, where shoulders are
    turned round from one frame to the next, and back soon after, and are otherwise most of the time around; of the
    lower body, where hips look where those shoulders cannot.

    Args:
        time_T: of the frames [s].
        point_TK3: points in space; NaN where nobody is there.
        who_T: who it is (T,), -1 where nobody is there.
    """
    exchanged_TK, seen_S = np.zeros(point_TK3.shape[:2], bool), np.flatnonzero(who_T >= 0)
    if len(seen_S):
        shoulder_S3, hip_S3 = (_line(point_TK3[seen_S], *ends) for ends in (SHOULDERS, HIPS))
        apart_S = np.append(True, (np.diff(time_T[seen_S]) > _NEXT_S) | (np.diff(who_T[seen_S]) != 0))
        turned_S = np.append(False, (shoulder_S3[1:] * shoulder_S3[:-1]).sum(-1) < _TURNED) & ~apart_S
        wrong_S = _minority(time_T[seen_S], turned_S, apart_S)
        shoulder_S3[wrong_S] *= -1
        exchanged_TK[seen_S, _UPPER] = wrong_S[:, None]
        exchanged_TK[seen_S, _LOWER] = ((shoulder_S3 * hip_S3).sum(-1) < _TWISTED)[:, None]
    return exchanged_TK


def _line(point_SK3: np.ndarray, left: int, right: int) -> np.ndarray:
    """The unit vector (S, 3) from a right point to the left one; 0 where they are one."""
    line_S3 = point_SK3[:, left] - point_SK3[:, right]
    return line_S3 / np.maximum(np.linalg.norm(line_S3, axis=-1, keepdims=True), 1e-9)


def _minority(time_S: np.ndarray, turned_S: np.ndarray, apart_S: np.ndarray) -> np.ndarray:
    """Which frames (S,) are in short stretches between two turns, and otherwise than most frames around.

    Args:
        time_S: of the frames [s].
        turned_S: whether the body is turned round against the frame before.
        apart_S: whether the frame before has nothing to do with it.
    """
    found_S = np.zeros(len(time_S), bool)
    way_S, piece_S = np.where(np.cumsum(turned_S) % 2 == 1, 1.0, -1.0), np.cumsum(apart_S)
    starts = np.flatnonzero(turned_S | apart_S)
    for start, end in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True):
        first, last = float(time_S[start]), float(time_S[end])
        if apart_S[start] or apart_S[end] or last - first > _SHORT_S:
            continue
        low, high = np.searchsorted(time_S, ((first + last) / 2 - _SHORT_S, (first + last) / 2 + _SHORT_S))
        around_S = way_S[low:high][piece_S[low:high] == piece_S[start]]
        found_S[start:end] = around_S.sum() * way_S[start] < 0
    return found_S
