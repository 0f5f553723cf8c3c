"""In which unit a file tells where the root is, where that is no metre: programs whose unit is the centimetre write it.

Legend: T frames.
"""

from __future__ import annotations

import numpy as np

_UNITS = {"centimetres": 0.01, "millimetres": 0.001}
_TOO_FAST, _FASTEST = 25.0, 12.5
"""Speeds [m/s]: twice that of who runs fastest, and that."""
_TOO_HIGH_M, _PELVIS_M = 20.0, (0.5, 1.5)
"""Heights at which nobody stands, and those of the pelvis of who stands on a floor at 0."""
_FAR_M = 30.0
"""How far from a camera people are whose pose is estimated."""
_OFTEN = 0.95
"""Share of the steps that a speed is of: some may be jumps."""


def find_unit(place_T3: np.ndarray, frame_rate: float, beyond: float = 0.0) -> tuple[str, float] | None:
    """The unit of a root's places (T, 3), y up, and how long it is [m]; None: metres are as good as any.

    Told by the height of who stands, where the floor is at 0, or by a speed that nobody has.

    Args:
        place_T3: the places.
        frame_rate: frames per second.
        beyond: from which distance from the origin on a speed tells: estimated depths jump, so that who is near seems
            to be faster than anybody.
    """
    speed = 0.0
    if len(place_T3) > 1:
        step_T = np.linalg.norm(np.diff(place_T3, axis=0), axis=1)
        speed = float(np.quantile(step_T, _OFTEN)) * frame_rate
    height = float(np.median(place_T3[:, 1])) if len(place_T3) else 0.0
    slow = {name: metres for name, metres in _UNITS.items() if metres * speed < _FASTEST}
    for name, metres in slow.items():
        if height > _TOO_HIGH_M and _PELVIS_M[0] < metres * height < _PELVIS_M[1]:
            return name, metres
    away = float(np.median(np.linalg.norm(place_T3, axis=1))) if len(place_T3) else 0.0
    if speed <= _TOO_FAST or away < beyond:
        return None
    return next(((name, metres) for name, metres in slow.items() if not beyond or metres * away < _FAR_M), None)
