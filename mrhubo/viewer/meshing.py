"""Solids as triangle meshes, for a viewer that draws triangles alone.

World frame: x forward, y left, z up, metres. Legend: S solids, V vertices, F triangles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrhubo.robot import LinkGeometry
from mrhubo.view import Solids
from mrhubo.view.solids import Color

_AROUND, _ROWS = 16, 5
"""Vertices around a capsule, and rows of them at each of its ends."""


@dataclass(frozen=True)
class Mesh:
    """Triangles of one colour."""

    vertices_V3: np.ndarray
    """Metres."""
    faces_F3: np.ndarray
    """Numbers of vertices, anticlockwise seen from outside."""
    color: Color
    """RGB, 0..1."""

    def placed(self, pose_44: np.ndarray) -> Mesh:
        """A copy moved by a rigid motion (4, 4)."""
        return Mesh(self.vertices_V3 @ pose_44[:3, :3].T + pose_44[:3, 3], self.faces_F3, self.color)

    def scaled(self, factor: float) -> Mesh:
        """A copy that many times as large, about the origin."""
        return Mesh(factor * self.vertices_V3, self.faces_F3, self.color)


def joined(meshes: Sequence[Mesh]) -> list[Mesh]:
    """One mesh for each colour, in the order in which colours come."""
    colors = list(dict.fromkeys(mesh.color for mesh in meshes))
    return [_join([mesh for mesh in meshes if mesh.color == color]) for color in colors]


def _join(meshes: Sequence[Mesh]) -> Mesh:
    before = np.cumsum([0, *(len(mesh.vertices_V3) for mesh in meshes)])
    faces_F3 = np.concatenate([mesh.faces_F3 + first for mesh, first in zip(meshes, before, strict=False)])
    return Mesh(np.concatenate([mesh.vertices_V3 for mesh in meshes]), faces_F3, meshes[0].color)


def capsules(solids: Solids) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The surfaces of capsules, tapered ones and balls among them.

    Returns:
        Vertices (S, 2, R, 3) [m], of which the first R are at the start of a capsule and the others at its end; their
        normals, alike; and the triangles (F, 3) of one capsule, numbers of its 2 R vertices.
    """
    axis_S3 = solids.ends_S3 - solids.starts_S3
    length_S1 = np.linalg.norm(axis_S3, axis=1, keepdims=True)
    along_S3 = np.where(length_S1 > 1e-9, axis_S3 / np.maximum(length_S1, 1e-9), [0.0, 0.0, 1.0])
    helper_S3 = np.where(np.abs(along_S3[:, :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    side_S3 = np.cross(along_S3, helper_S3)
    side_S3 /= np.linalg.norm(side_S3, axis=1, keepdims=True)
    other_S3 = np.cross(along_S3, side_S3)
    # The common tangent of two balls of different radii touches them off their equators.
    lean_S = np.clip((solids.radii_S - solids.end_radii_S) / np.maximum(length_S1[:, 0], 1e-9), -0.999, 0.999)
    lean_S = np.where(length_S1[:, 0] > 1e-9, np.arccos(lean_S), np.pi / 2)
    share_R = np.linspace(0.0, 1.0, _ROWS)
    angle_S2R = np.stack(
        [np.pi - share_R * (np.pi - lean_S[:, None]), lean_S[:, None] * (1.0 - share_R)], axis=1
    )  # from the axis; the start's pole first
    turn_A = 2 * np.pi * np.arange(_AROUND) / _AROUND
    around_SA3 = np.cos(turn_A)[:, None] * side_S3[:, None] + np.sin(turn_A)[:, None] * other_S3[:, None]
    normals = (
        np.cos(angle_S2R)[..., None, None] * along_S3[:, None, None, None]
        + np.sin(angle_S2R)[..., None, None] * around_SA3[:, None, None]
    )
    centres_S23 = np.stack([solids.starts_S3, solids.ends_S3], axis=1)
    radii_S2 = np.stack([solids.radii_S, solids.end_radii_S], axis=1)
    vertices = centres_S23[:, :, None, None] + radii_S2[:, :, None, None, None] * normals
    shape = (len(solids), 2, _ROWS * _AROUND, 3)
    return vertices.reshape(shape), normals.reshape(shape), _faces()


def _faces() -> np.ndarray:
    """Triangles (F, 3) between neighbouring rows of vertices, all around."""
    row = np.arange(_AROUND)
    following = np.roll(row, -1)
    quads = [
        np.stack([low + row, low + following, low + _AROUND + following, low + _AROUND + row], axis=1)
        for low in _AROUND * np.arange(2 * _ROWS - 1)
    ]
    quads_Q4 = np.concatenate(quads)
    return np.concatenate([quads_Q4[:, [0, 1, 2]], quads_Q4[:, [0, 2, 3]]])


def capsule_meshes(solids: Solids) -> list[Mesh]:
    """A mesh a capsule."""
    vertices_S2R3, _, faces_F3 = capsules(solids)
    colors = map(tuple, solids.colors_S3.tolist())
    return [Mesh(v.reshape(-1, 3), faces_F3, color) for v, color in zip(vertices_S2R3, colors, strict=True)]


def shape_mesh(shape: LinkGeometry) -> Mesh:
    """A primitive shape, in the frame of its link."""
    if shape.kind in ("sphere", "capsule"):
        half_3 = 0.5 * shape.size[1] * shape.origin_44[:3, 2] if shape.kind == "capsule" else np.zeros(3)
        centre_3 = shape.origin_44[:3, 3]
        rows = [(centre_3 - half_3, centre_3 + half_3, shape.size[0], shape.size[0])]
        return capsule_meshes(Solids.capsules(rows, shape.color))[0]
    import trimesh

    if shape.kind == "box":
        made = trimesh.creation.box(extents=shape.size)
    else:
        made = trimesh.creation.cylinder(radius=shape.size[0], height=shape.size[1], sections=2 * _AROUND)
    made.unmerge_vertices()  # so that edges are sharp
    return Mesh(np.asarray(made.vertices), np.asarray(made.faces), shape.color).placed(shape.origin_44)
