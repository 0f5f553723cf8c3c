"""When feet are planted, frame by frame: `mrhubo.motion.contacts` for who cannot wait for the next frame.

The thresholds are the same. Speeds are differences to the last frame, a little smoothed. A contact counts more and more
after its beginning; before its end it counts the less the nearer the point is to what ends it. The floor is learned on
the way, unless it is given, by the same rule: the lowest height at which slow points have gathered in the last seconds.
Most worlds have it at 0, so where points begin near 0 that counts like some of them.

Legend: B people, P points of soles, H heights.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np

from mrhubo.fast.plain.human import smooth_share

PLANTED_M, PLANTED_SPEED = 0.04, 0.3
"""A point that is lower [m] and slower [m/s] is planted: soles of readers' skeletons lie up to 2 cm beside the
person's; and a heel that lands still turns at some 20 cm/s."""
LIFTED_M, LIFTED_SPEED = 0.07, 0.5
"""A point that is higher or faster is not. A swinging foot goes at 3 to 4 m/s, and through all these within 30 ms."""
WANDERED_M = 0.06
"""How far a planted point may be from where it was planted; then it is planted anew: a shuffling foot never lifts."""
RAMP_S = 0.1
"""How long [s] it takes until a contact counts in full, and before it ends, no more: a heel strike takes as long."""
STANDS, LIES = 0.5, 0.2
"""Cosine of the angle between a sole's up and the world's from which on a planted foot stands on its sole, and up to
which it lies on its side or its instep: of people who stand, walk and dance it is above 0.75."""
BAND_M = 0.04
"""Heights of points on one floor."""
GATHERED = 0.5
"""A band of heights with this share of the fullest one's slow points is the floor, if none is below: who stands on a
step stood on the floor too."""
SMOOTH_S = 0.02
"""Time constant [s] of speeds."""
HEIGHTS_M, STEP_M = 3.0, 0.005
"""Heights at which the floor is looked for, up and down from where it was first, and how finely; they go along with who
climbs or sinks out of them."""
USUAL_S, USUAL_M = 3.0, 0.15
"""A floor at 0 counts like a point that rests there for so long [s], where the lowest point begins that near to it."""
MEMORY_S = 10.0
"""Time constant [s] with which it is forgotten where slow points were."""


@dataclass(frozen=True)
class LiveContacts:
    """What is known of the contacts of some people after a frame."""

    place_BP3: np.ndarray
    """Where the points are [m], in a world whose y is up."""
    velocity_BP3: np.ndarray
    """[m/s], smoothed."""
    floor_B: np.ndarray
    """Height of the floor [m]; NaN: nobody has been seen."""
    planted_BP: np.ndarray
    """Whether each point is planted."""
    began_BP: np.ndarray
    """Whether its contact is new in this frame."""
    age_BP: np.ndarray
    """For how long [s]; infinite for those that were from the beginning."""
    start_BP3: np.ndarray
    """Where it was planted."""
    weight_BP: np.ndarray
    """How much it counts, 0..1."""
    slow_BH: np.ndarray
    """For how long [s] slow points were at each height,"""
    from_B: np.ndarray
    """and where these heights begin [m]."""

    @classmethod
    def none(cls, people: int, points: int) -> Self:
        """Nobody has been seen."""
        flags, numbers = np.zeros((people, points), dtype=bool), np.zeros((people, points))
        places = np.zeros((people, points, 3))
        return cls(places, places, np.full(people, np.nan), flags, flags, numbers, places, numbers,
                   np.zeros((people, round(2 * HEIGHTS_M / STEP_M))), np.zeros(people))  # fmt: skip

    def where(self, chosen_B: np.ndarray, other: Self) -> Self:
        """`other` for some people, this one for the rest."""
        return type(self)(**{f.name: _chosen(chosen_B, getattr(other, f.name), getattr(self, f.name))
                             for f in fields(self)})  # fmt: skip


