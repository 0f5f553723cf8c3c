"""Capsules: what shapes become, and where two of them are nearest."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from mrhubo.robot.shapes import LinkGeometry

SHORT = 1e-9
_MOST_BESIDE = 3
"""Capsules of a box or a disc: pairs grow with their square."""
_OUT_SHARE, _OUT_M = 0.25, 0.003
"""How far a capsule may stick out of a face, as a share of half the thickness, or in metres, and no more are needed."""
_OUT = 0.7
"""How far capsules stick out of faces for each metre that edges and corners stick out of them. So they take up as much
room as the shape, within a tenth, and do not count more poses as touching than it would."""
_ROUNDS = 20
Capsule = tuple[np.ndarray, np.ndarray, float]
"""The ends (3,) of its axis and its radius, all in m."""


def closest_points(a_23: Tensor, b_23: Tensor) -> tuple[Tensor, Tensor]:
    """The points (..., 3) where segments a and b (..., 2, 3) are nearest; a segment may be a point.

    C. Ericson, Real-Time Collision Detection (2005), section 5.1.9, without branches.
    """
    start_a, start_b = a_23[..., 0, :], b_23[..., 0, :]
    along_a, along_b, r = a_23[..., 1, :] - start_a, b_23[..., 1, :] - start_b, start_a - start_b
    a, e, b = along_a.square().sum(-1), along_b.square().sum(-1), (along_a * along_b).sum(-1)
    c, f = (along_a * r).sum(-1), (along_b * r).sum(-1)
    safe_a, safe_e = a.clamp_min(SHORT), e.clamp_min(SHORT)
    # Nearly parallel segments have no one answer; any point of a will do, the other end follows from it.
    determinant = a * e - b * b
    s = torch.where(determinant > 1e-7 * a * e, (b * f - c * e) / determinant.clamp_min(SHORT * SHORT), 0.0)
    t = ((b * s.clamp(0, 1) + f) / safe_e).clamp(0, 1)
    s = ((b * t - c) / safe_a).clamp(0, 1)
    t = ((b * s + f) / safe_e).clamp(0, 1)
    return start_a + s[..., None] * along_a, start_b + t[..., None] * along_b


def capsules(shape: LinkGeometry, pose_44: np.ndarray) -> list[Capsule]:
    """Capsules (start (3,), end (3,), radius) that hug a shape whose centre is at the pose.

    Spheres and capsules are what they are. Of flat-ended cylinders and boxes, capsules stick out of the faces, and
    edges and corners out of the capsules: a few millimetres, where a robot's parts are round and their boxes are not.
    """
    found = {"box": _of_box, "cylinder": _of_cylinder}.get(shape.kind, _of_capsule)(shape.size)
    return [(pose_44[:3, :3] @ start_3 + pose_44[:3, 3], pose_44[:3, :3] @ end_3 + pose_44[:3, 3], radius)
            for start_3, end_3, radius in found]  # fmt: skip


def _of_capsule(size: Sequence[float]) -> list[Capsule]:
    half = 0.5 * size[1] if len(size) == 2 else 0.0
    return [_along(2, half, np.zeros(3), size[0])]


def _of_cylinder(size: Sequence[float]) -> list[Capsule]:
    """One capsule along a long cylinder; of a flat one, some across, side by side as chords of the disc."""
    radius, length = size
    inset = _inset(radius, radius)
    if length >= 2 * inset:
        return [_along(2, 0.5 * length - inset, np.zeros(3), radius)]
    thick, places = _side_by_side(radius, 0.5 * length)
    inset = _inset(thick, 0.5 * length)
    return [_along(0, math.sqrt(max(radius**2 - y**2, 0.0)) - inset, np.array([0.0, y, 0.0]), thick) for y in places]


def _of_box(size: Sequence[float]) -> list[Capsule]:
    """Capsules along the longest side, side by side across the next."""
    thin, wide, long = np.argsort(size)
    thick, places = _side_by_side(0.5 * size[wide], 0.5 * size[thin])
    inset = _inset(thick, math.hypot(0.5 * size[wide] - places[-1], 0.5 * size[thin]))
    return [_along(long, 0.5 * size[long] - inset, place * np.eye(3)[wide], thick) for place in places]


def _along(axis: int, half: float, centre_3: np.ndarray, radius: float) -> Capsule:
    """A capsule along an axis; of no length, a sphere."""
    half_3 = max(0.0, half) * np.eye(3)[axis]
    return centre_3 - half_3, centre_3 + half_3, radius


def _side_by_side(wide: float, thin: float) -> tuple[float, list[float]]:
    """Radius and places of capsules side by side in a slab of half width `wide` and half thickness `thin`: as few as
    stick out little, three at most.
    """
    radius, places = 0.0, [0.0]
    for count in range(1, _MOST_BESIDE + 1):
        radius, places = _beside(count, wide, thin)
        if radius - thin <= max(_OUT_SHARE * thin, _OUT_M):
            break
    return radius, places


def _beside(count: int, wide: float, thin: float) -> tuple[float, list[float]]:
    """The radius and the places of a number of capsules: between two of them they leave out as much as at the edges."""
    if count == 1:
        return _between(thin, math.hypot(wide, thin)), [0.0]
    radius = thin
    outer = 0.0
    for _ in range(_ROUNDS):
        outer = max(0.0, wide - _inset(radius, thin))
        radius = _between(thin, math.hypot(outer / (count - 1), thin))
    return radius, [float(place) for place in np.linspace(-outer, outer, count)]


def _between(face: float, edge: float) -> float:
    """The radius that sticks out of a face, so far from the axis, by a share of what it leaves out of an edge."""
    return (face + _OUT * edge) / (1 + _OUT)


def _inset(radius: float, edge: float) -> float:
    """How far before a face a capsule's axis ends, so that its round end sticks out of the face by that share of what
    it leaves out of an edge of the face, `edge` from the axis: radius - x = share * (sqrt(x^2 + edge^2) - radius).
    """
    sum_, rest = radius * (1 + _OUT), 1 - _OUT**2
    return (sum_ - math.sqrt(max(sum_**2 - rest * (sum_**2 - (_OUT * edge) ** 2), 0.0))) / rest
