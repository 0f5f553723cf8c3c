"""What a motion may be: how far its joints turn.

Legend: T frames, J joints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

MAX_TURN = 6 * math.pi
"""No joint of a body turns three times [rad]; numbers in degrees say so."""
_BEYOND_HALF, _BEYOND_FULL = 3.5, 6.6
"""Turns [rad] beyond half a turn and beyond a whole one. Half of one tells all rotations; sources that follow a joint
from frame to frame give more now and then, of some joint."""
_SHARE_BEYOND_HALF, _SHARE_BEYOND_FULL = 0.15, 0.03
"""Of all joints and frames. In degrees, CMU's clips exceed one of them even where they are scaled down until no joint
turns more than 10; in radians none of their joints turns more than half a turn."""


@dataclass
class Turns:
    """How far the joints of a motion turn, counted block by block: tells degrees from radians."""

    joints: int = 0
    beyond_half: int = 0
    beyond_full: int = 0
    largest: float = 0.0

    def add(self, turn_TJ: np.ndarray) -> None:
        """Counts some frames' angles (T, J) [rad]."""
        if turn_TJ.size:
            self.joints += turn_TJ.size
            self.beyond_half += int((turn_TJ > _BEYOND_HALF).sum())
            self.beyond_full += int((turn_TJ > _BEYOND_FULL).sum())
            self.largest = max(self.largest, float(turn_TJ.max()))

    @property
    def are_degrees(self) -> bool:
        """Whether so many joints turn so far as do in no motion of a person."""
        half, full = _SHARE_BEYOND_HALF * self.joints, _SHARE_BEYOND_FULL * self.joints
        return self.beyond_half > half or self.beyond_full > full

    @property
    def described(self) -> str:
        """In words, for a sentence."""
        share = 100 * self.beyond_half / self.joints
        return f"{share:.0f}% of the joints would turn by more than half a turn, up to {self.largest:.3g} rad"
