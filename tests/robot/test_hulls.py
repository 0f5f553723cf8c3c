"""Capsules in place of a mesh lie where the mesh is, wherever it is and however it is turned."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

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
        assert 1 <= len(found) <= 3
        assert np.abs(outside(found, points_X3 @ turn_33.T + move_3)).mean() < near


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
    ((start_3, end_3, radius),) = capsules_of(np.asarray(mesh.vertices), alone=True)
    half_3 = mesh.extents / 2
    assert np.all(np.abs((start_3 + end_3) / 2) < 0.02) and half_3.min() / 2 < radius < half_3.max() * 1.5
