"""Which way is up in a file's world, and turning it so that y is.

Worlds of files have y or z up; cameras look along z with y down. People stand and walk more than they lie, so the axis
that the body's own up axis follows on the mean is the world's. Who stands and lies, each for a while, stands along one
axis that is up and along one that is not; the floor tells which, as the lowest joint stays on it.
"""

from __future__ import annotations

import math

import numpy as np

_TO_Y_UP: dict[str, tuple[tuple[float, float, float], ...]] = {
    "y up": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "z up": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)),
    "y down": ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)),
}
"""What turns each world so that y is up: a turn about x, so that who looks along z in a camera's world, away from it,
looks along -z."""
_UPRIGHT, _FLAT = 0.85, 0.5
"""Cosines between the body's own up axis, on the mean, and that of the world: more than the first, of somebody who
stands, sits or walks; less than the second, of somebody who lies or crawls."""
_ON_A_FLOOR_M = (-0.15, 0.65)
"""How high the origin of a model's pelvis is over a floor at height 0 of who lies or crawls on it, and not higher."""
_MOST_TIMES = (0.05, 0.95)
"""Quantiles between which it is."""
_LYING_M, _LYING_LOW_M, _STANDING_LOW_M = (0.07, 0.45), (-0.06, 0.12), (-0.6, 0.6)
"""How high the pelvis of who lies is over the floor, and the lowest joint; and that of who stands, as recordings have
it: of CMU's clips that stand, one has its floor at -0.4 m."""
_AT_ORIGIN_M = 0.1
"""So near to height 0 is a pelvis that somebody put there."""
_FLAT_M = 0.5
"""How far the joints of who lies are above each other."""
_STEADY_M = 0.15
"""How much the lowest joint's height varies of who lies."""
_STANDING = math.cos(math.radians(25.0))
"""The pelvis of who stands is tilted by no more than that."""
_A_WHILE = 0.03
"""Share of the frames in which somebody stands who does so for a while."""
_RISES_M = 0.2
"""How much more the lowest joint's height varies [m] in a world that is not the file's, to tell so."""
_HANDS, _HANDS_M = (20, 21), 0.15
"""Wrists, of joints in SMPL's order, and how far they are from the floor on which somebody stands on the hands."""
_CLIMBS_M = 1.0
"""How much the pelvis rises of who climbs, or lies and goes on along the body."""
Place = tuple[float, float, float]
WORLDS = ("y up", "z up")
"""Of files of motion capture; where both fit alike, the first is taken."""
Y_UP, Z_UP = ("y up",), ("z up",)
"""Of files whose writers say so, also of who lies, crawls or stands on the hands from the first frame to the last."""
CAMERAS = ("y down", "y up")
"""Of estimators: what a camera sees, and what some have turned upright."""
ANY_WORLD = ("y up", "y down", "z up")
"""Of files that do not say whose they are."""


def find_up(
    body_up_T3: np.ndarray, worlds: tuple[str, ...], joints_TK3: np.ndarray | None = None
) -> tuple[str, np.ndarray]:
    """Which of some worlds a body is in, and the matrix (3, 3) that makes y its up axis.

    Args:
        body_up_T3: the body's own up axis, a unit vector a frame.
        worlds: some of those above.
        joints_TK3: where its joints are [m], if its way through the world is known.
    """
    turns = {world: _turn(world, body_up_T3) for world in worlds}
    height_T = {world: body_up_T3 @ turn_33[1] for world, turn_33 in turns.items()}
    best = max(worlds, key=lambda world: float(height_T[world].mean()))
    if joints_TK3 is not None:
        tried = [world for world in worlds if world == best or _stands(height_T[world])]
        rises = {world: _rise(joints_TK3 @ turns[world][1]) for world in tried}
        steady = min(tried, key=rises.__getitem__)
        if rises[best] - rises[steady] > _RISES_M:
            best = steady
    return best, turns[best]


