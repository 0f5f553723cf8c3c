"""How well points fit a body in the order of a set that is known: by the lengths of bones.

Legend: F frames, K keypoints.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from mrhubo.body.joints import SIDES
from mrhubo.motion.readers.keypoint_sets import SETS

_PROPORTIONS = (
    ("knee", "hip", 1.0), ("elbow", "shoulder", 0.83), ("shoulder", "hip", 0.75), ("trunk", "hip", 1.2),
    ("slant", "hip", 1.25),
)  # fmt: skip
"""Bones, by where they start, other bones, and their ratio (Winter, as in `mrhubo.motion.readers.tree.limbs`)."""
_BONES = tuple(
    (side, start, f"{side}_{start}", f"{side}_{end}")
    for side in SIDES
    for start, end in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
)
_TRUNK = (
    *((side, "trunk", f"{side}_shoulder", f"{side}_hip") for side in SIDES),
    *((side, "slant", f"{side}_shoulder", f"{other}_hip") for side, other in (SIDES, SIDES[::-1])),
    *(("", width, f"left_{width}", f"right_{width}") for width in ("shoulder", "hip")),
)
"""Ways between points that hardly change while people move: side, name, and the points."""


_DEVIATIONS = 1.4826
"""Standard deviations in a median distance from the median, which single wild frames do not change."""
NONSENSE = 0.2
"""From this misfit on points are no body in the order of a set: errors of 6 cm a point give 0.14, and a body's points
in an order that is another's 0.2 or more, but for one order in thirty."""
_HEAD_AWAY = 0.35
"""How far a head is from the lowest joint of its spine at least, as a share of the farthest point: in motions 0.41
to 0.47. Rotations of SMPL's joints, which may be laid out as points are, are hardly any in a spine."""
_SPINE_JOINTS = ("spine1", "spine2", "spine3", "neck")
_STRAIGHT, _SHARE = 0.85, 0.05
"""How far the neck is from the lowest joint of the spine at least, as a share of the way along the spine, and how long
each part of that way is: of people in motions 0.97 and 0.13."""
_SPINE_OVER_THIGH, _HIPS_OVER_THIGH, _HIPS_HIGH = (0.5, 1.6), (0.2, 0.8), 1.2
"""How long that way is, how far apart hips are, and how far the pelvis is at most from between them as a share of that;
of the bodies of SMPL's family 1.0 to 1.1, 0.33 to 0.44, and 0.83."""
_PELVIS_AWAY = 0.6
"""How far the pelvis is from between the hips at most, as a share of the way from there to between the shoulders."""
_FLABBY = 0.2
"""Half of the frames are farther from a bone's usual length than this share of it: of points drawn by chance."""


def fitting_sets(point_FK3: np.ndarray) -> list[tuple[float, str]]:
    """The sets of as many points, those that fit a body best first, each with how badly it fits: by how much bones
    change over time, differ from side to side, and from a body's proportions; 0 is perfect, 1 is nonsense.
    """
    fits = [
        (misfit({our: point_FK3[:, place] for place, our in enumerate(points) if our != "-"}), name)
        for name, points in SETS.items()
        if len(points) == point_FK3.shape[1]
    ]
    return sorted(fits)


def misfit(points: Mapping[str, np.ndarray]) -> float:
    """How badly named points (F, 3) fit a body; infinite where limbs are never seen whole, or are as long as
    chance has it.
    """
    found: list[float] = []
    if points.keys() >= {"spine1", "head"} and (_is_short(points) or _has_no_trunk(points)) or _is_headlong(points):
        return np.inf
    with np.errstate(all="ignore"):
        way = {
            (side, name): np.linalg.norm(points[start] - points[end], axis=-1)
            for side, name, start, end in (*_BONES, *_TRUNK)
        }
        seen = {key: length_F[np.isfinite(length_F) & (length_F > 0)] for key, length_F in way.items()}
        mean = {key: float(np.median(length_F)) for key, length_F in seen.items() if len(length_F)}
        spread = {key: float(np.median(np.abs(seen[key] - mean[key])) / mean[key]) for key in mean}
        bones = [spread[side, name] for side, name, *_ in _BONES if (side, name) in spread]
        if not bones or np.mean(bones) > _FLABBY:
            return np.inf
        found += [_DEVIATIONS * part for part in spread.values()]
        for name in ("shoulder", "elbow", "hip", "knee", "trunk", "slant"):
            if ("left", name) in mean and ("right", name) in mean:
                found.append(abs(float(np.log(mean["left", name] / mean["right", name]))))
        for side in SIDES:
            for name, other, ratio in _PROPORTIONS:
                if (side, name) in mean and (side, other) in mean:
                    found.append(abs(float(np.log(mean[side, name] / mean[side, other] / ratio))))
    return float(np.mean(np.minimum(found, 2.0)))


