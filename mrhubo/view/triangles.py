"""Which triangle does each pixel see? A z-buffer of triangles, those of about one size all at once, so that a robot's
hundred thousands take a fraction of a second without a graphics card.

A pixel belongs to a triangle if its centre lies inside; so meshes without holes have none in the picture, and triangles
between the centres of pixels cost nothing. Axes: F triangles, N samples, H, W pixels. Picture frame: right, up, towards
the viewer.
"""

from __future__ import annotations

import numpy as np

from mrhubo.view.raster import Canvas

_AT_ONCE = 1 << 20
"""Samples that are worked out together."""
_EDGE = np.float32(1e-4)
"""How far outside a triangle, by its size, a sample still belongs to it: rounding must not part two that touch."""


def draw_triangles(canvas: Canvas, corners_F33: np.ndarray, owner_F: np.ndarray) -> None:
    """Puts triangles, given in the picture frame [m], on a canvas as solids ``owner_F``, and their normals beside."""
    height, width = canvas.depth_HW.shape
    place_F33 = corners_F33 * np.array([1 / canvas.pixel_m, -1 / canvas.pixel_m, 1.0], np.float32)
    place_F33[..., :2] += np.array([width / 2 - 0.5, height / 2 - 0.5], np.float32)
    first_F2 = np.ceil(place_F33[..., :2].min(axis=1)).clip(0)
    last_F2 = np.minimum(np.floor(place_F33[..., :2].max(axis=1)), [width - 1, height - 1])
    seen_F = np.flatnonzero((last_F2 >= first_F2).all(axis=1) & np.isfinite(corners_F33).all(axis=(1, 2)))
    if not len(seen_F):
        return
    face_N = np.full(height * width, -1, np.int64)
    corners_F33, owner_F, place_F33 = corners_F33[seen_F], owner_F[seen_F], place_F33[seen_F]
    first_F2, last_F2 = first_F2[seen_F].astype(np.int64), last_F2[seen_F].astype(np.int64)
    size_F2 = 1 << np.ceil(np.log2(last_F2 - first_F2 + 1)).astype(np.int64)
    code_F = size_F2[:, 0] * (2 * height + 2) + size_F2[:, 1]
    for code in np.unique(code_F):  # sizes are powers of two, so that many triangles have the same and are done at once
        chosen_F = np.flatnonzero(code_F == code)
        wide, high = size_F2[chosen_F[0]].tolist()
        count = max(1, _AT_ONCE // (wide * high))
        for at in range(0, len(chosen_F), count):
            number_F = chosen_F[at : at + count]
            _put(canvas, face_N, number_F, place_F33[number_F], first_F2[number_F], last_F2[number_F], (wide, high))
    drawn_N = np.flatnonzero(face_N >= 0)
    winner_N = face_N[drawn_N]
    canvas.owner_HW.ravel()[drawn_N] = owner_F[winner_N]
    if canvas.normal_HW3 is None:
        canvas.normal_HW3 = np.zeros((height, width, 3), np.float32)
    canvas.normal_HW3.reshape(-1, 3)[drawn_N] = _normals(corners_F33[winner_N])


def _put(
    canvas: Canvas,
    face_N: np.ndarray,
    number_F: np.ndarray,
    place_F33: np.ndarray,
    first_F2: np.ndarray,
    last_F2: np.ndarray,
    size: tuple[int, int],
) -> None:
    """Samples of triangles, none of which is larger than ``size`` pixels: depth, and number, where they are nearest.
    ``place_F33``: column and row of the corners, and their depth [m].
    """
    width = canvas.depth_HW.shape[1]
    (x0_F, x1_F, x2_F), (y0_F, y1_F, y2_F), depth_3F = place_F33.transpose(2, 1, 0)
    area_F = (x1_F - x0_F) * (y2_F - y0_F) - (x2_F - x0_F) * (y1_F - y0_F)
    flat_F = np.abs(area_F) < 1e-12  # seen from its edge
    inverse_F = np.where(flat_F, np.float32(0.0), 1.0 / np.where(flat_F, np.float32(1.0), area_F))
    columns_FX = first_F2[:, :1] + np.arange(size[0])
    rows_FY = first_F2[:, 1:] + np.arange(size[1])
    across_FX = columns_FX.astype(np.float32) - x0_F[:, None]
    down_FY = rows_FY.astype(np.float32) - y0_F[:, None]

    def share(across_F: np.ndarray, down_F: np.ndarray) -> np.ndarray:
        """Of a corner at each sample, by how it grows from pixel to pixel."""
        return across_FX[:, None, :] * across_F[:, None, None] + down_FY[:, :, None] * down_F[:, None, None]

    second_FYX = share((y2_F - y0_F) * inverse_F, (x0_F - x2_F) * inverse_F)
    third_FYX = share((y0_F - y1_F) * inverse_F, (x1_F - x0_F) * inverse_F)
    inside_FYX = (second_FYX >= -_EDGE) & (third_FYX >= -_EDGE) & (second_FYX + third_FYX <= 1 + _EDGE)
    inside_FYX &= ((columns_FX <= last_F2[:, :1]) & ~flat_F[:, None])[:, None, :]
    inside_FYX &= (rows_FY <= last_F2[:, 1:])[:, :, None]
    triangle_N, row_N, column_N = np.nonzero(inside_FYX)
    place_N = rows_FY[triangle_N, row_N] * width + columns_FX[triangle_N, column_N]
    near_3N = depth_3F[:, triangle_N]
    found_N = near_3N[0] + second_FYX[inside_FYX] * (near_3N[1] - near_3N[0])
    found_N += third_FYX[inside_FYX] * (near_3N[2] - near_3N[0])
    depth_N = canvas.depth_HW.reshape(-1)
    kept_N = np.flatnonzero(found_N > depth_N[place_N])
    kept_N = kept_N[found_N[kept_N].argsort(kind="stable")]  # the nearest last: it stays where several fall on a pixel
    depth_N[place_N[kept_N]] = found_N[kept_N]
    face_N[place_N[kept_N]] = number_F[triangle_N[kept_N]]


def _normals(corners_N33: np.ndarray) -> np.ndarray:
    """Unit normals (N, 3) of triangles, on the viewer's side."""
    a_N3, b_N3, c_N3 = corners_N33.swapaxes(0, 1)
    normal_N3 = np.cross(b_N3 - a_N3, c_N3 - a_N3)
    normal_N3 /= np.maximum(np.linalg.norm(normal_N3, axis=1, keepdims=True), 1e-20)
    return normal_N3 * np.where(normal_N3[:, 2:] < 0, np.float32(-1), np.float32(1))
