"""Nymeria's `xdata.npz`: how Xsens' 23 segments are turned, and where each begins.

`segment_qWXYZ` (T, 92), quaternions, and `segment_tXYZ` (T, 69) [m], a row a frame; `framerate`
(https://github.com/facebookresearch/nymeria_dataset, nymeria/body_motion_provider.py). World: z up.

Legend: T frames, S = 23 segments.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mrhubo.files.tree import Tree
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.assemble import MAX_FRAMES
from mrhubo.motion.readers.xsens import SEGMENTS, segments_motion

_TURNS, _PLACES = "segment_qWXYZ", "segment_tXYZ"


def read_nymeria(tree: Tree, find_rate: Callable[[list[str]], float]) -> Motion | None:
    """Reads such a file; None of anything else.

    Raises:
        UserError: the numbers are no motion, or the frame rate is not known.
    """
    turn, place = tree.get(_TURNS), tree.get(_PLACES)
    shape = None if place is None else place.shape()
    count = len(SEGMENTS)
    if turn is None or place is None or shape is None or shape not in ((shape[0], 3 * count), (shape[0], count, 3)):
        return None
    frames = shape[0]
    if turn.shape() not in ((frames, 4 * count), (frames, count, 4)) or not 0 < frames <= MAX_FRAMES:
        return None
    place_TS3 = place.array().astype(np.float64).reshape(frames, count, 3)
    turn_TS4 = turn.array().astype(np.float64).reshape(frames, count, 4)
    notes: list[str] = []
    rate = find_rate(notes)
    source = f"Nymeria's segments of Xsens, '{_TURNS}', z up"
    return segments_motion(tree.path, turn_TS4, place_TS3, rate, source, tuple(notes), f"'{_PLACES}'")