def _has_no_trunk(points: Mapping[str, np.ndarray]) -> bool:
    """Whether spine and hips cannot be those of a body with SMPL's joints, in the middle of the frames: rotations of
    its joints, which may be laid out as points are, often cannot.
    """
    if not points.keys() >= {*_SPINE_JOINTS, "pelvis", "left_hip", "right_hip", "left_knee", "right_knee"}:
        return False

    def far(one_F3: np.ndarray, other_F3: np.ndarray) -> np.ndarray:
        return np.linalg.norm(one_F3 - other_F3, axis=-1)

    part_NF = np.stack([far(points[one], points[other]) for one, other in pairwise(_SPINE_JOINTS)])
    way_F = part_NF.sum(axis=0)
    left_F3, right_F3 = points["left_hip"], points["right_hip"]
    width_F = far(left_F3, right_F3)
    thigh_F = (far(left_F3, points["left_knee"]) + far(right_F3, points["right_knee"])) / 2
    with np.errstate(all="ignore"):
        straight = np.nanmedian(far(points[_SPINE_JOINTS[0]], points[_SPINE_JOINTS[-1]]) / way_F)
        share = np.nanmedian(part_NF.min(axis=0) / way_F)
        spine, hips = np.nanmedian(way_F / thigh_F), np.nanmedian(width_F / thigh_F)
        high = np.nanmedian(far((left_F3 + right_F3) / 2, points["pelvis"]) / width_F)
    if np.isnan([straight, share, spine, hips, high]).any():  # something is never seen
        return False
    return not (
        straight > _STRAIGHT
        and share > _SHARE
        and _SPINE_OVER_THIGH[0] < spine < _SPINE_OVER_THIGH[1]
        and _HIPS_OVER_THIGH[0] < hips < _HIPS_OVER_THIGH[1]
        and high < _HIPS_HIGH
    )


def _is_headlong(points: Mapping[str, np.ndarray]) -> bool:
    """Whether the pelvis is far from the hips in the middle of the frames; in an order from the head it may be that."""
    if not points.keys() >= {"pelvis", *(f"{side}_{joint}" for side in SIDES for joint in ("shoulder", "hip"))}:
        return False
    hips_F3, shoulders_F3 = ((points[f"left_{joint}"] + points[f"right_{joint}"]) / 2 for joint in ("hip", "shoulder"))
    with np.errstate(all="ignore"):
        share_F = np.linalg.norm(points["pelvis"] - hips_F3, axis=-1) / np.linalg.norm(shoulders_F3 - hips_F3, axis=-1)
    seen_F = share_F[np.isfinite(share_F)]
    return bool(len(seen_F)) and float(np.median(seen_F)) > _PELVIS_AWAY


def _is_short(points: Mapping[str, np.ndarray]) -> bool:
    """Whether the head is too near to `spine1`, in the middle of the frames in which both are seen."""
    head_F = np.linalg.norm(points["head"] - points["spine1"], axis=-1)
    seen_F = np.isfinite(head_F)
    if not seen_F.any():
        return False
    way_FK = np.linalg.norm(np.stack([*points.values()], axis=1) - points["spine1"][:, None], axis=-1)[seen_F]
    return float(np.median(head_F[seen_F])) < _HEAD_AWAY * float(np.median(np.nanmax(way_FK, axis=1)))
