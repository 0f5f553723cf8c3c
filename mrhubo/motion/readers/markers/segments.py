"""Human motions from the segments of a body in C3D files, as Theia3D and other programs without markers write them.

A segment begins at the joint nearer to the trunk. In Visual3D's convention, of who stands with hanging arms and palms
turned forward, its axes are x to the right, y forward and z up, along the limb: that is looked at, by where limbs go,
and hands, head, feet and chest are turned as their segments only where limbs keep to it. Without that, joints alone
tell (Theia3D, "Theia Model Description", https://docs.theiamarkerless.com).

Legend: T frames, S segments.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from mrhubo.body.joints import SIDES
from mrhubo.fast.plain.human import normalize
from mrhubo.motion.gaps import fill_directions
from mrhubo.motion.motion import Motion
from mrhubo.motion.orientations import known_frames
from mrhubo.motion.positions import BodyPoints, motion_from_points
from mrhubo.motion.readers.keypoint_arrays import Keypoints
from mrhubo.motion.readers.keypoints import rate_of_points, refuse_far, to_world, typical
from mrhubo.motion.readers.markers.c3d_file import Segments
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.point_names import NEEDED
from mrhubo.motion.readers.tracks import check_span

_LIMBS = {
    "collar": "clavicle collar", "shoulder": "uarm upperarm uparm humerus", "elbow": "larm lowerarm forearm radius",
    "wrist": "hand", "hip": "thigh upleg upperleg femur", "knee": "shank shin calf tibia lowerleg lleg",
    "ankle": "foot", "foot": "toes toe",
}  # fmt: skip
"""Our joint where a segment begins, and what segments are called, without their side."""
_TRUNK = {"pelvis": "pelvis", "spine3": "torso thorax trunk chest", "neck": "neck", "head": "head"}
_LEFT, _RIGHT = ("left", "l"), ("right", "r")
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
_END = re.compile(r"_?4x4$", re.IGNORECASE)
_BONES = {"shoulder": "elbow", "elbow": "wrist", "hip": "knee", "knee": "ankle"}
_ALONG = np.radians(20.0)
"""How far limbs may be from their segments' axes: joints of Theia's bend beside them by less."""
_UPRIGHT = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
"""From our axes, x left, y up and z forward, to those of a segment that stands as the world does (3, 3)."""
_HAND = {
    "left": np.array([[0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]]),
    "right": np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]),
}
"""The same of a hand: in our rest pose arms are held out with palms down, and a segment's z goes up the arm, its y out
of the palm."""


def joints_of(names: Sequence[str]) -> dict[str, int]:
    """Our joints at which segments begin, or of the trunk those that they carry, by place."""
    found: dict[str, int] = {}
    for place, name in enumerate(names):
        if (joint := _joint(name)) is not None:
            found.setdefault(joint, place)
    return found


def has_segments(names: Sequence[str]) -> bool:
    """Whether names are of the segments of a body: upper arms and thighs at least."""
    return joints_of(names).keys() >= set(NEEDED)


def motion_of_segments(path: Path, found: Segments, notes: list[str], options: ReadOptions) -> Motion:
    """The motion of a body by its segments.

    Args:
        path: the file.
        found: segments, whose names `has_segments`.
        notes: what there is to say so far.
        options: may tell the rate.

    Raises:
        UserError: nobody is seen, or not often enough, or the rate is not known.
    """
    places = joints_of(found.names)
    file = Keypoints(found.place_TS3[:, list(places.values())], list(places), None, found.rate, "the C3D file", notes)
    refuse_far(path, file)
    rate = rate_of_points(path, file, options)
    seen_T = np.all([np.isfinite(found.place_TS3[:, places[name]]).all(-1) for name in NEEDED], axis=0)
    check_span(path, int(seen_T.sum()), len(seen_T))
    points = {name: found.place_TS3[:, place] for name, place in places.items()}
    # Axes are seen from the file's world too, so whatever turns points turns them.
    axes = {(name, k): found.turn_TS33[:, place, :, k] for name, place in places.items() for k in range(3)}
    moved, world = to_world({**points, **{f"{name}/{k}": axis_T3 for (name, k), axis_T3 in axes.items()}}, notes)
    points = {name: moved[name] for name in points}
    turns = {name: np.stack([normalize(moved[f"{name}/{k}"]) for k in range(3)], axis=-1) for name in points}
    as_visual3d = _keeps_to_convention(points, turns)
    body = _body(points, turns) if as_visual3d else BodyPoints(_without_trunk(points))
    axes_are = "turned as their axes are" if as_visual3d else "joints alone, as axes are not along limbs"
    source = f"C3D file, {len(places)} of {len(found.names)} segments taken by their names, {axes_are}, {world}"
    return motion_from_points(body, motion_name(path), rate, source, tuple(notes), str(path))


def _joint(name: str) -> str | None:
    """Our joint of a segment `l_thigh_4X4`, `LeftThigh`, `Ann:left thigh`."""
    words = [word.lower() for word in _WORD.findall(_END.sub("", name.rpartition(":")[2].strip()))]
    side = next((our for our, theirs in zip(SIDES, (_LEFT, _RIGHT), strict=True) if set(words) & set(theirs)), None)
    rest = "".join(word for word in words if word not in (*_LEFT, *_RIGHT))
    table = _TRUNK if side is None else _LIMBS
    joint = next((our for our, theirs in table.items() if rest in theirs.split()), None)
    return joint if joint is None or side is None else f"{side}_{joint}"


def _keeps_to_convention(points: Mapping[str, np.ndarray], turns: Mapping[str, np.ndarray]) -> bool:
    """Whether segments' z axes go up their limbs, in the middle of all frames, and axes are those of a right hand."""
    off = [
        typical(_angle(points[f"{side}_{start}"] - points[f"{side}_{end}"], turns[f"{side}_{start}"][..., 2]))
        for side in SIDES
        for start, end in _BONES.items()
        if f"{side}_{start}" in points and f"{side}_{end}" in points
    ]
    across_T3 = points["right_hip"] - points["left_hip"]
    off += [typical(_angle(across_T3, turns["pelvis"][..., 0]))] if "pelvis" in turns else []
    signs = np.linalg.det(np.nan_to_num(turns["left_hip"]))
    return bool(off) and max(off, default=np.inf) < _ALONG and not (signs < 0).any()


