"""Which solid does each pixel see, and how far away? An orthographic ray caster with a z-buffer, vectorised over
pixels.

A tapered capsule is the union of the spheres with centre a + t b and radius r + t d, 0 <= t <= 1. Along the line of
sight of a pixel at (u, v) the surface of sphere t lies at

    w(t) = a_w + t b_w + sqrt(Q(t)),    Q(t) = (r + t d)^2 - (a_u + t b_u - u)^2 - (a_v + t b_v - v)^2,

which for k = b_u^2 + b_v^2 - d^2 > 0 is concave in t: with Q(t) = m - k (t - t0)^2 its maximum is at t0 + b_w sqrt(m /
(k (k + b_w^2))), cut off at 0 and 1. So one formula draws cones, cylinders and spheres exactly, and the z-buffer makes
them meet where they should, whatever their order.

Picture frame: u to the right, v up, w towards the viewer, metres, origin at the camera's target. Axes: H, W pixels, S
solids.
"""

from __future__ import annotations

import copy
import math

import numpy as np

from mrhubo.view.solids import Solids

FACE = 2
"""``Canvas.t_HW`` holds 0..1 on a round side, and FACE + number of the face on a flat one."""


class Canvas:
    """z-buffer: per pixel the depth w (m), the solid that owns it (-1: none), and where on that solid."""

    def __init__(self, width: int, height: int, pixel_m: float) -> None:
        self.u_W = ((np.arange(width) + 0.5 - width / 2) * pixel_m).astype(np.float32)
        self.v_H = ((height / 2 - np.arange(height) - 0.5) * pixel_m).astype(np.float32)
        self.depth_HW = np.full((height, width), -np.inf, np.float32)
        self.owner_HW = np.full((height, width), -1, np.int32)
        self.t_HW = np.zeros((height, width), np.float32)
        self.pixel_m = pixel_m
        self.normal_HW3: np.ndarray | None = None
        """Of triangles (`mrhubo.view.triangles`), picture frame."""

    def window(self, u_low: float, u_high: float, v_low: float, v_high: float) -> tuple[slice, slice]:
        """Rows and columns whose pixel centres may lie in the rectangle."""
        height, width = self.depth_HW.shape
        first = math.floor(width / 2 + u_low / self.pixel_m), math.floor(height / 2 - v_high / self.pixel_m)
        last = math.ceil(width / 2 + u_high / self.pixel_m), math.ceil(height / 2 - v_low / self.pixel_m)
        return (
            slice(min(max(first[1], 0), height), min(max(last[1], 0), height)),
            slice(min(max(first[0], 0), width), min(max(last[0], 0), width)),
        )

    def covered(self, step: int) -> tuple[slice, slice]:
        """Rows and columns of blocks of ``step`` by ``step`` outside which no solid is seen."""
        seen_HW = self.owner_HW >= 0
        found = [np.flatnonzero(seen_HW.any(axis=axis)) // step for axis in (1, 0)]
        rows, columns = (slice(at[0], at[-1] + 1) if len(at) else slice(0, 0) for at in found)
        return rows, columns

    def cut(self, blocks: tuple[slice, slice], step: int) -> Canvas:
        """Rows and columns of such blocks: views of the canvas' arrays."""
        window = tuple(slice(step * axis.start, step * axis.stop) for axis in blocks)
        part = copy.copy(self)
        part.v_H, part.u_W = self.v_H[window[0]], self.u_W[window[1]]
        part.depth_HW, part.owner_HW, part.t_HW = self.depth_HW[window], self.owner_HW[window], self.t_HW[window]
        part.normal_HW3 = None if self.normal_HW3 is None else self.normal_HW3[window]
        return part

    def put(
        self, window: tuple[slice, slice], number: int, hit: np.ndarray, depth: np.ndarray, t: np.ndarray | float
    ) -> None:
        """Keep what is hit and nearer than what is there."""
        before = self.depth_HW[window]
        hit = hit & (depth > before)
        np.copyto(before, depth, where=hit)
        np.copyto(self.owner_HW[window], number, where=hit)
        np.copyto(self.t_HW[window], t, where=hit, casting="same_kind")


def draw(canvas: Canvas, local: Solids) -> None:
    """Put all solids, given in the picture frame, on the canvas."""
    axis_S3 = local.ends_S3 - local.starts_S3
    box_S = np.any(local.sides_S3 != 0.0, axis=1)
    tube_S = local.flat_S & np.any(axis_S3 != 0.0, axis=1)
    radii = zip(local.radii_S.tolist(), local.end_radii_S.tolist(), strict=True)
    for number, (radius, end_radius) in enumerate(radii):
        start, axis = local.starts_S3[number], axis_S3[number]
        if box_S[number]:
            _draw_box(canvas, number, start, axis, local.sides_S3[number], radius)
        elif tube_S[number]:
            _draw_cylinder(canvas, number, start, axis, radius)
        else:
            _draw_capsule(canvas, number, start, axis, radius, end_radius)


def _draw_capsule(canvas: Canvas, number: int, a: np.ndarray, b: np.ndarray, radius: float, end_radius: float) -> None:
    # Python's numbers throughout: NumPy's own are of double precision, and so would be what they are multiplied with
    (a_u, a_v, a_w), (b_u, b_v, b_w) = a.tolist(), b.tolist()
    end_u, end_v = a_u + b_u, a_v + b_v
    window = canvas.window(
        min(a_u - radius, end_u - end_radius),
        max(a_u + radius, end_u + end_radius),
        min(a_v - radius, end_v - end_radius),
        max(a_v + radius, end_v + end_radius),
    )
    du_W, dv_H1 = canvas.u_W[window[1]] - a_u, canvas.v_H[window[0], None] - a_v
    if du_W.size == 0 or dv_H1.size == 0:
        return
    growth = end_radius - radius
    k = b_u * b_u + b_v * b_v - growth * growth
    flat_enough = k > 1e-6 * (b_u * b_u + b_v * b_v + b_w * b_w + 1e-12)
    q0_HW = (radius * radius - du_W * du_W) - dv_H1 * dv_H1

    def put(t_HW: np.ndarray) -> None:
        q_HW = t0_k_HW * 2.0  # Q(t) = q0 + t (2 k t0 - k t)
        q_HW -= k * t_HW
        q_HW *= t_HW
        q_HW += q0_HW
        hit_HW = q_HW > 0.0
        np.maximum(q_HW, 0.0, out=q_HW)
        np.sqrt(q_HW, out=q_HW)
        q_HW += b_w * t_HW
        q_HW += a_w
        canvas.put(window, number, hit_HW, q_HW, t_HW)

    t0_k_HW = (du_W * b_u + radius * growth) + dv_H1 * b_v  # k t0
    if flat_enough:
        m_HW = t0_k_HW * t0_k_HW
        m_HW *= 1.0 / k
        m_HW += q0_HW
        np.maximum(m_HW, 0.0, out=m_HW)
        np.sqrt(m_HW, out=m_HW)
        m_HW *= b_w / math.sqrt(k * (k + b_w * b_w))
        m_HW += t0_k_HW * (1.0 / k)
        np.maximum(m_HW, 0.0, out=m_HW)
        np.minimum(m_HW, 1.0, out=m_HW)
        put(m_HW)
        return
    # seen (nearly) end-on: the nearest point is on one of the end spheres, or, for k < 0, on the cone between them
    put(np.zeros_like(q0_HW))
    if b_u or b_v or b_w:
        put(np.ones_like(q0_HW))
    if k < 0.0 and k + b_w * b_w > 0.0:
        m_HW = q0_HW + t0_k_HW * t0_k_HW / k
        shift_HW = np.sqrt(np.maximum(-m_HW, 0.0)) * (b_w / math.sqrt(-k * (k + b_w * b_w)))
        put(np.clip(t0_k_HW / k - shift_HW, 0.0, 1.0))


def _draw_cylinder(canvas: Canvas, number: int, a: np.ndarray, b: np.ndarray, radius: float) -> None:
    length_squared = float(b @ b)
    reach = radius * np.sqrt(np.maximum(1.0 - b * b / length_squared, 0.0))
    low, high = np.minimum(a, a + b) - reach, np.maximum(a, a + b) + reach
    window = canvas.window(low[0], high[0], low[1], high[1])
    du_W, dv_H1 = canvas.u_W[window[1]] - np.float32(a[0]), canvas.v_H[window[0], None] - np.float32(a[1])
    if du_W.size == 0 or dv_H1.size == 0:
        return
    b_u, b_v, b_w = b.tolist()
    k = b_u * b_u + b_v * b_v
    along_HW = du_W * b_u + dv_H1 * b_v
    rho2_HW = du_W * du_W + dv_H1 * dv_H1
    if k > 1e-9 * length_squared:
        t0_HW = along_HW / k
        m_HW = (radius * radius - rho2_HW) + along_HW * t0_HW
        root_HW = np.sqrt(np.maximum(m_HW, 0.0))
        t_HW = t0_HW + root_HW * (b_w / np.sqrt(k * length_squared))
        depth_HW = a[2] + t_HW * b_w + np.sqrt(np.maximum(m_HW - k * (t_HW - t0_HW) ** 2, 0.0))
        canvas.put(window, number, (m_HW > 0.0) & (t_HW >= 0.0) & (t_HW <= 1.0), depth_HW.astype(np.float32), t_HW)
    if b_w * b_w > 1e-9 * length_squared:
        end = int(b_w > 0.0)  # the disc that faces the viewer
        rise_HW = (end * length_squared - along_HW) / b_w  # w of the disc's plane above a
        apart2_HW = rho2_HW + rise_HW**2 - end * length_squared  # squared distance from the disc's centre
        depth_HW = (a[2] + rise_HW).astype(np.float32)
        canvas.put(window, number, apart2_HW <= radius * radius, depth_HW, float(FACE + end))


def _draw_box(canvas: Canvas, number: int, a: np.ndarray, b: np.ndarray, side: np.ndarray, radius: float) -> None:
    half_33 = half_axes(b, side, radius)
    centre = a + 0.5 * b
    reach = np.abs(half_33).sum(axis=0)
    window = canvas.window(centre[0] - reach[0], centre[0] + reach[0], centre[1] - reach[1], centre[1] + reach[1])
    du_W, dv_H1 = canvas.u_W[window[1]] - np.float32(centre[0]), canvas.v_H[window[0], None] - np.float32(centre[1])
    near_HW = np.full((dv_H1.size, du_W.size), np.inf, np.float32)  # where the line of sight enters
    far_HW = np.full_like(near_HW, -np.inf)
    face_HW = np.zeros_like(near_HW)
    for axis, half in enumerate(half_33):
        normal = half / max(float(half @ half), 1e-18)
        level_HW = du_W * normal[0] + dv_H1 * normal[1]
        if abs(normal[2]) * np.linalg.norm(half) < 1e-6:  # edge-on: inside the slab or never
            near_HW[np.abs(level_HW) > 1.0] = -np.inf
            continue
        sign = np.sign(normal[2])
        enter_HW = ((sign - level_HW) / normal[2]).astype(np.float32)
        np.copyto(face_HW, FACE + 2 * axis + (sign > 0.0), where=enter_HW < near_HW, casting="same_kind")
        np.minimum(near_HW, enter_HW, out=near_HW)
        np.maximum(far_HW, (-sign - level_HW) / normal[2], out=far_HW, casting="same_kind")
    canvas.put(window, number, near_HW >= far_HW, near_HW + np.float32(centre[2]), face_HW)


def half_axes(b: np.ndarray, side: np.ndarray, radius: float) -> np.ndarray:
    """Rows: half of a box's length, width and thickness as vectors, m."""
    thickness = np.cross(b, side)
    return np.stack([0.5 * b, side, thickness * (radius / max(float(np.linalg.norm(thickness)), 1e-12))])
