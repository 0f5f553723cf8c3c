"""Surfaces: meshes as many small discs, which are drawn all at once, however many triangles a mesh has.

World frame: x forward, y left, z up, metres. Axes: P discs, H, W pixels.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from mrhubo.view.raster import Canvas
from mrhubo.view.solids import Color

_OVERLAP = 1.1
"""Radius of a disc by the distance of its neighbours: no gaps, and few steps at edges."""
_WIDEST = 20
"""Most pixels that a disc reaches to either side."""


@dataclass(frozen=True)
class Surface:
    """Discs all over a surface."""

    points_P3: np.ndarray
    """Their centres, m."""
    normals_P3: np.ndarray
    """Unit, to either side."""
    radius_m: float
    color: Color
    """RGB, 0..1."""

    def __len__(self) -> int:
        return len(self.points_P3)

    def transformed(self, pose_44: np.ndarray, factor: float = 1.0) -> Surface:
        """A copy ``factor`` times as large about the origin, then moved by a rigid motion (4, 4), m."""
        turn_33 = pose_44[:3, :3].T
        points_P3 = factor * self.points_P3 @ turn_33 + pose_44[:3, 3]
        return Surface(points_P3, self.normals_P3 @ turn_33, factor * self.radius_m, self.color)

    def extremes(self) -> np.ndarray:
        """The points (6, 3) farthest along every axis, which stand for it where its size counts."""
        return self.points_P3[[*self.points_P3.argmin(axis=0), *self.points_P3.argmax(axis=0)]]

    @classmethod
    def concatenate(cls, parts: Sequence[Surface]) -> Surface:
        """All discs of surfaces of one colour and disc."""
        points_P3, normals_P3 = (
            np.concatenate([getattr(p, name) for p in parts]) for name in ("points_P3", "normals_P3")
        )
        return cls(points_P3, normals_P3, parts[0].radius_m, parts[0].color)


def sample_surfaces(
    meshes: Iterable[tuple[np.ndarray, np.ndarray]], color: Color, count: int = 200_000, seed: int = 0
) -> list[Surface]:
    """Discs on meshes, ``count`` in all, spread by area; one surface a mesh, all with discs of one size.

    Args:
        meshes: vertices (V, 3) [m] and triangles (F, 3) of each.
        color: of all.
        count: how many discs.
        seed: of where they are.
    """
    corners = [vertices_V3[faces_F3] for vertices_V3, faces_F3 in meshes]
    crosses = [np.cross(c_F33[:, 1] - c_F33[:, 0], c_F33[:, 2] - c_F33[:, 0]) for c_F33 in corners]
    areas = [0.5 * np.linalg.norm(cross_F3, axis=1) for cross_F3 in crosses]
    total, generator = sum(float(area_F.sum()) for area_F in areas), np.random.default_rng(seed)
    if total <= 0.0:
        return [Surface(np.zeros((0, 3)), np.zeros((0, 3)), 0.0, color) for _ in corners]
    radius_m = _OVERLAP * float(np.sqrt(total / count))
    surfaces = []
    for corner_F33, cross_F3, area_F in zip(corners, crosses, areas, strict=True):
        number = int(np.ceil(count * area_F.sum() / total))
        # evenly spaced along the triangles' summed areas: large ones get many, small ones some
        places_P = (np.arange(number) + generator.random(number)) * (area_F.sum() / max(number, 1))
        chosen_P = np.searchsorted(np.cumsum(area_F), places_P).clip(0, len(area_F) - 1)
        u_P1, v_P1 = generator.random((2, number, 1))
        u_P1, v_P1 = np.where(u_P1 + v_P1 > 1, 1 - u_P1, u_P1), np.where(u_P1 + v_P1 > 1, 1 - v_P1, v_P1)
        a_P3, b_P3, c_P3 = (corner_F33[chosen_P, corner] for corner in range(3))
        normal_P3 = cross_F3[chosen_P] / np.maximum(2 * area_F[chosen_P], 1e-18)[:, None]
        surfaces.append(Surface(a_P3 + u_P1 * (b_P3 - a_P3) + v_P1 * (c_P3 - a_P3), normal_P3, radius_m, color))
    return surfaces


def draw_surface(canvas: Canvas, local: Surface, number: int) -> None:
    """Puts a surface, given in the picture frame, on a canvas as solid ``number``, and its normals beside it."""
    height, width = canvas.depth_HW.shape
    reach = min(int(np.ceil(local.radius_m / canvas.pixel_m)), _WIDEST)
    column_P = np.floor(width / 2 + local.points_P3[:, 0] / canvas.pixel_m).astype(int)
    row_P = np.floor(height / 2 - local.points_P3[:, 1] / canvas.pixel_m).astype(int)
    seen_P = (column_P >= -reach) & (column_P < width + reach) & (row_P >= -reach) & (row_P < height + reach)
    order_P = np.flatnonzero(seen_P)
    order_P = order_P[local.points_P3[order_P, 2].argsort()]  # the nearest last: it stays where several fall on a pixel
    points_P3, normals_P3 = local.points_P3[order_P].astype(np.float32), local.normals_P3[order_P].astype(np.float32)
    normals_P3 = normals_P3 * np.where(normals_P3[:, 2:] < 0, np.float32(-1), np.float32(1))
    slope_P2 = normals_P3[:, :2] / np.maximum(normals_P3[:, 2:], 1e-3)
    column_P, row_P = column_P[order_P], row_P[order_P]
    if canvas.normal_HW3 is None:
        canvas.normal_HW3 = np.zeros((height, width, 3), np.float32)
    for down in range(-reach, reach + 1):
        for right in range(-reach, reach + 1):
            rows_P, columns_P = row_P + down, column_P + right
            inside_P = (rows_P >= 0) & (rows_P < height) & (columns_P >= 0) & (columns_P < width)
            tilt_P = (slope_P2[:, 0] * right - slope_P2[:, 1] * down) * np.float32(canvas.pixel_m)
            if down or right:  # seen from the side, a disc is an ellipse; its centre is always drawn
                inside_P &= (down * down + right * right) * canvas.pixel_m**2 + tilt_P**2 < local.radius_m**2
            depth_P = points_P3[:, 2] - tilt_P
            inside_P[inside_P] = depth_P[inside_P] > canvas.depth_HW[rows_P[inside_P], columns_P[inside_P]]
            place = rows_P[inside_P], columns_P[inside_P]
            canvas.depth_HW[place], canvas.owner_HW[place] = depth_P[inside_P], number
            canvas.normal_HW3[place] = normals_P3[inside_P]