def _body(points: Mapping[str, np.ndarray], turns: Mapping[str, np.ndarray]) -> BodyPoints:
    """The body of segments whose axes are Visual3D's."""
    turned = {name: turns[name] @ _UPRIGHT for name in _TRUNK if name in turns}
    hinges: dict[str, np.ndarray] = {}
    for side in SIDES:
        if f"{side}_wrist" in turns:
            turned[f"{side}_wrist"] = turns[f"{side}_wrist"] @ _HAND[side]
        if f"{side}_ankle" in turns:
            turned[f"{side}_ankle"] = turns[f"{side}_ankle"] @ _UPRIGHT
        for joint, bends in (("shoulder", 1.0), ("hip", -1.0)):
            axis_T3 = bends * turns[f"{side}_{joint}"][..., 0]
            known_T = known_frames(axis_T3)
            hinges[f"{side}_{joint}"] = fill_directions(np.nan_to_num(axis_T3), known_T)
    return BodyPoints(_without_trunk(points), turned, hinges)


def _without_trunk(points: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Points of limbs: those of the trunk's segments begin elsewhere than our joints."""
    return {name: point_T3 for name, point_T3 in points.items() if name not in _TRUNK}


def _angle(one_T3: np.ndarray, other_T3: np.ndarray) -> np.ndarray:
    cosine_T = (normalize(one_T3) * other_T3).sum(-1)
    return np.arccos(np.clip(cosine_T, -1.0, 1.0))
