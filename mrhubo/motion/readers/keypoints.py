"""Human motions from keypoints in space: points on a body, frame by frame, some of them perhaps missing.

Legend: T frames, K keypoints, F some frames.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from mrhubo.body.joints import SIDES
from mrhubo.errors import UserError, listed
from mrhubo.motion.motion import Motion
from mrhubo.motion.positions import BodyPoints, motion_from_points
from mrhubo.motion.readers.content import Content, NoMotion
from mrhubo.motion.readers.keypoint_arrays import LIFT, Keypoints
from mrhubo.motion.readers.keypoint_files import holds_points, read_keypoints_file
from mrhubo.motion.readers.keypoint_fit import NONSENSE, fitting_sets
from mrhubo.motion.readers.keypoint_sets import SETS
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.point_names import NEEDED, by_names
from mrhubo.motion.readers.rate import asked_rate, told_rate
from mrhubo.motion.readers.sightings import check_size, known_points
from mrhubo.motion.readers.tree.world import mean_direction, named_axis, nearest_unit, to_y_up
from mrhubo.motion.trunks import trunk_turns

_SAMPLES = 256
_CLEARLY = 2.0
"""A set fits clearly better than another if its misfit is so many times smaller."""
_LARGEST = 1e7
_PIXELS = 50.0
"""Over more than this go a picture's coordinates, beside which numbers between 0 and 1 are scores."""
_LEG_OVER_TRUNK = 1.7
"""Thigh and shin over the way from hips to shoulders (Winter, fig. 4.1: 0.49 and 0.288 of the height)."""
_LEFT_HANDED = 0.3
"""How clearly nose, toes and knees must point backward, of 1, to say that axes are left-handed."""
_BENT = 0.08
"""How far a knee is beside the line from hip to ankle, of the leg's length, where it tells which way it bends: 18
degrees.
"""
_BESIDE, _NEARLY_ALL = 0.05, 0.9
"""How far beside a picture, in shares of it, points are seen; and which share of them is in it."""
_FEW = 0.5
"""A point that is at the origin in fewer of the frames is not put there, but missing."""
_CENTRED = 0.01
"""How far [m] from the origin the pelvis stays, in all frames, of points that are centred on it."""


def is_keypoints(content: Content) -> bool:
    """Whether a file has points of a body and no rotations; a single array of triples has, if the distances between
    what would be the ends of bones hardly change.
    """
    if not content.is_npy:
        return holds_points(content)
    try:
        points = read_keypoints_file(content.path, ReadOptions())
    except UserError:
        return False
    fits = fitting_sets(_some(points.point_TK3))
    return bool(fits) and fits[0][0] < NONSENSE


def read_keypoints(path: Path, options: ReadOptions) -> Motion:
    """Reads points (T, K, 3) of a body, with names or in the order of a set that is known.

    The points' world may have any axis up, and any unit; both are found by the body.

    Raises:
        UserError: the file is damaged, it has no points of a body, which points they are or the rate is not known.
    """
    return motion_of_points(path, read_keypoints_file(path, options), options)


def motion_of_points(path: Path, found: Keypoints, options: ReadOptions) -> Motion:
    """The motion of points of a body.

    Raises:
        NoMotion: they are no points of a body in the order of a set that is known, and have no names.
        UserError: as for `read_keypoints`.
    """
    check_size(path, found.where, len(found.point_TK3), 1)
    refuse_far(path, found)
    _refuse_flat(path, found)
    places, what = _which(path, found)
    missing = [name for name in NEEDED if name not in places]
    if missing:
        raise UserError(f"{path}: has no point called {listed(missing)}; shoulders and hips are needed")
    rate, notes = rate_of_points(path, found, options), found.notes
    point_TK3 = known_points(found.point_TK3, found.confidence_TK)
    points = {name: _seldom_at_origin(name, point_TK3[:, place]) for name, place in places.items()}
    _refuse_shares(path, found, points)
    points, world = to_world(points, notes)
    sure = {} if found.confidence_TK is None else {n: found.confidence_TK[:, place] for n, place in places.items()}
    turns, whose = trunk_turns(points)
    body = BodyPoints(points, turns, confidence=sure)
    source = f"keypoints {found.where}, {what}, {world}" + (f"; at rest, a trunk like {whose}'s" if whose else "")
    centred = _is_centred(points)
    if centred:
        notes.append("where the person goes is not told: the points are centred on the hips")
    motion = motion_from_points(body, motion_name(path), rate, source, tuple(notes), str(path))
    return motion.changed(root_position_T3=None) if centred else motion


