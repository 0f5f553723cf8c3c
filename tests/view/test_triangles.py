"""A mesh that is drawn as triangles looks as the solid that it is a mesh of, and hides and is hidden as that is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo.view import Camera, Solids, render
from mrhubo.view.raster import Canvas
from mrhubo.view.surfaces import Placed, Surface
from mrhubo.view.triangles import draw_triangles

GREY = (0.6, 0.6, 0.6)
CAMERA = Camera(width_m=1.0)


def ball(centre_3: np.ndarray, radius: float) -> Solids:
    return Solids.capsules([(centre_3, centre_3, radius, radius)], GREY)


def figure_of(mesh: trimesh.Trimesh, color: tuple[float, float, float] = GREY) -> Solids:
    surface = Surface.of(np.asarray(mesh.vertices), np.asarray(mesh.faces), color)
    placed = Placed.of(surface, np.eye(4))
    return replace(Solids.empty(), meshes=(placed,))


def picture(*figures: Solids) -> np.ndarray:
    return np.asarray(render(Solids.concatenate(figures), (160, 160), CAMERA, ground=None), float)


@pytest.mark.parametrize("fineness", [3, 6])
def test_a_ball_of_triangles_looks_as_a_ball(fineness: int) -> None:
    """Of a few large ones, and of far more than there are pixels."""
    meshed = picture(figure_of(trimesh.creation.icosphere(fineness, 0.3)))
    solid = picture(ball(np.zeros(3), 0.3))
    covered = [(image < 250).any(axis=2) for image in (meshed, solid)]
    assert (covered[0] ^ covered[1]).sum() < 0.03 * covered[1].sum()
    inside = covered[0] & covered[1]
    assert np.abs(meshed - solid)[inside].mean() < 8


def test_what_is_nearer_hides() -> None:
    box = figure_of(trimesh.creation.box((0.2, 0.2, 0.2)))
    towards = CAMERA.basis()[2]
    before, behind = ball(0.5 * towards, 0.25), ball(-0.5 * towards, 0.25)
    assert np.array_equal(picture(before, box), picture(before))
    assert not np.array_equal(picture(behind, box), picture(behind))


def test_each_mesh_has_its_own_colour() -> None:
    left, right = (trimesh.creation.box((0.2, 0.2, 0.2)).apply_translation([0, y, 0]) for y in (0.3, -0.3))
    both = picture(figure_of(left, (1.0, 0.0, 0.0)), figure_of(right, (0.0, 0.0, 1.0)))
    red, blue = (both[..., 0] > both[..., 2] + 30), (both[..., 2] > both[..., 0] + 30)
    assert red.sum() > 300 and blue.sum() > 300
    assert np.median(np.nonzero(red)[1]) > 80 > np.median(np.nonzero(blue)[1]), "y is left of who looks along x"


def soup(seed: int, count: int, size: float) -> np.ndarray:
    generator = np.random.default_rng(seed)
    middle_F13 = generator.uniform(-0.6, 0.6, (count, 1, 3))
    return (middle_F13 + size * generator.normal(size=(count, 3, 3))).astype(np.float32)


@given(st.integers(0, 10_000), st.integers(1, 60), st.sampled_from([0.002, 0.03, 0.3]))
@settings(max_examples=40, deadline=None)
def test_every_pixel_sees_the_nearest_triangle_around_its_centre(seed: int, count: int, size: float) -> None:
    """Against one triangle after the other, in double precision."""
    canvas, corners_F33 = Canvas(24, 20, 0.05), soup(seed, count, size)
    draw_triangles(canvas, corners_F33, np.arange(count))
    u_HW, v_HW = np.meshgrid(canvas.u_W.astype(float), canvas.v_H.astype(float))
    wanted_HW = np.full(u_HW.shape, -np.inf)
    unsure_HW = np.zeros(u_HW.shape, bool)
    for a_3, b_3, c_3 in corners_F33.astype(float):
        edges_22 = np.stack([b_3 - a_3, c_3 - a_3])[:, :2].T
        if abs(np.linalg.det(edges_22)) < 1e-9:
            continue
        share_2HW = np.linalg.solve(edges_22, np.stack([u_HW - a_3[0], v_HW - a_3[1]]).reshape(2, -1)).reshape(
            2, 20, 24
        )
        inner_HW = np.minimum(share_2HW.min(axis=0), 1 - share_2HW.sum(axis=0))
        depth_HW = a_3[2] + share_2HW[0] * (b_3 - a_3)[2] + share_2HW[1] * (c_3 - a_3)[2]
        unsure_HW |= np.abs(inner_HW) < 1e-3
        wanted_HW = np.where(inner_HW > 0, np.maximum(wanted_HW, depth_HW), wanted_HW)
    sure_HW = ~unsure_HW
    drawn_HW = canvas.owner_HW >= 0
    assert np.array_equal(drawn_HW[sure_HW], np.isfinite(wanted_HW)[sure_HW])
    both_HW = sure_HW & drawn_HW
    assert np.allclose(canvas.depth_HW[both_HW], wanted_HW[both_HW], atol=1e-3)
    if drawn_HW.any():
        assert canvas.normal_HW3 is not None
        normal_N3 = canvas.normal_HW3[drawn_HW]
        assert np.allclose(np.linalg.norm(normal_N3, axis=1), 1.0, atol=1e-4) and (normal_N3[:, 2] >= 0).all()


def test_a_mesh_without_area_is_nothing() -> None:
    flat = figure_of(trimesh.Trimesh(np.zeros((3, 3)), [[0, 1, 2]], process=False))
    assert np.array_equal(picture(flat), picture(Solids.empty()))


def test_what_is_nowhere_is_not_drawn() -> None:
    canvas, corners_F33 = Canvas(24, 20, 0.05), soup(0, 30, 0.3)
    corners_F33[::3, 1], corners_F33[1::3, 2, 0] = np.nan, np.inf
    draw_triangles(canvas, corners_F33, np.arange(30))
    assert set(canvas.owner_HW.ravel().tolist()) <= {-1, *range(2, 30, 3)} and canvas.owner_HW.max() >= 0
    draw_triangles(canvas, np.zeros((0, 3, 3), np.float32), np.zeros(0, int))
