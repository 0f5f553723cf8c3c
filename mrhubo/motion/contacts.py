"""When a person's feet are planted on the floor, and where the floor is, of the places of points of the soles alone.

A point is planted from when it is low and slow until it is high or fast: two thresholds each, so that noise makes no
contact flicker. Speeds are central differences, so that a rate of 24 frames per second is enough. The floor is the
lowest height at which slow points gather; a file whose floor is elsewhere than at 0 is read alike.

Legend: T frames, P points of soles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.fast.masks import stretches
from mrhubo.fast.plain.contacts import (
    BAND_M,
    GATHERED,
    LIFTED_M,
    LIFTED_SPEED,
    PLANTED_M,
    PLANTED_SPEED,
    RAMP_S,
    WANDERED_M,
)
from mrhubo.fast.plain.human import smooth_share

_SCALE_ROUNDS, _SCALES = 4, (0.6, 1.6)
"""A child's legs, and a giant's, against those of readers' skeletons, and more."""
_STILL = 0.1
"""Speed [m/s] of a root that tells nothing of its scale."""
_TOLD = 0.05
"""To what the scale can be told: where a person's legs are known, it comes out 4% too small or large, as feet roll."""


@dataclass(frozen=True)
class FootContacts:
    """When points of soles are planted."""

    planted_TP: np.ndarray
    """Whether each point is."""
    phase_TP: np.ndarray
    """Which contact it is, a number from 0 on, all different; -1: none."""
    weight_TP: np.ndarray
    """How much it counts, 0..1: it grows after the beginning of a contact, and falls before its end."""
    floor: float
    """Height of the floor [m], in the motion's world."""


def find_contacts(
    place_TP3: np.ndarray,
    frame_rate: float,
    floor: float | None = None,
    given_TP: np.ndarray | None = None,
    root_T: np.ndarray | None = None,
) -> FootContacts:
    """The contacts of points of soles.

    Args:
        place_TP3: their places (T, P, 3) [m], in a world whose y is up.
        frame_rate: frames per second.
        floor: height of the floor [m]; None: it is looked for.
        given_TP: which points are planted (T, P), where that is known; None: it is found.
        root_T: height of the root (T,) [m], above which no sole stands: that of who stands on the hands or lies with
            raised legs tells nothing of the floor. None: all may.
    """
    speed_TP = speeds(place_TP3, frame_rate)
    if root_T is not None:
        speed_TP = np.where(place_TP3[..., 1] < root_T[:, None], speed_TP, np.inf)
    if floor is None and given_TP is not None and given_TP.any():
        floor = float(np.median(place_TP3[..., 1][given_TP]))
    floor = find_floor(place_TP3[..., 1], speed_TP) if floor is None else floor
    height_TP = place_TP3[..., 1] - floor
    planted_TP = given_TP
    if planted_TP is None:
        begins_TP = (height_TP < PLANTED_M) & (speed_TP < PLANTED_SPEED)
        planted_TP = _hold(begins_TP, (height_TP > LIFTED_M) | (speed_TP > LIFTED_SPEED))
    phase_TP, weight_TP = np.full(planted_TP.shape, -1), np.zeros(planted_TP.shape)
    count = 0
    for point, (first, last) in _runs(planted_TP):
        for start, end in _stays(place_TP3[:, point, [0, 2]], first, last):
            phase_TP[start:end, point] = count
            count += 1
            # A motion that begins or ends with a foot on the floor has no touch-down or lift-off there.
            since = np.arange(1, end - start + 1) / frame_rate + (np.inf if start == 0 else 0.0)
            until = np.arange(end - start, 0, -1) / frame_rate + (np.inf if end == len(planted_TP) else 0.0)
            weight_TP[start:end, point] = smooth_share(np.minimum(since, until) / RAMP_S)
    return FootContacts(planted_TP, phase_TP, weight_TP, floor)


def root_scale(from_root_TP3: np.ndarray, root_T3: np.ndarray, frame_rate: float) -> float:
    """By what a root's way has to be multiplied so that it belongs to the legs that points hang on: then planted points
    keep still. 1 where the way is right within what can be told, or tells nothing.

    Args:
        from_root_TP3: places (T, P, 3) [m] of points of soles from the root, along the world's axes.
        root_T3: the root's (T, 3) [m].
        frame_rate: frames per second.
    """
    if len(root_T3) < 2:
        return 1.0
    leg_TP3, way_T13 = (np.gradient(x, 1 / frame_rate, axis=0) for x in (from_root_TP3, root_T3[:, None]))
    scale = 1.0
    for _ in range(_SCALE_ROUNDS):
        place_TP3, height_T = from_root_TP3 + scale * root_T3[:, None], scale * root_T3[:, 1]
        weight_TP1 = find_contacts(place_TP3, frame_rate, root_T=height_T).weight_TP[..., None]
        still = _STILL**2 * weight_TP1.sum()
        whole = float((weight_TP1 * way_T13**2).sum() + still)
        scale = (float(still - (weight_TP1 * way_T13 * leg_TP3).sum()) / whole) if whole else 1.0
        scale = float(np.clip(scale, *_SCALES))
    return 1.0 + float(np.sign(scale - 1) * max(abs(scale - 1) - _TOLD, 0.0))


def speeds(place_TP3: np.ndarray, frame_rate: float) -> np.ndarray:
    """Speeds (T, P) [m/s] of places (T, P, 3) [m]; 0 where there is one frame alone."""
    if len(place_TP3) < 2:
        return np.zeros(place_TP3.shape[:-1])
    return np.linalg.norm(np.gradient(place_TP3, 1 / frame_rate, axis=0), axis=-1)


def find_floor(height_TP: np.ndarray, speed_TP: np.ndarray) -> float:
    """Height [m] of the floor, of the heights [m] and speeds [m/s] of points of soles."""
    slow = np.sort(height_TP[speed_TP < PLANTED_SPEED])
    if not len(slow):  # all are in flight, or slip: the lowest is near the floor
        return float(np.quantile(height_TP, 0.02))
    first = np.arange(len(slow))
    count = np.searchsorted(slow, slow + BAND_M, side="right") - first
    lowest = int(np.flatnonzero(count >= GATHERED * count.max())[0])
    fullest = lowest + int(count[lowest : np.searchsorted(slow, slow[lowest] + BAND_M, side="right")].argmax())
    return float(np.median(slow[fullest : fullest + count[fullest]]))


def _hold(begins_TP: np.ndarray, ends_TP: np.ndarray) -> np.ndarray:
    """Whether something has begun and not ended (T, P)."""
    frame_T1 = np.arange(len(begins_TP))[:, None]
    told_TP = np.maximum.accumulate(np.where(begins_TP | ends_TP, frame_T1, -1), axis=0)
    return (told_TP >= 0) & np.take_along_axis(begins_TP, np.maximum(told_TP, 0), axis=0)


def _runs(planted_TP: np.ndarray) -> list[tuple[int, tuple[int, int]]]:
    """Each point and contact, first and after the last frame, in order."""
    found = []
    for point in range(planted_TP.shape[1]):
        found += [(point, (run.start, run.stop)) for run in stretches(planted_TP[:, point])]
    return found


def _stays(place_T2: np.ndarray, first: int, last: int) -> list[tuple[int, int]]:
    """A contact in parts in which the point stays near where it was planted."""
    found, start = [], first
    while start < last:
        gone = np.linalg.norm(place_T2[start:last] - place_T2[start], axis=-1) > WANDERED_M
        end = start + int(gone.argmax()) if gone.any() else last
        found.append((start, end))
        start = end
    return found
