"""Where the base of a robot with legs is while its joints are as they are sent, and not as the stream has them.

The stream tells how the robot would stand: contacts, base and joint angles (`mrhubo.fast.plain.ground.Stance`). Limits
of speed and acceleration, a ramp or a stop make the joint angles that are sent others. So the base is found anew, how
it is turned and where it is, from those that are sent:

- Soles that are planted carry it, by forward kinematics. Their points stay where they were planted, the mean of them
  without any error, and a foot that stands flat keeps its turn in the world, so that the base turns and tilts as the
  leg above it does.
- As far as nothing is planted, the base moves by as much as the stream's does from frame to frame.
- Nothing of the robot is under the floor, neither soles nor hands, knees, trunk or head.

What the stream's base does while the robot is not following is never made up for: the path goes on from where the robot
is, in the direction in which it looks. So the robot's world begins where the robot stands at the start.

World: x forward, y left, z up; m. The floor is at z = 0.

Legend: N joints, H points of soles, R feet.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.plain.ground import WORLD, Base, Stance
from mrhubo.live.leg_kinematics import LegKinematics, Soles
from mrhubo.live.turns import rotation_of, turn_of, turns_of

FLAT, UP = [0, 1], 2
"""The horizontal axes of the world, and the upright one."""
STANDS_M, LIFTED_M = 0.02, 0.06
"""A sole's point lower than this [m] stands on the floor, one higher does not: in between it counts in part."""
BEARS_M = 0.005
"""A sole's point lower than this [m] bears a robot that stands otherwise than the person, one higher than `STANDS_M`
does not."""
RISE_S = 0.1
"""Time [s] in which a contact that begins comes to count in full, at the soonest."""
LEVEL_SPEED = 1.0
"""How fast the base and planted feet are turned [rad/s] to what the stream has, where they are not so turned."""
SINK_SPEED, GRAVITY = 0.5, 9.81
"""How fast a robot that was stopped in the air comes down to the floor at most [m/s], and how soon it is so fast
[m/s^2]."""
FASTEST, FASTEST_TURN = 12.0, 20.0
"""No base goes [m/s] or turns [rad/s] faster: what does is another place of the tracker's world."""
PLANTED = 0.5
"""A foot is told to be planted if a contact of its counts more than this."""


class _Place(NamedTuple):
    """A base, and what stands on the floor with it."""

    turn_33: np.ndarray
    place_3: np.ndarray
    point_H3: np.ndarray
    """Points of soles from the base's place, along the world's axes [m]."""
    low_H: np.ndarray
    """How high the lowest ball at each point is over the base [m],"""
    low: float
    """and the lowest of the whole robot."""


