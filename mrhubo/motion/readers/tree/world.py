"""Where up is in a file's world, and how long its unit is: from the body in it.

Frame: the file's own world.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.motion.readers.tree.hierarchy import Pose
from mrhubo.motion.readers.tree.reference import Reference

UNITS: dict[str, float] = {
    "metres": 1.0,
    "centimetres": 0.01,
    "millimetres": 0.001,
    "inches": 0.0254,
    "feet": 0.3048,
    "decimetres": 0.1,
    "CMU's units (0.0254 / 0.45 m)": 0.0254 / 0.45,
}
"""Units that occur, in metres."""
_LEG = 0.84
"""Thigh and shin of an adult [m]: 0.49 of 1.72 m (Winter, as in `mrhubo.motion.readers.tree.limbs`)."""
_FACTOR = 1.7
"""How far from it a leg may be in a unit that is believed: legs of 0.5 to 1.4 m."""
_METRIC, _CHILD = ("metres", "centimetres", "millimetres"), 0.4
"""Units in which a leg may be a child's too [m], of somebody of 0.8 m: as many inches, 40, are an adult's legs of 1 m,
whom only who is taller than two metres has."""
_CLEAR = 0.7
"""Share of a mean upward vector along one axis, from which on the axis is up."""
_STEADY = 0.5
"""Length of the mean of upward unit vectors from which on people stand more than they lie."""
_UPS = ("y", "z", "-y")
"""Axes that are up in some files: -y in what a camera sees."""
AT_REST = "at rest"
"""What is up where a pose at rest tells that for sure."""
_FLOOR, _RISES = 0.35, 0.25
"""How far from 0 the lowest joint may be to be on a floor; and how much its height varies at most, of anybody who is
not carried about; in lengths of a leg.
"""


def up_axis(
    pose: Pose,
    place: Mapping[str, int],
    reference: Reference | None,
    given: str | None,
    told: str | None,
    notes: list[str],
) -> tuple[str, str]:
    """Which axis is up, for instance `z` or `-y`, and in words how that is known.

    It is that along which people stand on the mean, but for those who lie or crawl throughout a motion. These stand
    along an axis that is up in no file, or along which the lowest joint goes up and down as that of nobody who walks;
    then it is the axis along which the skeleton stands at rest, or y or z, if there is a floor at 0 across it. What the
    file says is believed where nothing stands against it: a pose at rest along another axis, or a floor at 0 across the
    one along which people stand.

    Args:
        pose: some frames.
        place: which joint is which.
        reference: the pose at rest, if there is one.
        given: what the user says.
        told: what the file says; `AT_REST` if that along which the skeleton stands at rest is up.
        notes: is told where motion and rest disagree.
    """
    if given is not None:
        return given, "as the map says"
    up_F3 = sum(
        pose.point[place[f"{side}_shoulder"]] - pose.point[place[f"{side}_ankle"]] for side in ("left", "right")
    )
    mean_3 = mean_direction(np.asarray(up_F3))
    length = float(np.linalg.norm(mean_3))
    stands = length >= _STEADY and np.abs(mean_3).max() >= _CLEAR * length
    found = named_axis(mean_3) if stands else None
    resting = None if reference is None else named_axis(reference.axes_33[:, 1])
    told, who = (resting, "its pose at rest") if told == AT_REST else (told, "the file")
    if found is not None and found == (resting or told):
        return found, "by how the body stands"
    if told is not None and resting in (None, told) and (found is None or not _on_floor(pose, place, found)):
        if found is not None:
            notes.append(
                f"the body lies along {found}, as {who} says that {told} is up, which is taken ('up: {found}' in"
                " --bvh-map if it is not)"
            )
        return told, f"as {who} says"
    floor = {axis: _floor(pose, place, axis) for axis in (("y", "z") if resting is None else (resting,))}
    best = min(floor, key=lambda axis: sum(floor[axis]))
    has_floor = _on_floor(pose, place, best)
    if found is None and resting is not None:
        return resting, "by its pose at rest, as the body lies"
    if found is None:
        return (best, "by where the floor is") if has_floor else ("y", "a guess, as the body lies")
    doubtful = found not in _UPS or (resting is not None and _floor(pose, place, found)[1] > _RISES)
    if doubtful and has_floor:
        notes.append(
            f"the body lies along {found}, as the floor is across {best}, which is taken to be up ('up: {found}' in "
            "--bvh-map if it is not)"
        )
        return best, "by where the floor is"
    if resting is not None:
        notes.append(
            f"the body stands along {found}, and at rest along {resting}: {found} is taken to be up ('up: {resting}' in"
            " --bvh-map if it is not)"
        )
    return found, "by how the body stands"


def _on_floor(pose: Pose, place: Mapping[str, int], axis: str) -> bool:
    """Whether there is a floor at height 0, if an axis is up."""
    low, rises = _floor(pose, place, axis)
    return low < _FLOOR and rises < _RISES


def _floor(pose: Pose, place: Mapping[str, int], axis: str) -> tuple[float, float]:
    """How far from height 0 the lowest joint is, and how much its height varies, if an axis is up; in lengths of a leg:
    the median, and the range of the middle half.
    """
    up_3 = to_y_up(axis)[1]
    low_F = np.min([pose.point[joint] @ up_3 for joint in place.values()], axis=0)
    hip, knee, ankle = (pose.point[place[f"left_{name}"]][0] for name in ("hip", "knee", "ankle"))
    leg = max(float(np.linalg.norm(knee - hip) + np.linalg.norm(ankle - knee)), 1e-9)
    low, middle, high = np.percentile(low_F, (25, 50, 75))
    return abs(float(middle)) / leg, float(high - low) / leg


def mean_direction(vector_F3: np.ndarray) -> np.ndarray:
    """The mean (3,) of the directions of some vectors (F, 3)."""
    return np.mean(vector_F3 / np.maximum(np.linalg.norm(vector_F3, axis=-1, keepdims=True), 1e-12), axis=0)


def named_axis(vector_3: np.ndarray) -> str:
    """The axis that is nearest to a vector, for instance `z` or `-y`."""
    axis = int(np.argmax(np.abs(vector_3)))
    return ("" if vector_3[axis] > 0 else "-") + "xyz"[axis]


def to_y_up(axis: str) -> np.ndarray:
    """The turn (3, 3) that makes an axis, for instance `z` or `-y`, the y axis; by a quarter or half turn."""
    unit = np.zeros(3)
    unit["xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    if axis == "y":
        return np.eye(3)
    across = np.array([1.0, 0.0, 0.0]) if axis == "-y" else np.cross(unit, [0.0, 1.0, 0.0])
    return np.round(axis_angle_to_matrix(across * (np.pi if axis == "-y" else np.pi / 2)))


def unit_of(pose: Pose, place: Mapping[str, int], given: float | None) -> tuple[float, str]:
    """The file's unit [m], and its name or how it was found."""
    if given is not None:
        return given, f"units of {given:g} m, as the map says"
    legs = []
    for side in ("left", "right"):
        hip, knee, ankle = (pose.point[place[f"{side}_{name}"]] for name in ("hip", "knee", "ankle"))
        legs.append(np.median(np.linalg.norm(knee - hip, axis=-1) + np.linalg.norm(ankle - knee, axis=-1)))
    return nearest_unit(float(np.mean(legs)))


def nearest_unit(leg: float) -> tuple[float, str]:
    """The unit in which a leg (thigh and shin) of this length is a person's, or else most like an adult's: metres and
    name.
    """
    leg = max(leg, 1e-9) if np.isfinite(leg) else 1e-9
    for name in _METRIC:
        if _CHILD <= leg * UNITS[name] <= _FACTOR * _LEG:
            return UNITS[name], name
    name, unit = min(UNITS.items(), key=lambda entry: abs(np.log(leg * entry[1] / _LEG)))
    if abs(np.log(leg * unit / _LEG)) <= np.log(_FACTOR):
        return unit, name
    return _LEG / leg, f"no unit that is known; legs are taken to be {_LEG:g} m long"
