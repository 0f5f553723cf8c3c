"""Where a person with legs is, frame by frame, as a stream takes it; and what cannot be true is refused.

Who does not tell where the person is in the world (landmarks of a camera, whose 0 is between the hips) has the lowest
sole on the floor and the pelvis above one place: such a person bends, turns and steps, and goes nowhere. Who does not
tell either how the pelvis is turned (rotations of joints alone) moves no legs. Whose pelvis is told to hang at one
place, as of avatars that are kept where they are, bends and steps like the first: else the feet of one who squats
would rise.

World: y up; m.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrhubo.body.joints import POSED_JOINT_NAMES
from mrhubo.fast.leg_section import Legs
from mrhubo.fast.plain.ground import UP, Seen, person_points
from mrhubo.live.body import Root, SeenPose

FASTEST, FASTEST_TURN = 12.0, 30.0
"""Nobody goes [m/s] or turns [rad/s] faster: a root that does is a tracker's mistake, or another place of its world."""
LEEWAY_M, LEEWAY_RAD = 0.1, 0.3
"""By how much a root may be beside where it was, however soon it comes: trackers shake."""
AGAIN_S = 0.3
"""After so long [s] without a root that can be true the next one is taken: the world's place has changed."""
MOVED_M = 1e-3
"""A pelvis that has not gone as far hangs where it was first: trackers shake more."""
_LEGS = [place for place, name in enumerate(POSED_JOINT_NAMES) if name.split("_")[-1] in ("hip", "knee", "ankle")]


class Jumped(Exception):
    """A root that is too far from the one before."""


class Roots:
    """The roots of one person."""

    def __init__(self, legs: Legs) -> None:
        """`legs`: of the robot that follows."""
        self._legs = legs
        self._last: tuple[np.ndarray, np.ndarray] | None = None
        self._at, self._in_world = 0.0, False
        self._hangs: tuple[np.ndarray, float] | None = None
        """Where the pelvis was first, and how high its lowest sole was [m]; None: it has moved since."""

    def see(self, pose: SeenPose, now: float) -> tuple[SeenPose, tuple[np.ndarray, np.ndarray]]:
        """A pose, whose legs are not sure if the source tells nothing of the pelvis; and its rotation (3, 3) and place
        (3,) [m].

        Raises:
            Jumped: it is too far from the last one.
        """
        root = pose.root
        if root is None:
            pose, root = replace(pose, sure_J=_without_legs(pose.sure_J)), Root(np.eye(3), None)
        place_3, in_world = root.place_3, root.place_3 is not None
        passed = now - self._at
        if place_3 is None:
            place_3 = np.array([0.0, self._hip_height(pose, root), 0.0])
        else:
            if self._last is None or not self._in_world or passed >= AGAIN_S:
                self._hangs = place_3, place_3[UP] - self._hip_height(pose, root)
            place_3 = self._stepping(place_3, pose, root)
        if self._last is not None and in_world == self._in_world and passed < AGAIN_S:
            turn_33, last_3 = self._last
            angle = np.arccos(np.clip((np.sum(turn_33 * root.turn_33) - 1) / 2, -1.0, 1.0))
            far = np.linalg.norm(place_3 - last_3)
            if far > FASTEST * passed + LEEWAY_M or angle > FASTEST_TURN * passed + LEEWAY_RAD:
                raise Jumped
        self._last, self._at, self._in_world = (root.turn_33, place_3), now, in_world
        return pose, (root.turn_33, place_3)

    def _hip_height(self, pose: SeenPose, root: Root) -> float:
        """How high the pelvis is above the lowest sole [m]."""
        _, sole_H3 = person_points(self._legs, Seen(pose.local_J33, root.turn_33, np.zeros(3)))
        return -float(sole_H3[:, UP].min())

    def _stepping(self, place_3: np.ndarray, pose: SeenPose, root: Root) -> np.ndarray:
        """The place; of a pelvis that has not moved yet one at which the lowest sole is as high as it was first."""
        if self._hangs is None or np.linalg.norm(place_3 - self._hangs[0]) > MOVED_M:
            self._hangs = None
            return place_3
        found_3 = place_3.copy()
        found_3[UP] = self._hangs[1] + self._hip_height(pose, root)
        return found_3


def _without_legs(sure_J: np.ndarray) -> np.ndarray:
    found_J = sure_J.copy()
    found_J[_LEGS] = 0.0
    return found_J