class FloatingBase:
    """The base of one robot."""

    def __init__(self, description: Description, q_N: np.ndarray, period: float, brake_time: float) -> None:
        """A robot that stands upright on the floor, above the world's origin, and looks along x.

        Args:
            description: of a robot with feet.
            q_N: its joint angles (N,) [rad].
            period: time between two steps [s].
            brake_time: time in which joints come to stand [s].
        """
        assert description.legs is not None, "who has no feet stands on no floor"
        self._kinematics = LegKinematics(description.kinematics, description.legs)
        self._period, self._brake_time = period, brake_time
        self._heading_33 = np.eye(3)
        """What turns the stream's world into the robot's."""
        self._stance: Stance | None = None
        """What was followed last; None: nothing is being followed."""
        self._path_6 = np.zeros(6)
        """How far the base is still to go and to turn with the stream [m], [rad],"""
        self._due = 0.0
        """and in what time [s]."""
        self._velocity_6 = np.zeros(6)
        """[m/s], [rad/s]"""
        self._coasted, self._sinking, self._since = 0.0, 0.0, 0.0
        """For how long the robot has braked [s], how fast it comes down [m/s], and how old the stance is [s]."""
        (soles,), (axes_33, root_3) = self._kinematics.soles(q_N), self._kinematics.carrier(q_N)
        turn_33 = np.eye(3)[WORLD] @ axes_33.T
        self._stop_soles = soles
        point_H3, (low_H, low) = soles.point_H3 @ turn_33.T, self._kinematics.lowest(soles, turn_33)
        place_3 = -turn_33 @ root_3
        place_3[UP] = -low
        self._anchor_H2, self._orient_R33 = (place_3 + point_H3)[:, FLAT], turn_33 @ soles.turn_R33
        self._theirs_R33 = self._orient_R33.copy()
        """How the stream has the feet turned."""
        self._begun = True
        """Whether what is followed began anew with the newest stance."""
        self._at = _Place(turn_33, place_3, point_H3, low_H, low)
        self._weight_H = self._near(STANDS_M, LIFTED_M)
        self._flat_R = self._weight_H.reshape(-1, 2).min(axis=1)
        """How far each foot stands with its whole sole (R,), 0..1, so that its turn counts."""

    @property
    def base(self) -> Base:
        """Where it is."""
        return Base(self._at.place_3, self._at.turn_33)

    @property
    def planted_R(self) -> np.ndarray:
        """Whether each foot is planted."""
        return self._weight_H.reshape(-1, 2).max(axis=1) > PLANTED

    @property
    def still(self) -> bool:
        """Whether the base has come to rest, if joints have."""
        return self._weight_H.sum() >= 1 - 1e-9 or (self._coasted > self._brake_time and self._sinking == 0)

    def step(self, q_N: np.ndarray, stop_N: np.ndarray, stance: Stance | None, share: float) -> None:
        """Moves the base along, one period.

        Args:
            q_N: joint angles as they are sent (N,) [rad].
            stop_N: those at which joints stand if they brake from now on (N,) [rad].
            stance: the stream's newest; None: nobody has been seen.
            share: how fast the robot may follow, as a share of its full speed; 0: it is stopped, or its legs are held.
        """
        others = [] if stance is None or stance is self._stance else [stance.q_N]
        soles, self._stop_soles, *theirs = self._kinematics.soles(q_N, stop_N, *others)
        before = self._at
        followed = stance if share > 0 else None
        free_33, planned_3 = self._coast() if followed is None else self._follow(followed, share)
        self._weigh(followed)
        if followed is not None:
            self._turn_feet(followed, theirs[0].turn_R33 if theirs else None, share)
        self._stance = followed
        self._at = at = self._solve(soles, free_33, planned_3)
        # Where two planted feet go apart, both slide, and the middle stays; it is not remembered, so that no foot is
        # pulled back to where it was when the other one is lifted.
        self._anchor_H2, self._orient_R33 = (at.place_3 + at.point_H3)[:, FLAT], at.turn_33 @ soles.turn_R33
        if followed is not None:
            turned_3 = turn_of(at.turn_33 @ before.turn_33.T)
            self._velocity_6 = np.concatenate((at.place_3 - before.place_3, turned_3)) / self._period

    def standstill(self) -> Base:
        """Where the base comes to rest if joints brake from now on; who is in the air then is lowered afterwards."""
        left = max(self._brake_time - self._coasted, 0.0)
        way_6 = self._velocity_6 * (left * left / (2 * self._brake_time))
        free_33 = rotation_of(way_6[3:]) @ self._at.turn_33
        at = self._solve(self._stop_soles, free_33, self._at.place_3 + way_6[:3])
        return Base(at.place_3, at.turn_33)

    def settle(self) -> None:
        """The base is at rest, where `standstill` said."""
        base = self.standstill()
        self._stance, self._velocity_6, self._coasted = None, np.zeros(6), self._brake_time
        self._at = self._at._replace(place_3=base.place_3, turn_33=base.turn_33)

    def _near(self, low: float, high: float) -> np.ndarray:
        """How far each point is at the floor (H,), 1 under a height [m], 0 above another one."""
        return np.clip((high - self._at.place_3[UP] - self._at.low_H) / (high - low), 0.0, 1.0)

    def _in_world(self, stance: Stance) -> np.ndarray:
        """The rotation of the stream's base in the robot's world."""
        return self._heading_33 @ stance.base.turn_33

    def _follow(self, stance: Stance, share: float) -> tuple[np.ndarray, np.ndarray]:
        """How the base would be turned, and where it would be, if nothing were planted."""
        self._coasted = 0.0
        last, self._since, self._begun = self._stance, self._since + self._period, False
        if last is None:
            self._begin(stance)
        elif last is not stance:
            way_3 = self._heading_33 @ (stance.base.place_3 - last.base.place_3)
            turned_3 = turn_of(self._heading_33 @ stance.base.turn_33 @ self._in_world(last).T)
            if _norm(way_3) > FASTEST * self._since or _norm(turned_3) > FASTEST_TURN * self._since:
                self._begin(stance)
            else:
                self._path_6, self._due = self._path_6 + np.concatenate((way_3, turned_3)), max(self._due, self._since)
        # Frames that come less often than steps are shared out among these; after a gap, among as many as it lasted.
        now_6 = self._path_6 * min(1.0, self._period / max(self._due, self._period))
        now_6[:3], now_6[3:] = self._at_most(now_6[:3], FASTEST), self._at_most(now_6[3:], FASTEST_TURN)
        self._path_6, self._due = self._path_6 - now_6, max(self._due - self._period, 0.0)
        if last is not stance:
            self._since = 0.0
        free_33 = rotation_of(share * now_6[3:]) @ self._at.turn_33
        free_33 = self._toward(free_33, self._in_world(stance), share)
        planned_3 = self._at.place_3 + share * now_6[:3]
        planned_3[UP] = self._sunk(planned_3[UP], float(stance.weight_H.sum()) > PLANTED)
        return free_33, planned_3

    def _begin(self, stance: Stance) -> None:
        """The stream's world is turned so that its robot looks where this one does."""
        off_33 = self._at.turn_33 @ stance.base.turn_33.T
        angle = math.atan2(off_33[1, 0] - off_33[0, 1], off_33[0, 0] + off_33[1, 1])
        self._heading_33 = rotation_of(np.array([0.0, 0.0, angle]))
        self._path_6, self._due, self._since, self._begun = np.zeros(6), 0.0, 0.0, True

    def _coast(self) -> tuple[np.ndarray, np.ndarray]:
        """The same for a robot that brakes."""
        left = max(self._brake_time - self._coasted, 0.0)
        self._coasted += self._period
        after = max(self._brake_time - self._coasted, 0.0)
        way_6 = self._velocity_6 * ((left * left - after * after) / (2 * self._brake_time))
        planned_3 = self._at.place_3 + way_6[:3]
        planned_3[UP] = self._sunk(planned_3[UP], after == 0)
        return rotation_of(way_6[3:]) @ self._at.turn_33, planned_3

    def _sunk(self, height: float, sinks: bool) -> float:
        """A height [m], or a lower one, if the robot is in the air and should not be."""
        above = height + self._at.low
        if not sinks or above <= 1e-9 or self._weight_H.sum() >= 1:
            self._sinking = 0.0
            return height
        self._sinking = min(self._sinking + GRAVITY * self._period, SINK_SPEED, above / self._period)
        return height - self._sinking * self._period

    def _weigh(self, stance: Stance | None) -> None:
        """How much each point's contact counts: as the person's, if it stands on the floor; where the robot stands
        otherwise than the person, that is on what is lowest. Who is stopped stands as he stood.
        """
        bears_H = self._near(BEARS_M, STANDS_M)
        if stance is None:
            wanted_H = np.maximum(self._weight_H, bears_H)
        else:
            wanted_H = stance.weight_H * self._near(STANDS_M, LIFTED_M)
            missing = min(float(stance.weight_H.sum()), 1.0) - float(wanted_H.sum())
            wanted_H = np.maximum(wanted_H, missing * bears_H)
        self._weight_H = np.minimum(wanted_H, self._weight_H + self._period / RISE_S)
        flat_R = self._weight_H.reshape(-1, 2).min(axis=1)
        self._flat_R = np.minimum(flat_R, self._flat_R + self._period / RISE_S)

    def _turn_feet(self, stance: Stance, turn_R33: np.ndarray | None, share: float) -> None:
        """Turns planted feet as the stream does, while it has them planted too, and towards how it has them.
        `turn_R33`: how they are turned in the stream's base; None: as before.
        """
        last_33, theirs_R = self._theirs_R33, stance.weight_H.reshape(-1, 2).min(axis=1)
        if turn_R33 is not None:
            self._theirs_R33 = self._in_world(stance) @ turn_R33
        goes_on = turn_R33 is not None and self._stance is not None and not self._begun
        for foot in np.flatnonzero(np.minimum(theirs_R, self._flat_R) > 0):
            if goes_on:
                turned_3 = turn_of(self._theirs_R33[foot] @ last_33[foot].T)
                turned_3 = self._at_most(turned_3, FASTEST_TURN)  # after a gap it is far
                self._orient_R33[foot] = rotation_of(share * turned_3) @ self._orient_R33[foot]
            self._orient_R33[foot] = self._toward(self._orient_R33[foot], self._theirs_R33[foot], share)

    def _toward(self, turn_33: np.ndarray, other_33: np.ndarray, share: float) -> np.ndarray:
        """A rotation, turned towards another one as far as it may be in a period."""
        return rotation_of(self._at_most(turn_of(other_33 @ turn_33.T), LEVEL_SPEED * share)) @ turn_33

    def _at_most(self, way_3: np.ndarray, speed: float) -> np.ndarray:
        """As much of a way as a speed allows in a period."""
        return way_3 * min(1.0, speed * self._period / max(_norm(way_3), 1e-12))

    def _solve(self, soles: Soles, free_33: np.ndarray, planned_3: np.ndarray) -> _Place:
        """The base that planted soles carry, and as far as none is planted, one that moves freely."""
        flat_R, weight_H, anchor_H2 = self._flat_R, self._weight_H, self._anchor_H2
        away_R3 = turns_of(self._orient_R33 @ soles.turn_R33.mT @ free_33.T)
        turn_33 = rotation_of(flat_R @ away_R3 / max(float(flat_R.sum()), 1.0)) @ free_33
        point_H3, (low_H, low) = soles.point_H3 @ turn_33.T, self._kinematics.lowest(soles, turn_33)
        whole = float(weight_H.sum())
        rest = max(1.0 - whole, 0.0)
        place_3 = planned_3.copy()
        place_3[FLAT] = (weight_H @ (anchor_H2 - point_H3[:, FLAT]) + rest * planned_3[FLAT]) / (whole + rest)
        rise = (-float(weight_H @ low_H) + rest * planned_3[UP]) / (whole + rest)
        place_3[UP] = max(rise, -low)
        return _Place(turn_33, place_3, point_H3, low_H, low)


def _norm(vector_3: np.ndarray) -> float:
    return math.sqrt(float(vector_3 @ vector_3))
