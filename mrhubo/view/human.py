"""A human as solids: flesh around named joint centres.

Every part is a list of tapered capsules whose ends are written in the local frame of the part (left, up, forward), for
an adult whose bones have the lengths in ``_BONES``; a figure with other bones gets flesh in proportion. A part needs
only the points that it is built from: where one is missing, the part is left out or put up with less.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrhubo.frames import human_to_world
from mrhubo.view.limbs import Points, Row, arm, at, foot, frame, hand, leg, pelvis_frame, unit
from mrhubo.view.solids import Color, Solids

HUMAN_COLOR: Color = (0.33, 0.50, 0.72)
"""Default colour of what a human wears."""
SKIN_COLOR: Color = (0.88, 0.69, 0.57)
HAIR_COLOR: Color = (0.27, 0.20, 0.16)

_BONES = {
    ("hip", "knee"): 0.41,
    ("knee", "ankle"): 0.43,
    ("shoulder", "elbow"): 0.30,
    ("elbow", "wrist"): 0.26,
}
"""Lengths (m) of the adult for whom the radii below are meant."""
_EYE_PITCH = np.radians(36.0)
"""How far above straight ahead the point between the eyes lies, seen from the head's joint."""

_HIP_SECTIONS = ((-0.085, 0.004, 0.163, 0.108), (0.0, 0.004, 0.157, 0.104), (0.075, 0.010, 0.144, 0.098))
_CHEST_SECTIONS = ((-0.03, 0.016, 0.152, 0.104), (0.05, 0.014, 0.163, 0.106), (0.12, -0.004, 0.128, 0.08))
"""Elliptical sections of the trunk: height above pelvis and spine3, distance forward, half width, half depth, m."""

_CHEST_UP = (("spine3", "neck"), ("spine2", "neck"), ("pelvis", "neck"), ("neck", "head"), ("spine2", "spine3"))
"""Pairs of points that tell where up is, best first."""

Section = tuple[np.ndarray, np.ndarray, float, float]
"""An elliptical section: centre, direction of the left, half width, half depth."""
Offset = tuple[float, float, float]
"""Left, up, forward from the head's joint, m."""


def human_solids(
    positions_P3: np.ndarray,
    names: Sequence[str],
    color: Color = HUMAN_COLOR,
    skin: Color | None = SKIN_COLOR,
) -> Solids:
    """A human figure from named points.

    ``positions_P3``: (P, 3), m, human frame (x to the body's left, y up, z forward). ``names``: P names: SMPL's 22
    joints, and optionally left_/right_ eye, thumb, index, middle, pinky (knuckles), toe, heel; other names are
    ignored, a missing one only leaves its part out. ``color``: RGB, 0..1, of the clothes. ``skin``: of head and hands;
    None: everything is in ``color``, like a mannequin. The result is in the world frame (x forward, y left, z up).
    """
    positions_P3 = np.asarray(positions_P3, float)
    if positions_P3.shape != (len(names), 3):
        raise ValueError(
            f"human_solids: positions have shape {positions_P3.shape}, need ({len(names)}, 3): one row a name"
        )
    bad = [name for name, point in zip(names, positions_P3, strict=True) if not np.isfinite(point).all()]
    if bad:
        raise ValueError(f"human_solids: positions are not finite: {', '.join(bad)}")
    points = dict(zip(names, human_to_world(positions_P3), strict=True))
    scale = _scale(points)
    (shirt, trousers), bare, shoes = _torso(points, scale), _neck(points, scale), []
    for side in ("left", "right"):
        shirt += arm(points, side, scale)
        trousers += leg(points, side, scale)
        bare += hand(points, side, scale)
        shoes += foot(points, side, scale)
    face, hair, eyes = _head(points, scale)
    darker, dark = _dim(color, 0.62), _dim(color, 0.35)
    return Solids.concatenate(
        [
            Solids.capsules(shirt, color),
            Solids.capsules(trousers, darker if skin else color),
            Solids.capsules(shoes, dark if skin else color),
            Solids.capsules(bare + face, skin or color),
            Solids.capsules(hair, HAIR_COLOR if skin else color),
            Solids.capsules(eyes, (0.16, 0.13, 0.12) if skin else dark),
        ]
    )


def _dim(color: Color, factor: float) -> Color:
    return factor * color[0], factor * color[1], factor * color[2]


def _scale(points: Points) -> float:
    """The figure's size: the median of its limbs' lengths over the adult's."""
    ratios = [
        float(np.linalg.norm(points[f"{side}_{start}"] - points[f"{side}_{end}"])) / length
        for (start, end), length in _BONES.items()
        for side in ("left", "right")
        if f"{side}_{start}" in points and f"{side}_{end}" in points
    ]
    scale = float(np.median(ratios)) if ratios else 1.0
    return scale if scale > 1e-3 else 1.0


def _chest_frame(points: Points) -> np.ndarray | None:
    """Left, up, forward of the chest, from the points that it holds."""
    for left, right in (("left_collar", "right_collar"), ("left_shoulder", "right_shoulder")):
        for low, high in _CHEST_UP:
            if {left, right, low, high} <= points.keys():
                return frame(points[high] - points[low], points[left] - points[right])
    return None


