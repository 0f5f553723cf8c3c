"""Capsules that hug a mesh: what a collision mesh becomes.

A mesh is taken as its convex hull, as most programs for physics take it. Of boxes, cylinders, capsules and balls along
the sides of the smallest box around it, in some sizes, the one whose capsules share most room with it is where a fit
begins (`mrhubo.robot.hugging`); others begin with parts of the hull, which may be more.

Legend: V vertices, H corners of the hull, X points in the room around it, F flat sides, C capsules.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from mrhubo.robot.capsules import Capsule, capsules
from mrhubo.robot.hugging import Surface, parted
from mrhubo.robot.shapes import ROBOT_COLOR, LinkGeometry

_DIRECTIONS = 1_000
"""Directions in which the farthest vertex is looked for: 6 degrees from each other, which leaves out 0.2% of a ball's
radius, however many vertices there are."""
_POINTS = 3_000
"""Points that tell how much room is shared: to one or two percent."""
_MANY, _CELLS = 300_000, 100
"""Vertices from which on only the outermost are looked at, and cells of the grid along an axis."""
_AT_ONCE = 2**24
_SIZES = (1.0, 0.95, 0.9, 0.85, 0.8, 0.75, 0.7)
"""Of the shape that just holds the hull; at the least, a ball in a cube is much smaller than what holds the cube."""
MOST_CAPSULES = 4
_WORTH = 0.015
"""By how much more room one more capsule must share: pairs grow with the square of their number."""
_PARTED = 1_000
"""Points inside that are parted."""
_THIN = 1e-4
"""What is thinner [m] is given this thickness: a sheet has no room to be shared."""


def capsules_of(vertices_V3: np.ndarray, most: int = MOST_CAPSULES) -> list[Capsule]:
    """Capsules (start (3,), end (3,), radius [m]), so many at most, that hug the convex hull of vertices (V, 3) [m]."""
    turn_33, low_3, high_3 = smallest_box(corners_H3 := extremes(vertices_V3))
    middle_3 = turn_33 @ (low_3 + high_3) / 2
    half_3 = np.maximum((high_3 - low_3) / 2, _THIN / 2)
    local_H3 = (corners_H3 - middle_3) @ turn_33
    unit_X3 = np.random.default_rng(0).uniform(-1, 1, (_POINTS, 3))
    points_X3 = unit_X3 * half_3
    hull = _hull(local_H3)
    inside_X3 = points_X3[_inside(points_X3, hull, half_3)]
    room = 8 * float(half_3.prod()) * len(inside_X3) / _POINTS
    found = [capsules(shape, shape.origin_44) for shape in _candidates(local_H3, half_3)]
    found = [some for some in found if len(some) <= most]
    shared = [_shared(some, inside_X3, room, unit_X3) for some in found]
    first = int(np.argmax(shared))
    fitted = _fitted(found[first], hull, inside_X3, most)
    worth = [_shared(some, inside_X3, room, unit_X3) - _WORTH * len(some) for some in fitted]
    best = max(zip(worth, fitted, strict=True), key=lambda pair: pair[0], default=(-np.inf, []))
    chosen = best[1] if best[0] > shared[first] - _WORTH * len(found[first]) else found[first]
    return [(turn_33 @ start_3 + middle_3, turn_33 @ end_3 + middle_3, radius) for start_3, end_3, radius in chosen]


def _hull(points_X3: np.ndarray) -> ConvexHull | None:
    """The convex hull of points; None where they have no room."""
    try:
        return ConvexHull(points_X3)
    except (QhullError, ValueError):
        return None


def _fitted(found: list[Capsule], hull: ConvexHull | None, inside_X3: np.ndarray, most: int) -> list[list[Capsule]]:
    """Capsules that are fitted to a hull: those that were found, and others; none where it has no room."""
    if hull is None:
        return []
    try:
        surface = Surface(hull)
    except ValueError:  # so small that its areas are 0
        return []
    others = [parted(inside_X3[:_PARTED], count) for count in range(2, most + 1)]
    return [surface.fitted(some) for some in (found, *others) if some]


def extremes(vertices_V3: np.ndarray) -> np.ndarray:
    """The vertices (H, 3) that lie farthest in directions all around."""
    vertices_V3 = _corners(_outermost(vertices_V3) if len(vertices_V3) > _MANY else vertices_V3)
    directions_3 = all_around(_DIRECTIONS)
    size = _AT_ONCE // _DIRECTIONS
    best, chosen = np.full(_DIRECTIONS, -np.inf), np.zeros(_DIRECTIONS, int)
    for first in range(0, len(vertices_V3), size):
        along = vertices_V3[first : first + size] @ directions_3
        farthest = along.argmax(axis=0)
        found = along[farthest, np.arange(_DIRECTIONS)]
        chosen, best = np.where(found > best, farthest + first, chosen), np.maximum(found, best)
    return vertices_V3[np.unique(chosen)]


def all_around(count: int) -> np.ndarray:
    """Directions (3, count) all around, evenly (R. Swinbank and R. J. Purser, 2006)."""
    number = np.arange(count) + 0.5
    height, turn = 1 - 2 * number / count, np.pi * (1 + 5**0.5) * number
    across = np.sqrt(1 - height**2)
    return np.stack((across * np.cos(turn), across * np.sin(turn), height))


def _corners(vertices_V3: np.ndarray) -> np.ndarray:
    """The vertices at the corners of their convex hull, which are few; all that differ, where they have no room."""
    vertices_V3 = np.unique(vertices_V3, axis=0)
    hull = _hull(vertices_V3)
    return vertices_V3 if hull is None else vertices_V3[hull.vertices]


def _outermost(vertices_V3: np.ndarray) -> np.ndarray:
    """Of very many vertices the lowest and the highest in each cell of a grid, seen along each axis: what is left out
    is at most a cell's width farther out than they are.
    """
    low_3, size_3 = vertices_V3.min(axis=0), np.ptp(vertices_V3, axis=0).clip(_THIN)
    cell_V3 = np.minimum(((vertices_V3 - low_3) / size_3 * _CELLS).astype(np.int64), _CELLS - 1)
    kept = []
    for axis in range(3):
        across_V = cell_V3[:, axis - 1] * _CELLS + cell_V3[:, axis - 2]
        order_V = np.lexsort((vertices_V3[:, axis], across_V))
        change = np.flatnonzero(np.diff(across_V[order_V]))
        kept += [order_V[change], order_V[change + 1], order_V[[0, -1]]]
    return vertices_V3[np.unique(np.concatenate(kept))]


def smallest_box(corners_H3: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Axes (3, 3) as columns, right-handed, of a small box around points (H, 3), and its ends (3,) along them.

    The smallest box has a side flat on the hull (J. O'Rourke, 1985), nearly always: of every flat side of the hull as
    its base, the smallest one counts, turned as the edges of the hull's shadow on it are.
    """
    best: tuple[float, np.ndarray] = (np.inf, np.linalg.svd(corners_H3 - corners_H3.mean(axis=0))[2].T)
    for normal_3 in _sides(corners_H3):
        first_3 = np.linalg.svd(normal_3[None])[2][1]
        base_33 = np.stack((first_3, np.cross(normal_3, first_3), normal_3), axis=1)
        shadow_H3 = corners_H3 @ base_33
        angles = np.linspace(0, np.pi / 2, 36, endpoint=False)
        wide = np.ptp(np.outer(np.cos(angles), shadow_H3[:, 0]) + np.outer(np.sin(angles), shadow_H3[:, 1]), axis=1)
        deep = np.ptp(np.outer(np.cos(angles), shadow_H3[:, 1]) - np.outer(np.sin(angles), shadow_H3[:, 0]), axis=1)
        room = wide * deep * np.ptp(shadow_H3[:, 2])
        if room.min() < best[0] * (1 - 1e-6):
            c, s = np.cos(angles[room.argmin()]), np.sin(angles[room.argmin()])
            best = room.min(), base_33 @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    turn_33 = best[1] * np.array([1.0, 1.0, np.sign(np.linalg.det(best[1]))])
    along_H3 = corners_H3 @ turn_33
    return turn_33, along_H3.min(axis=0), along_H3.max(axis=0)


