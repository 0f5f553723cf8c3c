"""Which way is up in a file's world, and turning it so that y is.

Worlds of files have y or z up; cameras look along z with y down. People stand and walk more than they lie, so the axis
that the body's own up axis follows on the mean is the world's.
"""

from __future__ import annotations

import numpy as np

_TO_Y_UP: dict[str, tuple[tuple[float, float, float], ...]] = {
    "y up": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "z up": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)),
    "y down": ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)),
}
"""What turns each world so that y is up: a turn about x, so that who looks along z in a camera's world, away from it,
looks along -z."""
WORLDS = ("y up", "z up")
"""Of files of motion capture; where both fit alike, the first is taken."""
Y_UP, Z_UP = ("y up",), ("z up",)
"""Of files whose writers say so, also of who lies, crawls or stands on the hands from the first frame to the last."""
CAMERAS = ("y down", "y up")
"""Of estimators: what a camera sees, and what some have turned upright."""
ANY_WORLD = ("y up", "y down", "z up")
"""Of files that do not say whose they are."""


def find_up(body_up_T3: np.ndarray, worlds: tuple[str, ...]) -> tuple[str, np.ndarray]:
    """Which of some worlds a body's own up axes (T, 3) are in, and the matrix (3, 3) that makes y its up axis."""
    up_3 = body_up_T3.mean(axis=0)
    turns = {world: np.array(_TO_Y_UP[world], up_3.dtype) for world in worlds}
    best = max(worlds, key=lambda world: float((turns[world] @ up_3)[1]))
    return best, turns[best]
