from __future__ import annotations

import numpy as np
import pytest

_HALF = {  # human frame, m, T-pose: x to the left, y up, z forward
    "hip": (0.09, -0.10, 0.04),
    "knee": (0.09, -0.51, 0.04),
    "ankle": (0.09, -0.95, 0.04),
    "foot": (0.09, -0.99, 0.16),
    "toe": (0.09, -1.00, 0.23),
    "heel": (0.09, -1.01, -0.01),
    "collar": (0.03, 0.32, 0.0),
    "shoulder": (0.19, 0.42, -0.02),
    "elbow": (0.49, 0.42, -0.02),
    "wrist": (0.75, 0.42, -0.02),
    "thumb": (0.795, 0.405, 0.025),
    "index": (0.842, 0.417, 0.004),
    "middle": (0.845, 0.42, -0.02),
    "pinky": (0.83, 0.414, -0.062),
    "eye": (0.032, 0.565, 0.085),
}
_MIDDLE = {
    "pelvis": (0.0, 0.0, 0.0),
    "spine1": (0.0, 0.06, 0.0),
    "spine2": (0.0, 0.12, -0.01),
    "spine3": (0.0, 0.235, -0.01),
    "neck": (0.0, 0.35, -0.005),
    "head": (0.0, 0.50, -0.005),
}


@pytest.fixture
def human() -> tuple[np.ndarray, list[str]]:
    """Positions (P, 3), m, human frame, and names of a T-posed human with all points that the figure can use."""
    points = dict(_MIDDLE)
    for name, (x, y, z) in _HALF.items():
        points[f"left_{name}"], points[f"right_{name}"] = (x, y, z), (-x, y, z)
    return np.array(list(points.values())), list(points)