def _torso(points: Points, scale: float) -> tuple[list[Row], list[Row]]:
    """Shirt and trousers without sleeves and legs: elliptical sections joined one to the next, then the shoulders."""
    pelvis, chest = pelvis_frame(points), _chest_frame(points)
    hips: list[Section] = []
    trunk: list[Section] = []
    if pelvis is not None:
        for up, forward, width, depth in _HIP_SECTIONS:
            hips.append((at(points["pelvis"], pelvis, scale, 0, up, forward), pelvis[:, 0], width, depth))
        trunk.append(hips[-1])
    if chest is not None and "spine3" in points:
        for up, forward, width, depth in _CHEST_SECTIONS:
            trunk.append((at(points["spine3"], chest, scale, 0, up, forward), chest[:, 0], width, depth))
    shirt, trousers = _loft(trunk, scale), _loft(hips, scale)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        shoulder = points.get(f"{side}_shoulder")
        if chest is None or shoulder is None:
            continue
        inner = at(shoulder, chest, scale, -0.03 * sign, -0.006, 0.0)
        if "neck" in points:
            base = at(points["neck"], chest, scale, 0.02 * sign, -0.022, -0.012)
            shirt.append((base, inner, 0.055 * scale, 0.056 * scale))
        if "spine3" in points:
            breast = at(points["spine3"], chest, scale, 0.075 * sign, 0.055, 0.012)
            shirt.append((breast, inner, 0.088 * scale, 0.056 * scale))
    return shirt, trousers


def _loft(sections: list[Section], scale: float) -> list[Row]:
    """Capsules that fill the space between elliptical sections, each to the next."""
    rows: list[Row] = []
    for low, high in zip(sections, sections[1:], strict=False):
        for place in (-1.0, -0.55, 0.0, 0.55, 1.0):
            (start, radius), (end, end_radius) = _inscribed(low, place, scale), _inscribed(high, place, scale)
            rows.append((start, end, radius, end_radius))
    return rows


def _inscribed(section: Section, place: float, scale: float) -> tuple[np.ndarray, float]:
    """Centre and radius of a sphere inside an elliptical section, at its edge; ``place``: -1..1, right to left."""
    centre, left, width, depth = section
    # a circle inside an ellipse touches it at two points up to this offset, beyond it only at the tip
    offset = place * (width * width - depth * depth) / width
    radius = depth * np.sqrt(1.0 - offset * offset / (width * width - depth * depth))
    return centre + scale * offset * left, float(scale * radius)


def _neck(points: Points, scale: float) -> list[Row]:
    if not {"neck", "head"} <= points.keys():
        return []
    return [(points["neck"], points["head"], 0.057 * scale, 0.053 * scale)]


def _head(points: Points, scale: float) -> tuple[list[Row], list[Row], list[Row]]:
    """Face, hair; and, where the eyes are given, the eyes."""
    if "head" not in points:
        return [], [], []
    origin = points["head"]
    skull: np.ndarray | None = None
    eyes = [points[name] for name in ("left_eye", "right_eye") if name in points]
    if len(eyes) == 2:
        left = unit(eyes[0] - eyes[1])
        ahead = 0.5 * (eyes[0] + eyes[1]) - origin
        ahead = unit(ahead - left * (ahead @ left))
        up = np.cross(ahead, left)  # at right angles to the line from joint to eyes: tilt it back by that line's pitch
        skull = frame(np.cos(_EYE_PITCH) * up + np.sin(_EYE_PITCH) * ahead, left)
    else:
        chest = _chest_frame(points)
        if chest is not None:
            up = origin - points["neck"] if "neck" in points else chest[:, 1]
            skull = frame(up, chest[:, 0])
    if skull is None:
        return [(origin, origin, 0.1 * scale, 0.1 * scale)], [], []

    def row(start: Offset, end: Offset, radius: float, end_radius: float) -> Row:
        return at(origin, skull, scale, *start), at(origin, skull, scale, *end), radius * scale, end_radius * scale

    face = [
        row((0, 0.105, 0.006), (0, 0.085, 0.022), 0.082, 0.078),
        row((0, 0.085, 0.022), (0, 0.0, 0.056), 0.078, 0.036),
        row((0, 0.055, 0.093), (0, 0.034, 0.110), 0.008, 0.013),
    ]
    hair = [
        row((0, 0.122, 0.008), (0, 0.112, -0.022), 0.082, 0.086),
        row((0, 0.105, -0.024), (0, 0.045, -0.030), 0.084, 0.058),
    ]
    pupils: list[Row] = []
    for sign in (1.0, -1.0):
        face.append(row((0.078 * sign, 0.066, 0.008), (0.08 * sign, 0.046, 0.012), 0.017, 0.012))
        if len(eyes) == 2:
            pupils.append(row((0.031 * sign, 0.07, 0.083), (0.031 * sign, 0.07, 0.083), 0.0125, 0.0125))
    return face, hair, pupils
