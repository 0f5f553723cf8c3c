"""Whether primitive shapes overlap, exactly: what capsules that hug them are measured by.

E. G. Gilbert, D. W. Johnson and S. S. Keerthi, "A fast procedure for computing the distance between complex objects in
three-dimensional space", 1988: a simplex of the Minkowski difference is grown towards the origin until it holds it, or
cannot.
"""

from __future__ import annotations

import numpy as np
import torch

from mrhubo.robot import LinkGeometry, Robot, SelfCollision, read_collision_geometry
from mrhubo.robot.urdf import link_poses


def farthest(shape: LinkGeometry, pose_44: np.ndarray, towards_3: np.ndarray) -> np.ndarray:
    """The point (3,) of a shape at a pose that lies farthest in a direction."""
    local_3 = pose_44[:3, :3].T @ towards_3
    size = shape.size
    if shape.kind == "box":
        point_3 = np.where(local_3 >= 0, 0.5, -0.5) * size
    elif shape.kind == "cylinder":
        across = max(float(np.hypot(local_3[0], local_3[1])), 1e-12)
        point_3 = np.array([*(size[0] * local_3[:2] / across), np.copysign(0.5 * size[1], local_3[2])])
    else:
        point_3 = size[0] * local_3 / max(float(np.linalg.norm(local_3)), 1e-12)
        point_3[2] += np.copysign(0.5 * size[1], local_3[2]) if shape.kind == "capsule" else 0.0
    return pose_44[:3, :3] @ point_3 + pose_44[:3, 3]


def overlap(one: LinkGeometry, one_44: np.ndarray, other: LinkGeometry, other_44: np.ndarray) -> bool:
    """Whether two shapes at poses share a point."""

    def difference(towards_3: np.ndarray) -> np.ndarray:
        return farthest(one, one_44, towards_3) - farthest(other, other_44, -towards_3)

    towards_3 = one_44[:3, 3] - other_44[:3, 3] + 1e-9
    simplex = [difference(towards_3)]
    towards_3 = -simplex[0]
    for _ in range(64):
        if float(np.linalg.norm(towards_3)) < 1e-12:
            return True
        point_3 = difference(towards_3)
        if float(point_3 @ towards_3) < 0:
            return False
        simplex.insert(0, point_3)
        found = _nearest(simplex)
        if found is None:
            return True
        simplex, towards_3 = found
    return True  # they touch


def _nearest(simplex: list[np.ndarray]) -> tuple[list[np.ndarray], np.ndarray] | None:
    """The part of a simplex that is nearest to the origin, newest point first, and the way from there to the origin; None
    if the origin is inside.
    """
    a, rest = simplex[0], simplex[1:]
    if len(rest) == 1:
        ab = rest[0] - a
        return (simplex, np.cross(np.cross(ab, -a), ab)) if ab @ -a > 0 else ([a], -a)
    if len(rest) == 2:
        return _of_triangle(a, *rest)
    for b, c, d in ((rest[0], rest[1], rest[2]), (rest[1], rest[2], rest[0]), (rest[2], rest[0], rest[1])):
        normal = np.cross(b - a, c - a)
        normal = -normal if normal @ (d - a) > 0 else normal
        if normal @ -a > 0:
            return _of_triangle(a, b, c)
    return None


def _of_triangle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
    normal = np.cross(b - a, c - a)
    for edge, inside in ((b, c), (c, b)):
        out = np.cross(edge - a, normal)
        out = -out if out @ (inside - a) > 0 else out
        if out @ -a > 0:
            ab = edge - a
            return ([a, edge], np.cross(np.cross(ab, -a), ab)) if ab @ -a > 0 else ([a], -a)
    return ([a, b, c], normal) if normal @ -a > 0 else ([a, c, b], -normal)


def collides_exactly(robot: Robot, shapes: SelfCollision, q_BN: torch.Tensor) -> np.ndarray:
    """Whether any two of the URDF's own shapes overlap (B,), of the links of which the capsules are compared."""
    urdf = robot.description.parsed
    by_link: dict[str, list[LinkGeometry]] = {}
    for shape in read_collision_geometry(urdf):
        by_link.setdefault(shape.link, []).append(shape)
    pairs = sorted({tuple(sorted(pair)) for pair in shapes.pairs})
    found = []
    for q_N in q_BN.numpy():
        poses = link_poses(urdf, robot.configuration(q_N))
        found.append(any(
            overlap(a, poses[i] @ a.origin_44, b, poses[j] @ b.origin_44)
            for i, j in pairs for a in by_link[i] for b in by_link[j]
            if np.linalg.norm((poses[i] @ a.origin_44 - poses[j] @ b.origin_44)[:3, 3]) < _reach(a) + _reach(b)
        ))  # fmt: skip
    return np.array(found)


def _reach(shape: LinkGeometry) -> float:
    return float(np.linalg.norm(shape.size)) + shape.size[0]
