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


def smoothed(point_TK3: np.ndarray, rate: float) -> np.ndarray:
    """Points (T, K, 3) [m] through the filter, frame by frame, each from what came before it. A point that is NaN stays
    so, and the filter begins anew after it.

    Args:
        point_TK3: as an estimator gives them.
        rate: frames per second.
    """
    filtered_TK3 = np.array(point_TK3, dtype=np.float64)
    speed_K3 = np.zeros(filtered_TK3.shape[1:])
    speed_share = _share(rate, _SPEED)
    for now in range(1, len(filtered_TK3)):
        raw_K3, last_K3 = filtered_TK3[now].copy(), filtered_TK3[now - 1]
        known_K3 = np.isfinite(raw_K3) & np.isfinite(last_K3)
        # MediaPipe takes the speed from the filtered point, the paper from the raw one
        seen_K3 = np.where(known_K3, (raw_K3 - last_K3) * rate, 0.0)
        speed_K3 = np.where(known_K3, speed_K3 + speed_share * (seen_K3 - speed_K3), 0.0)
        share_K3 = _share(rate, _LOWEST + _RISE * np.abs(speed_K3))
        filtered_TK3[now] = np.where(known_K3, last_K3 + share_K3 * (raw_K3 - last_K3), raw_K3)
    return filtered_TK3


def _share(rate: float, cutoff: np.ndarray | float) -> np.ndarray:
    """How much of the way a low pass goes in a frame: the paper's alpha."""
    way = 2 * math.pi * np.asarray(cutoff) / rate
    return way / (way + 1)
