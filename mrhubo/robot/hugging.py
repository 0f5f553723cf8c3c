"""Capsules fitted to a convex hull: moved, turned and sized until their surfaces are near each other.

Least squares (K. Levenberg, 1944; D. Marquardt, 1963) of two kinds of distances: from points on the hull to the nearest
capsule, whether they are inside of it or out, and by how much the round ends of capsules stick out of the hull's sides.

Legend: K capsules, X points on the hull, F its flat sides, I points inside.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from mrhubo.robot.capsules import Capsule

_POINTS = 400
_ROUNDS = 25
_OUT = 0.35
"""How much it counts that ends stick out, beside the points: so capsules take up about as much room as the hull."""
_LEAST = 1e-4
"""The smallest radius [m]."""
_PARTS = 12
"""Rounds in which points inside are parted, each to the nearest middle."""
_WIDE = 1.7
"""Half width of a round part over the root mean square of its points' distances from its middle, about."""


class Surface:
    """The surface of a convex hull: points on it, evenly by area, and its sides."""

    def __init__(self, hull: ConvexHull) -> None:
        """Of a hull [m]; ValueError where its areas are 0."""
        triangles_T33 = hull.points[hull.simplices]
        edges_T23 = triangles_T33[:, 1:] - triangles_T33[:, :1]
        areas_T = np.linalg.norm(np.cross(edges_T23[:, 0], edges_T23[:, 1]), axis=1)
        generator = np.random.default_rng(0)
        chosen_X = generator.choice(len(areas_T), _POINTS, p=areas_T / areas_T.sum())
        share_X2 = generator.uniform(size=(_POINTS, 2))
        share_X2 = np.where(share_X2.sum(axis=1, keepdims=True) > 1, 1 - share_X2, share_X2)
        self.points_X3 = triangles_T33[chosen_X, 0] + np.einsum("xi,xij->xj", share_X2, edges_T23[chosen_X])
        self.sides_F4 = np.unique(np.round(hull.equations, 5), axis=0)

    def fitted(self, capsules: list[Capsule]) -> list[Capsule]:
        """As many capsules, nearer to the surface."""
        now_K7 = np.array([[*start_3, *end_3, radius] for start_3, end_3, radius in capsules])
        off, slope = self._off(now_K7)
        damping = 1e-2
        for _ in range(_ROUNDS):
            square, pull = slope.T @ slope, slope.T @ off
            step = np.linalg.solve(square + damping * np.diag(square.diagonal() + 1e-9), pull)
            next_K7 = now_K7 - step.reshape(-1, 7)
            next_K7[:, 6] = np.maximum(next_K7[:, 6], _LEAST)
            next_off, next_slope = self._off(next_K7)
            if next_off @ next_off < off @ off:
                done = off @ off - next_off @ next_off < 1e-3 * (off @ off)
                now_K7, off, slope, damping = next_K7, next_off, next_slope, damping / 3
                if done:
                    break
            else:
                damping *= 5
        return [(row_7[:3], row_7[3:6], float(row_7[6])) for row_7 in now_K7]

    def _off(self, capsules_K7: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What is to be small (X + 2 K,) [m], and its derivative by the capsules (X + 2 K, 7 K)."""
        count, points = len(capsules_K7), len(self.points_X3)
        start_K3, end_K3, radius_K = capsules_K7[:, :3], capsules_K7[:, 3:6], capsules_K7[:, 6]
        along_K3 = end_K3 - start_K3
        from_XK3 = self.points_X3[:, None] - start_K3
        share_XK = np.einsum("xki,ki->xk", from_XK3, along_K3) / np.maximum((along_K3**2).sum(axis=1), 1e-12)
        share_XK = share_XK.clip(0, 1)
        across_XK3 = from_XK3 - share_XK[..., None] * along_K3
        length_XK = np.linalg.norm(across_XK3, axis=-1)
        nearest_X, row_X = (length_XK - radius_K).argmin(axis=1), np.arange(points)
        slope = np.zeros((points + 2 * count, count, 7))
        off = np.empty(points + 2 * count)
        off[:points] = (length_XK - radius_K)[row_X, nearest_X]
        normal_X3 = across_XK3[row_X, nearest_X] / np.maximum(length_XK[row_X, nearest_X], 1e-9)[:, None]
        share_X1 = share_XK[row_X, nearest_X][:, None]
        slope[row_X, nearest_X, :3] = (share_X1 - 1) * normal_X3
        slope[row_X, nearest_X, 3:6] = -share_X1 * normal_X3
        slope[row_X, nearest_X, 6] = -1
        for which, ends_K3 in enumerate((start_K3, end_K3)):
            out_KF = ends_K3 @ self.sides_F4[:, :3].T + self.sides_F4[:, 3] + radius_K[:, None]
            side_K, rows = out_KF.argmax(axis=1), points + which * count + np.arange(count)
            off[rows] = out_KF.max(axis=1).clip(0)
            out_K1 = (off[rows] > 0)[:, None]
            slope[rows, np.arange(count), 3 * which : 3 * which + 3] = out_K1 * self.sides_F4[side_K, :3]
            slope[rows, np.arange(count), 6] = out_K1[:, 0]
        weight = np.concatenate((np.full(points, points**-0.5), np.full(2 * count, _OUT * (2 * count) ** -0.5)))
        return off * weight, (slope * weight[:, None, None]).reshape(len(off), -1)


def parted(inside_I3: np.ndarray, count: int) -> list[Capsule]:
    """Capsules, so many, about the parts of points inside (I, 3) that are nearest to each other (S. Lloyd, 1957), each
    along its part.
    """
    middle_K3 = inside_I3[np.linspace(0, len(inside_I3) - 1, count).astype(int)]
    part_I = np.zeros(len(inside_I3), int)
    for _ in range(_PARTS):
        part_I = ((inside_I3[:, None] - middle_K3) ** 2).sum(axis=-1).argmin(axis=1)
        middle_K3 = np.array([
            inside_I3[part_I == k].mean(axis=0) if (part_I == k).any() else middle_K3[k] for k in range(count)
        ])  # fmt: skip
    found = []
    for k in range(count):
        spread_I3 = inside_I3[part_I == k] - middle_K3[k]
        if len(spread_I3) < 4:
            continue
        _, size_3, axes_33 = np.linalg.svd(spread_I3, full_matrices=False)
        long, *thin = _WIDE * size_3 / len(spread_I3) ** 0.5
        radius = max(float(np.sqrt(thin[0] * thin[1])), _LEAST)
        half_3 = max(long - radius, _LEAST) * axes_33[0]
        found.append((middle_K3[k] - half_3, middle_K3[k] + half_3, radius))
    return found
