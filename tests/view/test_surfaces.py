"""A mesh that is drawn as discs looks as the solid that it is a mesh of, and hides and is hidden as that is."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from mrhubo.view import Camera, Solids, render
from mrhubo.view.surfaces import Surface, sample_surfaces

GREY = (0.6, 0.6, 0.6)
CAMERA = Camera(width_m=1.0)


def ball(centre_3: np.ndarray, radius: float) -> Solids:
    return Solids.capsules([(centre_3, centre_3, radius, radius)], GREY)


def surface_of(mesh: trimesh.Trimesh, count: int = 40_000) -> Surface:
    return sample_surfaces([(np.asarray(mesh.vertices), np.asarray(mesh.faces))], GREY, count)[0]


def picture(solids: Solids, surface: Surface | None = None) -> np.ndarray:
    return np.asarray(render(solids, (160, 160), CAMERA, ground=None, surface=surface), float)


def test_a_ball_of_discs_looks_as_a_ball() -> None:
    middle = np.zeros(3)
    discs = picture(Solids.empty(), surface_of(trimesh.creation.icosphere(4, 0.3)))
    solid = picture(ball(middle, 0.3))
    covered = [(image < 250).any(axis=2) for image in (discs, solid)]
    assert (covered[0] ^ covered[1]).sum() < 0.03 * covered[1].sum()
    inside = covered[0] & covered[1]
    assert np.abs(discs - solid)[inside].mean() < 12


def test_what_is_nearer_hides() -> None:
    surface = surface_of(trimesh.creation.box((0.2, 0.2, 0.2)))
    towards = CAMERA.basis()[2]
    before, behind = ball(0.5 * towards, 0.25), ball(-0.5 * towards, 0.25)
    assert np.array_equal(picture(before, surface), picture(before))
    assert not np.array_equal(picture(behind, surface), picture(behind))


def test_discs_lie_on_the_mesh_and_are_spread_by_area() -> None:
    box = trimesh.creation.box((1.0, 0.5, 0.25))
    surface = surface_of(box, 5000)
    inside = np.abs(surface.points_P3) <= np.array([0.5, 0.25, 0.125]) + 1e-9
    assert inside.all() and np.isclose(np.abs(surface.points_P3 / [0.5, 0.25, 0.125]).max(axis=1), 1.0).all()
    share = (np.abs(surface.normals_P3[:, 2]) > 0.9).mean()
    assert share == pytest.approx(1.0 / 1.75, abs=0.01)
    assert np.allclose(np.linalg.norm(surface.normals_P3, axis=1), 1.0)


def test_moving_and_scaling() -> None:
    surface = surface_of(trimesh.creation.icosphere(2, 0.1), 500)
    pose = np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1.0]])
    moved = surface.transformed(pose, 2.0)
    assert np.allclose(np.linalg.norm(moved.points_P3 - [1, 2, 3], axis=1), 0.2, atol=0.01)
    assert moved.radius_m == pytest.approx(2 * surface.radius_m)
    assert np.allclose(np.abs(moved.extremes() - [1, 2, 3]).max(axis=1), 0.2, atol=0.02)


def test_a_mesh_without_area_is_nothing() -> None:
    flat = sample_surfaces([(np.zeros((3, 3)), np.array([[0, 1, 2]]))], GREY)
    assert len(flat[0]) == 0 and np.array_equal(picture(Solids.empty(), flat[0]), picture(Solids.empty()))
