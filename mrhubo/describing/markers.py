"""What is drawn on a figure to show where a config puts its body parts: bones, joint centres, axes and directions.

Everything is in the world frame (x forward, y left, z up), metres, at the height of a human. Legend: E limbs.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mrhubo.view import Solids
from mrhubo.view.solids import Color

SIDE_COLORS: dict[str | None, Color] = {
    "left": (0.93, 0.49, 0.13),
    "right": (0.16, 0.44, 0.80),
    None: (0.16, 0.60, 0.32),
}
"""Of what belongs to the left, to the right, and to neither."""
AXIS_COLOR: Color = (0.55, 0.15, 0.62)
"""Of the robot's joint axes."""
BONE_RADIUS, CENTRE_RADIUS, AXIS_RADIUS = 0.013, 0.024, 0.006
_HEAD = 0.4
"""Share of an arrow that its tip takes."""


def bone(start_3: np.ndarray, end_3: np.ndarray, color: Color, size: float = 1.0) -> Solids:
    """A limb from one joint centre to the next, with balls at both."""
    rows = [(start_3, end_3, BONE_RADIUS * size, BONE_RADIUS * size)]
    rows += [(point_3, point_3, CENTRE_RADIUS * size, CENTRE_RADIUS * size) for point_3 in (start_3, end_3)]
    return Solids.capsules(rows, color)


def arrow(start_3: np.ndarray, direction_3: np.ndarray, length: float, color: Color, size: float = 1.0) -> Solids:
    """An arrow along a unit direction (3,)."""
    neck_3, tip_3 = start_3 + (1 - _HEAD) * length * direction_3, start_3 + length * direction_3
    thin, thick = 0.6 * BONE_RADIUS * size, 1.7 * BONE_RADIUS * size
    return Solids.capsules([(start_3, neck_3, thin, thin), (neck_3, tip_3, thick, 0.1 * thick)], color)


def axis_rods(axes: Iterable[tuple[np.ndarray, np.ndarray]], half_length: float, size: float = 1.0) -> Solids:
    """Thin rods along joint axes, (point (3,), unit direction (3,))."""
    rows = []
    for point_3, direction_3 in axes:
        reach_3 = half_length * direction_3
        rows.append((point_3 - reach_3, point_3 + reach_3, AXIS_RADIUS * size, AXIS_RADIUS * size))
    return Solids.capsules(rows, AXIS_COLOR)