def _which(path: Path, found: Keypoints) -> tuple[dict[str, int], str]:
    """Our points by place, and in words how that is known."""
    count = found.point_TK3.shape[1]
    if found.names is not None:
        return by_names(found.names), "by their names"
    fits = fitting_sets(_some(known_points(found.point_TK3, found.confidence_TK)))
    if not fits or fits[0][0] >= NONSENSE:
        known = ", ".join(f"{name} ({len(points)})" for name, points in SETS.items())
        raise NoMotion(
            f"{path}: its {count} points have no names and fit no body in the order of a set that is known ({known}); "
            "save an .npz with 'keypoints' and 'names', for instance 'left_shoulder'"
        )
    if len(fits) > 1 and fits[1][0] < _CLEARLY * fits[0][0]:
        both = " and ".join(name for _, name in fits)
        raise UserError(
            f"{path}: its {count} points have no names, and both {both} fit; save an .npz with 'keypoints' and 'names'"
        )
    name = fits[0][1]
    return {our: place for place, our in enumerate(SETS[name]) if our != "-"}, f"{count} points as {name} has them"


def fits_a_body(point_TK3: np.ndarray, name: str) -> bool:
    """Whether points in the order of a set keep the lengths of bones and have a body's proportions."""
    return any(found == name and bad < NONSENSE for bad, found in fitting_sets(_some(point_TK3)))


def refuse_far(path: Path, found: Keypoints) -> None:
    """Refuses points that are farther away than anybody.

    Raises:
        UserError: one is.
    """
    if (np.abs(np.nan_to_num(found.point_TK3)) > _LARGEST).any():
        raise UserError(f"{path}: {found.where} holds numbers beyond {_LARGEST:g}")


def _refuse_flat(path: Path, found: Keypoints) -> None:
    """Refuses points in a picture, whose third number is a score, and such as are nowhere."""
    if not np.isfinite(found.point_TK3).any():
        raise UserError(f"{path}: {found.where} tells of no point where it is; expected x, y and z, or a 'position'")
    known_X3 = found.point_TK3[np.isfinite(found.point_TK3).all(-1)]
    spread_3, third = (np.ptp(known_X3, axis=0), known_X3[:, 2]) if len(known_X3) else (np.zeros(3), np.ones(1))
    is_score = third.min() >= 0 and third.max() <= 1 and min(spread_3[:2]) > _PIXELS
    if is_score or not spread_3[2] > 0:
        raise UserError(
            f"{path}: {found.where} has points in a picture (x, y and {'a score' if is_score else 'no depth'}); {LIFT}"
        )


def _refuse_shares(path: Path, found: Keypoints, points: Mapping[str, np.ndarray]) -> None:
    """Refuses points whose x and y are shares of a picture's width and height: limbs point elsewhere in it. Nobody who
    is told in metres is so small, and who is told in greater units not so far from the origin.
    """
    known_X2 = np.concatenate([x[np.isfinite(x).all(-1), :2] for x in points.values()])
    inside = float(((known_X2 > -_BESIDE) & (known_X2 < 1 + _BESIDE)).all(-1).mean()) if len(known_X2) else 0.0
    down_T = sum(points[f"{side}_hip"][:, 1] - points[f"{side}_shoulder"][:, 1] for side in SIDES)
    if inside > _NEARLY_ALL and typical(np.asarray(down_T)) > 0 and typical(known_X2.min(axis=1)) > _BESIDE:
        raise UserError(
            f"{path}: {found.where} has points as shares of a picture's width and height (0 to 1, y down), whose limbs "
            "point elsewhere than the person's; save points in space, such as MediaPipe's pose_world_landmarks"
        )


def rate_of_points(path: Path, found: Keypoints, options: ReadOptions) -> float:
    """Frames per second: what the file tells, or the options.

    Raises:
        UserError: neither does.
    """
    if found.rate is None:
        return asked_rate(path, options)
    return told_rate(path, "says", found.rate, options, found.notes)


@np.errstate(all="ignore")
def to_world(points: dict[str, np.ndarray], notes: list[str]) -> tuple[dict[str, np.ndarray], str]:
    """The points with y up, right-handed, in metres, by those of shoulders, hips, knees, ankles, nose and toes; and in
    words what they were in.
    """
    if way_forward(points) < -_LEFT_HANDED:
        points = {name: point_T3 * [-1.0, 1.0, 1.0] for name, point_T3 in points.items()}
        notes.append(
            "nose, feet and knees point backward: the file's axes are taken to be left-handed, and x is mirrored"
        )
    low = next((joint for joint in ("ankle", "knee", "hip") if _seen(points, joint)), "hip")
    up_T3 = np.sum([points[f"{side}_shoulder"] - points[f"{side}_{low}"] for side in SIDES], axis=0)
    up_T3 = up_T3[np.isfinite(up_T3).all(-1)]
    if not len(up_T3):
        return points, "y up (a guess)"
    axis = named_axis(mean_direction(up_T3))
    trunk_T = np.linalg.norm(sum(points[f"{s}_shoulder"] - points[f"{s}_hip"] for s in SIDES), axis=-1) / 2
    leg = _LEG_OVER_TRUNK * typical(trunk_T)
    if _seen(points, "ankle") and _seen(points, "knee"):
        legs = [_bone(points, f"{s}_hip", f"{s}_knee") + _bone(points, f"{s}_knee", f"{s}_ankle") for s in SIDES]
        leg = float(np.mean(legs))
    unit, name = nearest_unit(leg)
    world_33 = to_y_up(axis)
    return {n: unit * point_T3 @ world_33.T for n, point_T3 in points.items()}, f"{name}, {axis} up"


