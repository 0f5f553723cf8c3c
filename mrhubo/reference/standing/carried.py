"""A root that planted feet carry, and how far it is lifted out of the floor.

World: the human's, x left, y up, z forward; m. The floor is at y = 0.

Legend: T frames, P points of soles, K contacts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

LIFTED_M, LIFT_S = 0.002, 0.1
"""From how far [m] under the floor on something is lifted out of it; and the time [s] around in which it is lifted too.
"""
_UP = 1


@dataclass(frozen=True)
class Carried:
    """The root of a motion."""

    root_T3: np.ndarray
    place_K2: np.ndarray
    """Places of the contacts on the floor."""
    point_TP3: np.ndarray
    """Points of soles."""
    low_TP: np.ndarray
    """Height of the lowest ball at each of them."""
    body_T: np.ndarray
    """Height of the lowest of what else is near the floor and cannot give way (`low_body`); infinite: nothing is."""

    @property
    def lift_T(self) -> np.ndarray:
        """How far (T,) the root is to be lifted [m] so that nothing of that is under the floor."""
        return np.maximum(-np.minimum(self.low_TP.min(axis=1), self.body_T), 0.0)

    def shifted(self, shift_T3: np.ndarray) -> Carried:
        """The same with a root that is elsewhere, by so much [m], and soles with it."""
        up_T = shift_T3[:, _UP]
        point_TP3, low_TP = self.point_TP3 + shift_T3[:, None], self.low_TP + up_T[:, None]
        return Carried(self.root_T3 + shift_T3, self.place_K2, point_TP3, low_TP, self.body_T + up_T)

    def lifted(self, frame_rate: float) -> Carried:
        """A root that is lifted so, smoothly and by no less."""
        return self.shifted(smooth_lift(self.lift_T, frame_rate)[:, None] * np.eye(3)[_UP])


def smooth_lift(lift_TX: np.ndarray, frame_rate: float) -> np.ndarray:
    """Lifts (T, ...) [m] that are smooth over time, and nowhere less."""
    width = 2 * round(LIFT_S * frame_rate) + 1
    most_TX = maximum_filter1d(lift_TX, width, axis=0, mode="nearest")
    return uniform_filter1d(most_TX, width, axis=0, mode="nearest")
