"""Turns of a pelvis that no pelvis makes, in a stream: they are the tracker's, and a robot's base would make them.

Markers change places for a frame, and estimators of pose doubt for a few: the pelvis then turns by 10 or 30 degrees and
back within a thirtieth of a second, while trunk and legs, which other markers tell, stay where they are. Whole motions
are smoothed over time (`mrhubo.motion.steady`); here the next frame is not known, and nothing waits for it. What a
waist can do is known: in 32 clips of walks, dances, karate and jumps (CMU) no pelvis turned faster than 8.2 rad/s while
the trunk stayed, but for two that were lost, at 12 and at 32.

Legend: B people, J = 21 posed joints.
"""

from __future__ import annotations

import numpy as np

from mrhubo.fast.rotations import angles_between

SPEED = 9.0
"""No pelvis turns faster [rad/s] under a trunk that stays."""
LEAST_RAD = 0.15
"""Noise may turn it by so much, however short a frame is."""
_STAYS = 1 / 3
"""The trunk stays if it turns by less than this share of the pelvis' turn."""
HANGING = [0, 1, 2]
"""Posed joints that hang on the pelvis: hips, and the trunk."""
_TRUNK = 2


class Pelvises:
    """Those of some people, frame after frame. One that is lost stays where it was, until it is found there again, or
    has been elsewhere for as long as it may take to get there.
    """

    def __init__(self, people: int) -> None:
        """Nobody has been seen."""
        self._turn_B33 = np.tile(np.eye(3), (people, 1, 1))
        """Rotations in the world, as they were last believed,"""
        self._trunk_B33 = self._turn_B33
        """the trunk's then,"""
        self._ago_B = np.full(people, np.inf)
        """and how long that was before the last frame [s]."""

    def follow(
        self, turn_B33: np.ndarray, local_BJ33: np.ndarray, seen_B: np.ndarray, since_B: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Rotations (B, 3, 3) of pelvises in the world, and local rotations (B, 21, 3, 3), of which the limbs of those
        who are lost are turned in the world as they were given; the arrays that were given, where nobody is.

        Args:
            turn_B33: as they are told.
            local_BJ33: the same.
            seen_B: who is seen (B,).
            since_B: how long ago each was seen last (B,) [s]; infinite: never.
        """
        trunk_B33 = turn_B33 @ local_BJ33[:, _TRUNK]
        ago_B = np.where(np.isinf(since_B), np.inf, self._ago_B + since_B)
        turned_B = angles_between(self._turn_B33, turn_B33)
        too_fast_B = turned_B > np.maximum(LEAST_RAD, SPEED * ago_B)
        lost_B = seen_B & too_fast_B & (angles_between(self._trunk_B33, trunk_B33) < _STAYS * turned_B)
        believed_B11 = (seen_B & ~lost_B)[:, None, None]
        self._ago_B = np.where(lost_B, ago_B, np.where(seen_B, 0.0, self._ago_B))
        self._trunk_B33 = np.where(believed_B11, trunk_B33, self._trunk_B33)
        self._turn_B33 = np.where(believed_B11, turn_B33, self._turn_B33)
        if not lost_B.any():
            return turn_B33, local_BJ33
        local_BJ33 = local_BJ33.copy()
        for person in np.flatnonzero(lost_B):
            back_33 = self._turn_B33[person].T @ turn_B33[person]
            local_BJ33[person, HANGING] = back_33 @ local_BJ33[person, HANGING]
        return np.where(lost_B[:, None, None], self._turn_B33, turn_B33), local_BJ33
