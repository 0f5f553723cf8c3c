"""The One-Euro filter on points in space, as MediaPipe has it after its network for landmarks.

Casiez, Roussel, Vogel, "1 Euro Filter: A Simple Speed-based Low-pass Filter for Noisy Input in Interactive Systems",
CHI 2012; the numbers are those of world landmarks in `mediapipe/modules/pose_landmark/pose_landmark_filtering.pbtxt`
(https://github.com/google-ai-edge/mediapipe). Each coordinate has a speed, and so a time constant, of its own.

Legend: T frames, K points.
"""

from __future__ import annotations

import math

import numpy as np

_LOWEST = 0.1
"""Cut-off of what rests [Hz]."""
_RISE = 40.0
"""By how much the cut-off rises with speed [Hz / (m/s)]."""
_SPEED = 1.0
"""Cut-off of the speed [Hz]."""


class OneEuro:
    """The filter of points that come one after the other. A point that is NaN stays so, and begins anew after it."""

    def __init__(self) -> None:
        self._last_K3: np.ndarray | None = None
        self._speed_K3: np.ndarray | float = 0.0

    def step(self, raw_K3: np.ndarray, rate: float) -> np.ndarray:
        """The points (K, 3) [m] that come next, filtered.

        Args:
            raw_K3: as an estimator gives them.
            rate: one over the time since the last ones [1/s].
        """
        raw_K3 = np.array(raw_K3, dtype=np.float64)
        last_K3, self._last_K3 = self._last_K3, raw_K3
        if last_K3 is None:
            return raw_K3
        known_K3 = np.isfinite(raw_K3) & np.isfinite(last_K3)
        # MediaPipe takes the speed from the filtered point, the paper from the raw one
        seen_K3 = np.where(known_K3, (raw_K3 - last_K3) * rate, 0.0)
        faster_K3 = self._speed_K3 + _share(rate, _SPEED) * (seen_K3 - self._speed_K3)
        self._speed_K3 = np.where(known_K3, faster_K3, 0.0)
        share_K3 = _share(rate, _LOWEST + _RISE * np.abs(self._speed_K3))
        self._last_K3 = np.where(known_K3, last_K3 + share_K3 * (raw_K3 - last_K3), raw_K3)
        return self._last_K3


def smoothed(point_TK3: np.ndarray, rate: float) -> np.ndarray:
    """Points (T, K, 3) [m] through the filter, frame by frame, each from what came before it.

    Args:
        point_TK3: as an estimator gives them.
        rate: frames per second.
    """
    one_euro = OneEuro()
    return np.array([one_euro.step(raw_K3, rate) for raw_K3 in point_TK3]).reshape(np.shape(point_TK3))


def _share(rate: float, cutoff: np.ndarray | float) -> np.ndarray:
    """How much of the way a low pass goes in a frame: the paper's alpha."""
    way = 2 * math.pi * np.asarray(cutoff) / rate
    return way / (way + 1)