def _seldom_at_origin(name: str, point_T3: np.ndarray) -> np.ndarray:
    """A point with NaN in the frames in which it is exactly at the origin, if those are few: so trackers write what
    they do not see. The pelvis may be put there in one frame, the first.
    """
    zero_T = (point_T3 == 0).all(-1)
    few = zero_T.mean() < _FEW and zero_T.sum() > (name == "pelvis")
    return np.where(zero_T[:, None], np.nan, point_T3) if few else point_T3


def _is_centred(points: Mapping[str, np.ndarray]) -> bool:
    """Whether the pelvis, or the middle of the hips, is at the origin in all frames: somebody moved it there."""
    middles = [(points["left_hip"] + points["right_hip"]) / 2, *([points["pelvis"]] if "pelvis" in points else [])]
    far = [norm_T[np.isfinite(norm_T)] for norm_T in (np.linalg.norm(middle_T3, axis=-1) for middle_T3 in middles)]
    return any(len(known_T) > 1 and known_T.max() < _CENTRED for known_T in far)


def way_forward(points: Mapping[str, np.ndarray]) -> float:
    """How far nose, toes and bent knees point forward, -1 to 1, for a body whose left is where the names say; 0 where
    nothing tells.
    """
    left_T3 = points["left_hip"] - points["right_hip"]
    up_T3 = sum(points[f"{side}_shoulder"] - points[f"{side}_hip"] for side in SIDES)
    forward_T3 = _unit(np.cross(left_T3, up_T3))
    ways = []
    if "nose" in points:
        for part in ("ear", "shoulder"):
            if all(f"{side}_{part}" in points for side in SIDES):
                way = _unit(points["nose"] - (points[f"left_{part}"] + points[f"right_{part}"]) / 2)
                ways.append(typical((way * forward_T3).sum(-1)))
                break
    for side in SIDES:
        for toe in ("toe", "foot"):
            if f"{side}_{toe}" in points and f"{side}_ankle" in points:
                way = _unit(points[f"{side}_{toe}"] - points[f"{side}_ankle"])
                ways.append(typical((way * forward_T3).sum(-1)))
                break
    for side in SIDES:
        if all(f"{side}_{joint}" in points for joint in ("hip", "knee", "ankle")):
            thigh_T3 = points[f"{side}_knee"] - points[f"{side}_hip"]
            leg_T3 = points[f"{side}_ankle"] - points[f"{side}_hip"]
            along_T3 = _unit(leg_T3)
            off_T3 = thigh_T3 - along_T3 * (thigh_T3 * along_T3).sum(-1, keepdims=True)
            bent_T = np.linalg.norm(off_T3, axis=-1) > _BENT * 2 * np.linalg.norm(thigh_T3, axis=-1)
            ways.append(typical((_unit(off_T3[bent_T]) * forward_T3[bent_T]).sum(-1)))
    known = [way for way in ways if np.isfinite(way)]
    return float(np.mean(known)) if known else 0.0


def _seen(points: Mapping[str, np.ndarray], joint: str) -> bool:
    return all(f"{s}_{joint}" in points and np.isfinite(points[f"{s}_{joint}"]).all(-1).any() for s in SIDES)


def _bone(points: Mapping[str, np.ndarray], start: str, end: str) -> float:
    return typical(np.linalg.norm(points[end] - points[start], axis=-1))


def typical(value_T: np.ndarray) -> float:
    """The median of those that are known; NaN where none is."""
    known_X = value_T[np.isfinite(value_T)]
    return float(np.median(known_X)) if len(known_X) else np.nan


def _some(point_TK3: np.ndarray) -> np.ndarray:
    return point_TK3[:: max(1, len(point_TK3) // _SAMPLES)]


def _unit(vector_T3: np.ndarray) -> np.ndarray:
    return vector_T3 / np.linalg.norm(vector_T3, axis=-1, keepdims=True)