def _sides(corners_H3: np.ndarray) -> np.ndarray:
    """The directions (F, 3) across the largest flat sides of a hull, and of its middle axes; of what is flat, these
    alone.
    """
    axes_33 = np.linalg.svd(corners_H3 - corners_H3.mean(axis=0))[2]
    if (hull := _hull(corners_H3)) is None:
        return axes_33
    edges_F23 = corners_H3[hull.simplices[:, 1:]] - corners_H3[hull.simplices[:, :1]]
    normals_F3 = hull.equations[:, :3]
    _, number_F = np.unique(np.round(normals_F3, 2), axis=0, return_inverse=True)
    areas_F = np.linalg.norm(np.cross(edges_F23[:, 0], edges_F23[:, 1]), axis=1)
    area_S = np.bincount(number_F.ravel(), areas_F)
    largest = np.argsort(-area_S)[:60]
    first = [int(np.flatnonzero(number_F.ravel() == side)[0]) for side in largest]
    return np.concatenate((normals_F3[first], axes_33))


def _inside(points_X3: np.ndarray, hull: ConvexHull | None, half_3: np.ndarray) -> np.ndarray:
    """Which points lie in the hull (X,); what has no room is taken for its box."""
    if hull is None:
        return np.all(np.abs(points_X3) <= half_3, axis=1)
    sides_F4 = hull.equations
    return np.all(points_X3 @ sides_F4[:, :3].T + sides_F4[:, 3] <= 0, axis=1)


