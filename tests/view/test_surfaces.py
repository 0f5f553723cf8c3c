"""Meshes keep their size and looks where they are moved, made coarser, and put together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from mrhubo.view import Camera, Solids, render
from mrhubo.view.surfaces import Placed, Surface, rods

GREY = (0.6, 0.6, 0.6)
TURN_33 = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])


def surface_of(mesh: trimesh.Trimesh) -> Surface:
    return Surface.of(np.asarray(mesh.vertices), np.asarray(mesh.faces), GREY)


def figure_of(*meshes: Placed) -> Solids:
    return replace(Solids.empty(), meshes=meshes)


def placed(mesh: trimesh.Trimesh) -> Placed:
    return Placed.of(surface_of(mesh), np.eye(4))


def test_moving_scaling_and_colours() -> None:
    pose_44 = np.eye(4)
    pose_44[:3, :3], pose_44[:3, 3] = TURN_33, [1, 2, 3]
    figure = figure_of(placed(trimesh.creation.box((0.2, 0.4, 0.6)))).scaled(2.0).transformed(pose_44)
    assert np.allclose(figure.bounds(), [[0.6, 1.8, 2.4], [1.4, 2.2, 3.6]])
    corners_F33 = figure.meshes[0].corners()
    assert np.allclose(corners_F33.min(axis=(0, 1)), [0.6, 1.8, 2.4], atol=1e-6)
    assert figure.recolored((1.0, 0.0, 0.0)).meshes[0].color == (1.0, 0.0, 0.0)
    assert figure.meshes[0].color == GREY and len(figure) == 0 and not figure.nothing and Solids.empty().nothing


def test_the_size_of_a_figure_is_that_of_shapes_and_meshes() -> None:
    ball = Solids.capsules([(np.zeros(3), np.zeros(3), 0.5, 0.5)], GREY)
    box = figure_of(placed(trimesh.creation.box((0.2, 4.0, 0.2))))
    both = Solids.concatenate([ball, box])
    assert np.allclose(both.bounds(), [[-0.5, -2.0, -0.5], [0.5, 2.0, 0.5]]) and len(both.meshes) == 1
    assert both.extent(np.array([0.6, 0.8, 0.0]))[1] == pytest.approx(0.6 * 0.1 + 0.8 * 2.0, rel=0.01)


def test_a_coarser_mesh_looks_the_same_from_far() -> None:
    fine = surface_of(trimesh.creation.icosphere(6, 0.3))
    coarse = fine.coarser(0.02)
    assert len(coarse.corners_F33) < 0.1 * len(fine.corners_F33)
    camera = Camera(width_m=1.0)
    views = [
        np.asarray(render(figure_of(Placed.of(s, np.eye(4))), (60, 60), camera, ground=None), float)
        for s in (fine, coarse)
    ]
    assert np.abs(views[0] - views[1]).mean() < 4.0
    covered = [(view < 250).any(axis=2) for view in views]
    assert (covered[0] ^ covered[1]).sum() < 0.03 * covered[0].sum()
    assert np.array_equal(coarse.outline_O3, fine.outline_O3)


def test_corners_that_are_far_apart_stay() -> None:
    box = surface_of(trimesh.creation.box((0.1, 0.2, 0.3)))
    corners_F33 = box.coarser(0.01).corners_F33
    assert np.allclose(corners_F33, box.corners_F33, atol=1e-6)
    assert np.array_equal(box.coarser(1e-9).corners_F33, box.corners_F33)


def test_a_rod_lies_along_a_mesh() -> None:
    start_M3, end_M3, radius_M = rods([placed(trimesh.creation.cylinder(0.05, 0.8)).moved(np.eye(3), np.ones(3))])
    assert np.allclose((start_M3 + end_M3) / 2, 1.0, atol=0.02)
    assert np.abs((end_M3 - start_M3)[0, 2]) == pytest.approx(0.7, abs=0.05)
    assert np.allclose((end_M3 - start_M3)[0, :2], 0.0, atol=0.05) and radius_M[0] == pytest.approx(0.05, abs=0.005)