def next_contacts(
    last: LiveContacts,
    place_BP3: np.ndarray,
    passed_B: np.ndarray,
    floor: float | None = None,
    given_BP: np.ndarray | None = None,
    root_B: np.ndarray | None = None,
) -> LiveContacts:
    """The contacts after one more frame.

    Args:
        last: those before; who has not been seen begins with the points planted that are low.
        place_BP3: where the points are now [m].
        passed_B: time since the last frame [s], more than 0.
        floor: height of the floor [m]; None: it is learned.
        given_BP: which points are planted, where that is known; else it is found.
        root_B: height of the root (B,) [m], as for `mrhubo.motion.contacts.find_contacts`.
    """
    new_B, passed_B1 = np.isnan(last.floor_B), passed_B[:, None]
    share_B11 = (passed_B / (passed_B + SMOOTH_S))[:, None, None]
    velocity_BP3 = (place_BP3 - last.place_BP3) / passed_B1[..., None]
    velocity_BP3 = last.velocity_BP3 + share_B11 * (velocity_BP3 - last.velocity_BP3)
    velocity_BP3 = _chosen(new_B, np.zeros_like(velocity_BP3), velocity_BP3)
    speed_BP, height_BP = np.linalg.norm(velocity_BP3, axis=-1), place_BP3[..., 1]
    from_B = np.where(new_B, height_BP.min(axis=1) - HEIGHTS_M, last.from_B)
    slow_BH = _chosen(new_B, _usual(height_BP, from_B, last.slow_BH.shape[1]), last.slow_BH)
    slow_BH, from_B = _moved_along(slow_BH, from_B, height_BP)
    under_BP = height_BP < (np.inf if root_B is None else root_B[:, None])
    slow_BP = (speed_BP < PLANTED_SPEED) & under_BP & ~new_B[:, None]  # how fast those are that are new is not known
    slow_BH = _gather(slow_BH, height_BP - from_B[:, None], slow_BP, passed_B)
    floor_B = from_B + _lowest_band(slow_BH) if floor is None else np.full(len(new_B), floor)
    nowhere_B = ~np.isfinite(floor_B)  # nothing has been slow
    floor_B = np.where(nowhere_B, np.fmin(height_BP.min(axis=1), last.floor_B), floor_B)
    above_BP = height_BP - floor_B[:, None]
    begins_BP = (above_BP < PLANTED_M) & (speed_BP < PLANTED_SPEED) & under_BP
    ends_BP = (above_BP > LIFTED_M) | (speed_BP > LIFTED_SPEED) | ~under_BP
    planted_BP = np.where(begins_BP, True, np.where(ends_BP, False, last.planted_BP))
    if given_BP is not None:
        planted_BP = given_BP
    wandered_BP = np.linalg.norm((place_BP3 - last.start_BP3)[..., [0, 2]], axis=-1) > WANDERED_M
    began_BP = planted_BP & (~last.planted_BP | wandered_BP)
    age_BP = np.where(began_BP, np.where(new_B[:, None], np.inf, passed_B1), last.age_BP + passed_B1)
    leaves_BP = np.minimum((LIFTED_SPEED - speed_BP) / (LIFTED_SPEED - PLANTED_SPEED),
                           (LIFTED_M - above_BP) / (LIFTED_M - PLANTED_M))  # fmt: skip
    leaves_BP = np.ones_like(leaves_BP) if given_BP is not None else leaves_BP
    weight_BP = planted_BP * smooth_share(age_BP / RAMP_S) * smooth_share(leaves_BP)
    start_BP3 = _chosen(began_BP, place_BP3, last.start_BP3)
    return LiveContacts(
        place_BP3, velocity_BP3, floor_B, planted_BP, began_BP, age_BP, start_BP3, weight_BP, slow_BH, from_B
    )


def standing_share(up_X: np.ndarray) -> np.ndarray:
    """How much feet stand on their soles, 0..1, of the cosines of `STANDS`."""
    return smooth_share((up_X - LIES) / (STANDS - LIES))


def _usual(height_BP: np.ndarray, from_B: np.ndarray, heights: int) -> np.ndarray:
    """What is known of slow points' heights before the first frame (B, H) [s]."""
    found_BH = np.zeros((len(height_BP), heights))
    near_X = np.flatnonzero(np.abs(height_BP.min(axis=1)) < USUAL_M)
    found_BH[near_X, (-from_B[near_X] / STEP_M).astype(int)] = USUAL_S
    return found_BH


def _moved_along(slow_BH: np.ndarray, from_B: np.ndarray, height_BP: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How long slow points were at each height, and where heights begin [m], so that the lowest point is among them."""
    heights = slow_BH.shape[1]
    at_B = np.floor((height_BP.min(axis=1) - from_B) / STEP_M)
    over_B = np.maximum(at_B - (heights - 1), 0.0) + np.minimum(at_B, 0.0)
    for person in np.flatnonzero(over_B):
        before_H = np.arange(heights) + over_B[person]
        kept_H = (before_H >= 0) & (before_H < heights)
        moved_H = np.zeros(heights)
        moved_H[kept_H] = slow_BH[person, before_H[kept_H].astype(int)]
        slow_BH[person] = moved_H
    return slow_BH, from_B + over_B * STEP_M


def _gather(slow_BH: np.ndarray, up_BP: np.ndarray, slow_BP: np.ndarray, passed_B: np.ndarray) -> np.ndarray:
    """For how long slow points were at each height, this frame's among them."""
    found_BH = slow_BH * np.exp(-passed_B / MEMORY_S)[:, None]
    row_X, point_X = np.nonzero(slow_BP & (up_BP >= 0) & (up_BP < 2 * HEIGHTS_M))
    np.add.at(found_BH, (row_X, (up_BP[row_X, point_X] / STEP_M).astype(int)), passed_B[row_X])
    return found_BH


def _lowest_band(slow_BH: np.ndarray) -> np.ndarray:
    """As `find_floor`: how high the floor is over the lowest of the heights [m]; NaN where nothing has been slow."""
    width = round(BAND_M / STEP_M)
    sums_BH = np.concatenate((np.zeros((len(slow_BH), 1)), slow_BH.cumsum(axis=1)), axis=1)
    band_BH = sums_BH[:, width:] - sums_BH[:, :-width]
    most_B1 = band_BH.max(axis=1, keepdims=True)
    first_B = (band_BH >= GATHERED * most_B1).argmax(axis=1)
    near_BX = first_B[:, None] + np.arange(width)
    rows_B = np.arange(len(slow_BH))
    last = band_BH.shape[1] - 1
    fullest_B = near_BX[rows_B, band_BH[rows_B[:, None], np.minimum(near_BX, last)].argmax(axis=1)]
    inside_BX = np.minimum(fullest_B[:, None] + np.arange(width), slow_BH.shape[1] - 1)
    weight_BX = slow_BH[rows_B[:, None], inside_BX]
    half_B1 = weight_BX.sum(axis=1, keepdims=True) / 2
    median_B = (weight_BX.cumsum(axis=1) >= half_B1).argmax(axis=1)
    return np.where(most_B1[:, 0] > 0, (inside_BX[rows_B, median_B] + 0.5) * STEP_M, np.nan)


def _chosen(chosen: np.ndarray, one: np.ndarray, other: np.ndarray) -> Any:
    """`one` where chosen, whose axes are the first ones, `other` elsewhere."""
    return np.where(chosen.reshape(*chosen.shape, *[1] * (one.ndim - chosen.ndim)), one, other)