def _candidates(corners_H3: np.ndarray, half_3: np.ndarray) -> Iterator[LinkGeometry]:
    """Shapes in the frame of the box, whose centre is its own."""
    reach = float(np.linalg.norm(corners_H3, axis=1).max())
    for share in _SIZES:
        yield _shape("box", share * 2 * half_3, 2)
        yield _shape("sphere", [share * reach], 2)
        for axis in range(3):
            radius = max(float(np.linalg.norm(np.delete(corners_H3, axis, axis=1), axis=1).max()), _THIN / 2)
            length = 2 * float(half_3[axis])
            yield _shape("cylinder", [share * radius, length], axis)
            yield _shape("capsule", [share * radius, max(0.0, length - 2 * share * radius)], axis)


def _shape(kind: str, size: object, axis: int) -> LinkGeometry:
    """A shape whose z lies along an axis."""
    pose_44 = np.eye(4)
    pose_44[:3, :3] = np.roll(np.eye(3), axis - 2, axis=0)
    numbers = tuple(float(number) for number in np.asarray(size, float))
    return LinkGeometry("", kind, numbers, pose_44, ROBOT_COLOR)  # pyright: ignore[reportArgumentType] (one of the kinds)


def _shared(found: list[Capsule], inside_X3: np.ndarray, room: float, unit_X3: np.ndarray) -> float:
    """The room that capsules share with the hull, over that which either takes.

    Args:
        found: the capsules.
        inside_X3: points in the hull.
        room: what the hull takes [m^3].
        unit_X3: points in the room from -1 to 1.
    """
    low_3 = np.min([np.minimum(start_3, end_3) - radius for start_3, end_3, radius in found], axis=0)
    high_3 = np.max([np.maximum(start_3, end_3) + radius for start_3, end_3, radius in found], axis=0)
    around_X3 = (low_3 + high_3) / 2 + unit_X3 * (high_3 - low_3) / 2
    taken = float(np.prod(high_3 - low_3)) * float(_covered(found, around_X3).mean())
    both = room * float(_covered(found, inside_X3).mean()) if len(inside_X3) else 0.0
    return both / max(room + taken - both, 1e-18)


def _covered(found: list[Capsule], points_X3: np.ndarray) -> np.ndarray:
    """Which points lie in a capsule (X,)."""
    covered_X = np.zeros(len(points_X3), bool)
    for start_3, end_3, radius in found:
        along_3 = end_3 - start_3
        share_X = np.clip((points_X3 - start_3) @ along_3 / max(float(along_3 @ along_3), 1e-18), 0, 1)
        covered_X |= np.linalg.norm(points_X3 - start_3 - share_X[:, None] * along_3, axis=1) <= radius
    return covered_X
