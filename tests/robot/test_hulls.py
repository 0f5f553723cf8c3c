"""Capsules in place of a mesh lie where the mesh is, wherever it is and however it is turned."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from mrhubo.robot.hulls import capsules_of, extremes

MESHES = {
    "box": (trimesh.creation.box((0.1, 0.15, 0.3)), 0.012),
    "cylinder": (trimesh.creation.cylinder(0.05, 0.3), 0.012),
    "disc": (trimesh.creation.cylinder(0.1, 0.05), 0.02),
    "ball": (trimesh.creation.icosphere(3, 0.1), 0.003),
    "capsule": (trimesh.creation.capsule(0.3, 0.05), 0.006),
    "tube": (trimesh.creation.annulus(0.03, 0.05, 0.2), 0.012),
}


def rotation(seed: int) -> np.ndarray:
    return np.linalg.svd(np.random.default_rng(seed).normal(size=(3, 3)))[0]


def outside(found: list, points_X3: np.ndarray) -> np.ndarray:
    """How far points are outside all capsules (X,) [m]."""
    apart = []
    for start_3, end_3, radius in found:
        along_3 = end_3 - start_3
        share = np.clip((points_X3 - start_3) @ along_3 / max(along_3 @ along_3, 1e-12), 0, 1)
        apart.append(np.linalg.norm(points_X3 - start_3 - share[:, None] * along_3, axis=1) - radius)
    return np.min(apart, axis=0)


@pytest.mark.parametrize("name", MESHES)
def test_capsules_hug_a_mesh_wherever_it_is(name: str) -> None:
    """The surface of the mesh is near theirs, on average over the area."""
    mesh, near = MESHES[name]
    points_X3 = np.asarray(trimesh.sample.sample_surface(trimesh.convex.convex_hull(mesh), 2000, seed=0)[0])
    for seed in range(2):
        turn_33, move_3 = rotation(seed), np.array([0.3, -2.0, 1.0])
        found = capsules_of(np.asarray(mesh.vertices) @ turn_33.T + move_3)
        assert 1 <= len(found) <= 4
        assert np.abs(outside(found, points_X3 @ turn_33.T + move_3)).mean() < near


def hull(name: str) -> np.ndarray:
    """Corners of a hull that no box, cylinder or ball is like, as covers of limbs are [m]."""
    generator = np.random.default_rng(len(name))
    if name == "wedge":  # a thigh, thick at the hip and thin at the knee
        return np.array([[x * w, y * w, z] for z, w in ((0.0, 1.0), (-0.45, 0.35)) for x in (-0.07, 0.07) for y in (-0.13, 0.13)])  # fmt: skip
    if name == "foot":  # a sole, and the ankle above its rear
        sole = [[x, y, 0.0] for x in (-0.08, 0.16) for y in (-0.05, 0.05)]
        return np.array(sole + [[x, y, 0.1] for x in (-0.05, 0.03) for y in (-0.03, 0.03)])
    if name == "hook":  # a bracket of a shoulder
        return np.concatenate([generator.normal(size=(60, 3)) * 0.01 + place for place in ([0, 0, 0], [0.15, 0, 0], [0.15, 0.05, 0.12])])  # fmt: skip
    return generator.normal(size=(200, 3)) * [0.05, 0.09, 0.12]


@pytest.mark.parametrize("name", ["wedge", "foot", "hook", "egg"])
def test_capsules_stick_out_of_a_hull_no_farther_than_they_leave_out_of_it(name: str) -> None:
    """Neither the surface of the capsules is far outside of the hull, nor the hull's outside of them, beside its size."""
    corners_H3 = hull(name)
    mesh = trimesh.convex.convex_hull(corners_H3)
    found = capsules_of(corners_H3)
    size = float(np.linalg.norm(mesh.extents))
    points_X3 = np.asarray(trimesh.sample.sample_surface(mesh, 2000, seed=0)[0])
    assert np.abs(outside(found, points_X3)).mean() < 0.035 * size
    ball_X3 = np.asarray(trimesh.creation.icosphere(2, 1.0).vertices)
    on_them_X3 = np.concatenate([
        start_3 + share * (end_3 - start_3) + radius * ball_X3
        for start_3, end_3, radius in found for share in np.linspace(0, 1, 9)
    ])  # fmt: skip
    shell_X3 = on_them_X3[outside(found, on_them_X3) > -1e-6]
    sides_F4 = np.unique(np.round(ConvexHull(corners_H3).equations, 6), axis=0)
    assert (shell_X3 @ sides_F4[:, :3].T + sides_F4[:, 3]).max() < 0.06 * size


def test_what_has_no_room_gets_a_thin_capsule() -> None:
    sheet = np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.1, 0], [0.2, 0.1, 0]], float)
    for points in (sheet, sheet[:2], sheet[:1], np.repeat(sheet[:1], 9, axis=0)):
        found = capsules_of(points)
        assert all(np.isfinite(end).all() and 0 < radius < 0.05 for *ends, radius in found for end in ends)


def test_extremes_are_those_of_the_whole() -> None:
    points = np.random.default_rng(0).normal(size=(100_000, 3))
    kept = extremes(points)
    assert len(kept) <= 1000 and {tuple(point) for point in kept} <= {tuple(point) for point in points}
    for direction in rotation(3):
        assert (kept @ direction).max() > 0.97 * (points @ direction).max()


@pytest.mark.parametrize("name", MESHES)
def test_one_capsule_alone(name: str) -> None:
    mesh = MESHES[name][0]
    ((start_3, end_3, radius),) = capsules_of(np.asarray(mesh.vertices), most=1)
    half_3 = mesh.extents / 2
    assert np.all(np.abs((start_3 + end_3) / 2) < 0.02) and half_3.min() / 2 < radius < half_3.max() * 1.5
