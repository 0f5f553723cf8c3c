"""Surfaces: meshes of triangles, and where they stand in a figure.

World frame: x forward, y left, z up, metres. Axes: V vertices, F triangles, M surfaces, O points of
an outline.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

Color = tuple[float, float, float]
_AROUND_D3 = np.array([d for d in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(d)])
"""Directions all around, towards which an outline's points are the farthest."""
_KEY_BITS = 21
"""Of a cell's number along each axis, so that three make one number of 64 bits."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A mesh of at least one triangle, in a frame of its own."""

    corners_F33: np.ndarray
    """Corners of the triangles, m, float32."""
    outline_O3: np.ndarray
    """Some of the vertices, which stand for all where the surface's size counts, m."""
    color: Color
    """RGB, 0..1."""

    @classmethod
    def of(cls, vertices_V3: np.ndarray, faces_F3: np.ndarray, color: Color) -> Surface:
        """A mesh of vertices (V, 3) [m] and triangles (F, 3)."""
        corners_F33 = np.asarray(vertices_V3, float)[np.asarray(faces_F3, int)]
        points_P3 = corners_F33.reshape(-1, 3)
        return cls(corners_F33.astype(np.float32), points_P3[(points_P3 @ _AROUND_D3.T).argmax(axis=0)], color)

    def coarser(self, metres: float) -> Surface:
        """The same without what is smaller: vertices in one cube of so many metres become one, in their middle, and
        triangles of less than three such are gone.

        J. Rossignac, P. Borrel, "Multi-resolution 3D approximations for rendering complex scenes" (1993).
        """
        points_P3 = self.corners_F33.reshape(-1, 3)
        cells_P3 = np.floor((points_P3 - points_P3.min(axis=0)) / metres).astype(np.int64)
        if cells_P3.max() >= 1 << _KEY_BITS:  # far finer than the mesh is large
            return self
        key_P = (cells_P3[:, 0] << 2 * _KEY_BITS) | (cells_P3[:, 1] << _KEY_BITS) | cells_P3[:, 2]
        _, own_P, count_C = np.unique(key_P, return_inverse=True, return_counts=True)
        middle_C3 = np.stack([np.bincount(own_P, points_P3[:, axis]) / count_C for axis in range(3)], axis=1)
        faces_F3 = own_P.reshape(-1, 3)
        a_F, b_F, c_F = faces_F3.T
        kept_F3 = faces_F3[(a_F != b_F) & (b_F != c_F) & (c_F != a_F)]
        return replace(self, corners_F33=middle_C3[kept_F3].astype(np.float32))


@dataclass(frozen=True, eq=False)
class Placed:
    """A surface somewhere in a figure: its points are turn x + place."""

    surface: Surface
    turn_33: np.ndarray
    """A rotation times a size."""
    place_3: np.ndarray
    """Metres."""

    @classmethod
    def of(cls, surface: Surface, pose_44: np.ndarray) -> Placed:
        """A surface with its frame at a pose (4, 4), m."""
        pose = np.asarray(pose_44, float)
        return cls(surface, pose[:3, :3], pose[:3, 3])

    @property
    def color(self) -> Color:
        """RGB, 0..1."""
        return self.surface.color

    def recolored(self, color: Color) -> Placed:
        """The same in another colour, RGB, 0..1."""
        return replace(self, surface=replace(self.surface, color=color))

    def moved(self, turn_33: np.ndarray, place_3: np.ndarray) -> Placed:
        """The same, turned (or made larger) about the origin, then shifted, m."""
        return replace(self, turn_33=turn_33 @ self.turn_33, place_3=turn_33 @ self.place_3 + place_3)

    def corners(self) -> np.ndarray:
        """Corners (F, 3, 3) of its triangles, m, float32."""
        return self.surface.corners_F33 @ self.turn_33.T.astype(np.float32) + self.place_3.astype(np.float32)


def outlines(meshes: Sequence[Placed]) -> np.ndarray:
    """Points (M, O, 3) that stand for surfaces where their size counts, m."""
    if not meshes:
        return np.zeros((0, len(_AROUND_D3), 3))
    turn_M33, place_M3 = np.array([m.turn_33 for m in meshes]), np.array([m.place_3 for m in meshes])
    outline_MO3 = np.array([m.surface.outline_O3 for m in meshes])
    return outline_MO3 @ turn_M33.swapaxes(1, 2) + place_M3[:, None]


def rods(meshes: Sequence[Placed]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """About what surfaces are from far: the ends (M, 3), (M, 3) and the radii (M,) [m] of rods through them."""
    points_MO3 = outlines(meshes)
    rough_M13 = points_MO3.mean(axis=1, keepdims=True)
    axes_M33 = np.linalg.svd(points_MO3 - rough_M13, full_matrices=False)[2]
    along_MO3 = (points_MO3 - rough_M13) @ axes_M33.swapaxes(1, 2)
    low_M3, high_M3 = along_MO3.min(axis=1), along_MO3.max(axis=1)
    middle_M3 = rough_M13[:, 0] + np.einsum("mk,mki->mi", (low_M3 + high_M3) / 2, axes_M33)
    half_M3 = (high_M3 - low_M3) / 2
    reach_M3 = axes_M33[:, 0] * (half_M3[:, :1] - half_M3[:, 1:2]).clip(0.0)
    return middle_M3 - reach_M3, middle_M3 + reach_M3, half_M3[:, 1]
