"""Balls that stand for what shapes touch the floor with: a capsule is two, a box its corners, a cylinder points on its
rims, a mesh its outermost vertices. Corners, points and vertices have no radius.

Legend: K balls, centres and radii [m].
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrhubo.robot.hulls import all_around
from mrhubo.robot.shapes import LinkGeometry

_RIM = 8
"""Points that stand for the round edge of a cylinder."""


def balls_of(shape: LinkGeometry) -> np.ndarray:
    """The balls (K, 4) of a shape, in its own frame."""
    if shape.kind == "sphere":
        return np.array([[0.0, 0.0, 0.0, shape.size[0]]])
    if shape.kind == "capsule":
        return np.array([[0.0, 0.0, side * shape.size[1], shape.size[0]] for side in (-0.5, 0.5)])
    return points(np.array(list(_corners(shape))))


def outermost(balls_K4: np.ndarray, most: int) -> np.ndarray:
    """Those of some balls (K, 4) that reach farthest in so many directions all around: at most as many."""
    reach_KF = balls_K4[:, :3] @ all_around(most) + balls_K4[:, 3:]
    return balls_K4[np.unique(reach_KF.argmax(axis=0))]


def points(places_K3: np.ndarray) -> np.ndarray:
    """Places as balls (K, 4) with no radius."""
    return np.concatenate((places_K3, np.zeros((len(places_K3), 1))), axis=1)


def placed(balls_K4: np.ndarray, pose_44: np.ndarray) -> np.ndarray:
    """Balls (K, 4) in the frame in which their own is there and so."""
    return np.concatenate((balls_K4[:, :3] @ pose_44[:3, :3].T + pose_44[:3, 3], balls_K4[:, 3:]), axis=1)


def _corners(shape: LinkGeometry) -> Iterator[tuple[float, float, float]]:
    if shape.kind == "box":
        x, y, z = (0.5 * side for side in shape.size)
        yield from ((i * x, j * y, k * z) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1))
    else:
        radius, length = shape.size
        for angle in 2 * np.pi * np.arange(_RIM) / _RIM:
            yield from ((radius * np.cos(angle), radius * np.sin(angle), side * length) for side in (-0.5, 0.5))