def find_world(
    body_up_T3: np.ndarray,
    place_T3: np.ndarray | None,
    worlds: tuple[str, ...],
    joints_TK3: np.ndarray | None = None,
    origins: tuple[Place, ...] = ((0.0, 0.0, 0.0),),
) -> tuple[str, np.ndarray, str]:
    """Which of some worlds a root is in, the matrix (3, 3) that makes y its up axis, and what is to be said of it.

    Who lies or crawls from the first frame to the last stands along no world's axis; then the place tells, where just
    one world has the body flat, and as low as that of somebody on a floor at height 0. Who seems to stand, because
    they lie along an axis that may be up, have no floor under their feet and one under their back.

    Args:
        body_up_T3: the body's own up axes, in the file's world.
        place_T3: where the root is [m], if that is known.
        worlds: which there may be, the likeliest first.
        joints_TK3: where joints are in some frames [m], the pelvis first, if their places are known.
        origins: where the pelvis may be from the place that the file tells [m], along the file's axes.
    """
    up, turn_33 = find_up(body_up_T3, worlds, joints_TK3)
    turns = {world: _turn(world, body_up_T3) for world in worlds}
    upright = float((body_up_T3 @ turn_33[1]).mean())
    if len(worlds) == 1:
        return up, turn_33, ""
    if upright > _UPRIGHT and joints_TK3 is not None:
        hands = [w for w in worlds if w in WORLDS and w != up and _is_on_hands(body_up_T3, joints_TK3, turns[w])]
        if len(hands) == 1:
            said = (
                f"the body would stand on no floor with {up}, and stands on its hands with {hands[0]}, which is taken"
            )
            return hands[0], turns[hands[0]], said
        level = [w for w in worlds if w in WORLDS and w != up and _goes_level(body_up_T3, joints_TK3, turns[w])]
        if level and float(np.ptp(joints_TK3[:, 0] @ turn_33[1])) > _CLIMBS_M:
            return up, turn_33, f"the body stands with {up}, which is taken, and climbs; with {level[0]} it would lie"
    placed = [] if joints_TK3 is None else [joints_TK3 + np.array(origin, joints_TK3.dtype) for origin in origins]
    lying = [
        world
        for world in worlds
        if world in WORLDS
        and abs(float((body_up_T3 @ turns[world][1]).mean())) < _FLAT
        and any(_lies(near_TK3, turns[world]) for near_TK3 in placed)
    ]
    if upright > _UPRIGHT or _stands(body_up_T3 @ turn_33[1]):
        if not lying and joints_TK3 is not None and upright > _UPRIGHT:
            others = [w for w in worlds if w in WORLDS and abs(float((body_up_T3 @ turns[w][1]).mean())) < _FLAT]
            tried = (np.zeros(3), *map(np.array, origins))
            low = [w for w in others if any(_may_lie(joints_TK3 + at_3, turns[w], turn_33) for at_3 in tried)]
            said = f"the body stands with {up}, which is taken; with {low[0]} it would lie" if low else ""
            return up, turn_33, f"{said}, and the root, which stays at height 0, does not tell" if low else ""
        if len(lying) != 1 or upright <= _UPRIGHT:
            return up, turn_33, ""
        if any(_has_floor(near_TK3, turn_33) for near_TK3 in placed):
            said = f"the body stands with {up}, which is taken; with {lying[0]} it would lie on a floor at height 0"
            return up, turn_33, said
        said = f"the body would stand on no floor with {up}, and lies on one with {lying[0]}, which is taken"
        return lying[0], turns[lying[0]], said
    said = "the body is not upright on the mean, as of somebody who lies or crawls"
    if len(lying) == 1:
        return lying[0], turns[lying[0]], f"{said}: {lying[0]} is taken, by how low the joints are"
    flat = [
        world
        for world in worlds
        if world in WORLDS and place_T3 is not None and _lies_on_its_floor(body_up_T3, place_T3, turns[world])
    ]
    if len(flat) == 1:
        return flat[0], turns[flat[0]], f"{said}: {flat[0]} is taken, by how low the root is"
    if upright > _FLAT:
        return up, turn_33, ""
    return worlds[0], turns[worlds[0]], f"{said}, and nothing tells which way is up: {worlds[0]} is taken"


def _is_on_hands(body_up_T3: np.ndarray, joints_TK3: np.ndarray, turn_33: np.ndarray) -> bool:
    """Whether somebody is upside down, and a hand is on a floor at height 0 in nearly all frames."""
    if joints_TK3.shape[1] <= max(_HANDS) or float((body_up_T3 @ turn_33[1]).mean()) > -_UPRIGHT:
        return False
    height_TK = joints_TK3 @ turn_33[1]
    low, high = np.quantile(height_TK[:, _HANDS].min(axis=1), _MOST_TIMES)
    lowest = np.isin(height_TK.argmin(axis=1), _HANDS).mean() > _MOST_TIMES[1]
    return bool(lowest and abs(low) < _HANDS_M and abs(high) < _HANDS_M)


def _goes_level(body_up_T3: np.ndarray, joints_TK3: np.ndarray, turn_33: np.ndarray) -> bool:
    """Whether somebody who is flat keeps their height."""
    flat = abs(float((body_up_T3 @ turn_33[1]).mean())) < _FLAT
    return flat and float(np.ptp(joints_TK3[:, 0] @ turn_33[1])) < _RISES_M


def _stands(height_T: np.ndarray) -> bool:
    return float((height_T > _STANDING).mean()) > _A_WHILE


def _rise(height_TK: np.ndarray) -> float:
    """How much the lowest joint's height varies: the range of nine frames in ten."""
    low, high = np.percentile(height_TK.min(axis=1), (5, 95))
    return float(high - low)


def _has_floor(joints_TK3: np.ndarray, turn_33: np.ndarray) -> bool:
    """Whether the feet of who stands are on a floor at height 0, or the pelvis is put there."""
    low, high = _STANDING_LOW_M
    height_TK = joints_TK3 @ turn_33[1]
    lowest, pelvis = float(np.median(height_TK.min(axis=1))), float(np.median(height_TK[:, 0]))
    return low < lowest < high or abs(pelvis) < _AT_ORIGIN_M


def _may_lie(joints_TK3: np.ndarray, turn_33: np.ndarray, upright_33: np.ndarray) -> bool:
    """Whether somebody whose pelvis is put at height 0, in a world in which they stand as in one in which they are
    flat, may lie.
    """
    height_TK = joints_TK3 @ turn_33[1]
    pelvis = np.quantile([height_TK[:, 0], joints_TK3[:, 0] @ upright_33[1]], _MOST_TIMES)
    return bool(np.abs(pelvis).max() < _AT_ORIGIN_M and np.median(np.ptp(height_TK, axis=1)) < _FLAT_M)


def _lies(joints_TK3: np.ndarray, turn_33: np.ndarray) -> bool:
    """Whether somebody whose body is flat lies on a floor at height 0."""
    height_TK = joints_TK3 @ turn_33[1]
    low_T, (low, high) = height_TK.min(axis=1), _LYING_LOW_M
    pelvis = np.quantile(height_TK[:, 0], _MOST_TIMES)
    return (
        low < float(np.median(low_T)) < high
        and float(np.ptp(np.quantile(low_T, _MOST_TIMES))) < _STEADY_M
        and bool(_LYING_M[0] < pelvis[0] and pelvis[1] < _LYING_M[1])
    )


def _lies_on_its_floor(body_up_T3: np.ndarray, place_T3: np.ndarray, turn_33: np.ndarray) -> bool:
    """Whether a body lies flat in a world, on a floor at height 0."""
    if abs(float((body_up_T3 @ turn_33[1]).mean())) > _FLAT:
        return False
    low, high = _ON_A_FLOOR_M
    lowest, highest = np.quantile(place_T3 @ turn_33[1], _MOST_TIMES)
    return bool(low < lowest and highest < high)


def _turn(world: str, like: np.ndarray) -> np.ndarray:
    return np.array(_TO_Y_UP[world], like.dtype)
