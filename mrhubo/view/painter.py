"""Solids -> picture: casts, lights, shades. No OpenGL, no window; a figure in a few tens of milliseconds on one core.

The light is a lamp from the upper left, a sky brighter than the ground, a rim against the outline and a gentle
darkening of what lies behind something near (depth unsharp masking, Luft et al. 2006), which keeps an arm apart from
the chest behind it. Light is added up in linear light (gamma 2).

Axes: H, W pixels, S solids, N covered samples. Picture frame: right, up, towards the viewer.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image

from mrhubo.view.camera import Camera
from mrhubo.view.raster import FACE, Canvas, draw, half_axes
from mrhubo.view.solids import Color, Solids
from mrhubo.view.surfaces import rods
from mrhubo.view.triangles import draw_triangles

WHITE: Color = (1.0, 1.0, 1.0)
LIGHT = (-0.45, 0.62, 0.75)
"""Default direction towards the lamp in the picture frame: from the upper left, in front."""


def render(
    solids: Solids | Sequence[Solids],
    size: tuple[int, int] = (300, 300),
    camera: Camera | None = None,
    background: Color | None = WHITE,
    supersample: int = 2,
    ground: float | str | None = "auto",
    light: tuple[float, float, float] = LIGHT,
) -> Image.Image:
    """Picture of one or several figures.

    ``size``: width, height in pixels. ``camera``: default :meth:`Camera.framing` the figures. ``background``: RGB
    0..1, or None for a transparent RGBA picture. ``supersample``: samples per pixel in either direction. ``ground``:
    height z of the floor that takes a soft shadow, m; "auto" is the lowest point of the figures, None draws no shadow.
    ``light``: direction towards the lamp, picture frame.
    """
    solids = solids if isinstance(solids, Solids) else Solids.concatenate(solids)
    width, height = size
    if min(width, height, supersample) < 1:
        raise ValueError(f"render: size {size} and supersample {supersample} must be at least 1")
    if camera is None:
        camera = Camera() if solids.nothing else Camera.framing(solids, size)
    basis_33 = camera.basis()
    pose_44 = np.eye(4)
    pose_44[:3, :3], pose_44[:3, 3] = basis_33, -basis_33 @ np.asarray(camera.target, float)
    local = solids.transformed(pose_44)

    canvas = Canvas(width * supersample, height * supersample, camera.width_m / (width * supersample))
    draw(canvas, local)
    tall_m = float(np.ptp(local.extent(np.array([0.0, 1.0, 0.0])))) if not local.nothing else 1.0
    if local.meshes:
        local = _draw_meshes(canvas, local)
    window = canvas.covered(supersample)
    seen, linear_HW4 = canvas.cut(window, supersample), np.zeros((0, 0, 4), np.float32)
    if seen.owner_HW.size:
        linear_HW4 = _shrink(_shade(seen, local, basis_33[:, 2], np.asarray(light, float)), supersample)
        linear_HW4[..., :3] *= 1.0 - _crevices(seen, supersample, tall_m)[..., None]
    if ground == "auto":
        ground = None if solids.nothing else solids.extent(np.array([0.0, 0.0, 1.0]))[0]
    shadow_HW = np.zeros((height, width), np.float32)
    if ground is not None:
        shadow_HW = _ground_shadow(solids, camera, float(ground), size)
    return _compose(linear_HW4, window, shadow_HW, background)


def _draw_meshes(canvas: Canvas, local: Solids) -> Solids:
    """Puts the meshes on the canvas; the solids, and behind them one for each mesh, which has its colour."""
    corners = [mesh.corners() for mesh in local.meshes]
    owner_F = np.repeat(len(local) + np.arange(len(corners)), [len(corners_F33) for corners_F33 in corners])
    draw_triangles(canvas, np.concatenate(corners), owner_F)
    rows = [(np.zeros(3), np.zeros(3), 1.0, 1.0)] * len(corners)
    return Solids.concatenate([local, Solids.capsules(rows, [mesh.color for mesh in local.meshes])])


def _shade(canvas: Canvas, local: Solids, up_3: np.ndarray, light_3: np.ndarray) -> np.ndarray:
    """Linear RGB times coverage, and coverage (0 or 1), of the samples (H, W, 4); ``up_3``: up, picture frame."""
    height, width = canvas.owner_HW.shape
    picture_HW4 = np.zeros((height, width, 4), np.float32)
    pixels_N = np.flatnonzero(canvas.owner_HW.ravel() >= 0)
    owner_N = canvas.owner_HW.ravel()[pixels_N]
    normal_3N = _normals(canvas, local, pixels_N, owner_N)
    if canvas.normal_HW3 is not None:  # of the meshes, for which the last solids stand
        meshed_N = owner_N >= len(local) - len(local.meshes)
        normal_3N[:, meshed_N] = canvas.normal_HW3.reshape(-1, 3)[pixels_N[meshed_N]].T
    n_w = normal_3N[2]

    light_3 = light_3 / np.linalg.norm(light_3)
    half_3 = light_3 + np.array([0.0, 0.0, 1.0])
    half_3 /= np.linalg.norm(half_3)
    directions_33 = np.stack([light_3, up_3, half_3]).astype(np.float32)
    lamp_N, sky_N, glint_N = directions_33 @ normal_3N
    lamp_N = np.clip(0.8 * lamp_N + 0.2, 0.0, None)  # wraps a little around the edge
    edge_N = np.square(1.0 - np.clip(n_w, 0.0, 1.0))
    bright_N = 0.34 + 0.15 * sky_N + 0.74 * lamp_N
    bright_N *= 1.0 - 0.40 * edge_N
    gloss_N = np.square(np.square(np.square(np.square(np.clip(glint_N, 0.0, 1.0)))))  # cos^16
    gloss_N = 0.07 * gloss_N + 0.10 * edge_N * edge_N * np.clip(sky_N, 0.0, 1.0)  # a glint, and a rim from above
    linear_S3 = np.square(local.colors_S3).astype(np.float32)
    flat_N4 = picture_HW4.reshape(-1, 4)
    values_N4 = np.ones((len(pixels_N), 4), np.float32)
    values_N4[:, :3] = linear_S3[owner_N] * bright_N[:, None]
    values_N4[:, :3] += gloss_N[:, None]
    flat_N4[pixels_N] = np.minimum(values_N4, 1.0)
    return picture_HW4


def _normals(canvas: Canvas, local: Solids, pixels_N: np.ndarray, owner_N: np.ndarray) -> np.ndarray:
    """Unit normals (3, N) of the surface at the covered samples, picture frame."""
    width = canvas.owner_HW.shape[1]
    t_N = canvas.t_HW.ravel()[pixels_N]
    face_N = t_N >= FACE
    t_N = np.where(face_N, np.float32(0.0), t_N)
    axis_S3 = (local.ends_S3 - local.starts_S3).astype(np.float32)
    growth_S = (local.end_radii_S - local.radii_S).astype(np.float32)
    radius_N = local.radii_S.astype(np.float32)[owner_N] + t_N * growth_S[owner_N]
    inverse_N = 1.0 / np.maximum(radius_N, 1e-9)
    rows_N, columns_N = np.divmod(pixels_N, width)
    seen_3N = (canvas.u_W[columns_N], canvas.v_H[rows_N], canvas.depth_HW.ravel()[pixels_N])
    normal_3N = np.empty((3, len(pixels_N)), np.float32)
    for axis in range(3):
        centre_N = local.starts_S3[:, axis].astype(np.float32)[owner_N] + t_N * axis_S3[:, axis][owner_N]
        np.multiply(seen_3N[axis] - centre_N, inverse_N, out=normal_3N[axis])
    if face_N.any():
        faces_S63 = np.zeros((len(local), 6, 3), np.float32)
        for number in np.unique(owner_N[face_N]):
            start, end = local.starts_S3[number], local.ends_S3[number]
            half_33 = half_axes(end - start, local.sides_S3[number], float(local.radii_S[number]))
            half_33 = half_33 / np.maximum(np.linalg.norm(half_33, axis=1, keepdims=True), 1e-12)
            faces_S63[number] = np.stack([-half_33, half_33], axis=1).reshape(6, 3)
        code_N = canvas.t_HW.ravel()[pixels_N][face_N].astype(int) - FACE
        normal_3N[:, face_N] = faces_S63[owner_N[face_N], code_N].T
    return normal_3N


def _crevices(canvas: Canvas, supersample: int, tall_m: float) -> np.ndarray:
    """How much darker (0..1) each pixel (H, W) is because its surroundings are nearer to the viewer."""
    covered_HW = canvas.owner_HW >= 0
    depth_HW = _shrink(np.where(covered_HW, canvas.depth_HW, np.float32(0.0)), supersample)
    share_HW = _shrink(covered_HW.astype(np.float32), supersample)
    radius = max(1, round(0.022 * tall_m / (canvas.pixel_m * supersample)))
    around_HW = _blur(depth_HW, radius) / np.maximum(_blur(share_HW, radius), 1e-6)
    nearer_HW = around_HW - depth_HW / np.maximum(share_HW, 1e-6)
    return np.where(share_HW > 0.0, np.clip(nearer_HW / (0.05 * tall_m) - 0.05, 0.0, 1.0) * 0.5, 0.0)


def _blur(picture_HW: np.ndarray, radius: int) -> np.ndarray:
    """Box blur, twice in either direction, with a window of 2 radius + 1 pixels."""
    for axis in (0, 1):
        for _ in range(2):
            lines_XY = np.moveaxis(picture_HW, axis, 0)
            total_XY = np.cumsum(np.pad(lines_XY, [(radius + 1, radius), (0, 0)]), axis=0, dtype=np.float64)
            span_XY = total_XY[2 * radius + 1 :] - total_XY[: -(2 * radius + 1)]
            picture_HW = np.moveaxis((span_XY / (2 * radius + 1)).astype(np.float32), 0, axis)
    return picture_HW


def _ground_shadow(solids: Solids, camera: Camera, ground: float, size: tuple[int, int]) -> np.ndarray:
    """Darkness (H, W), 0..1, of a soft shadow on the floor z = ``ground``: a Gaussian below points along every solid.

    On the floor the picture's right is a length, and its up a length times sin(elevation): the Gaussians separate.
    """
    width, height = size
    rise = np.sin(np.radians(camera.elevation_deg))
    if solids.nothing or rise <= 0.0:
        return np.zeros((height, width), np.float32)
    canvas = Canvas(width, height, camera.width_m / width)
    steps = np.array([0.0, 0.5, 1.0])
    starts_S3, ends_S3 = solids.starts_S3, solids.ends_S3
    radii_S = np.maximum(np.maximum(solids.radii_S, solids.end_radii_S), np.linalg.norm(solids.sides_S3, axis=1))
    if solids.meshes:
        begin_M3, end_M3, radius_M = rods(solids.meshes)
        starts_S3, ends_S3 = np.concatenate([starts_S3, begin_M3]), np.concatenate([ends_S3, end_M3])
        radii_S = np.concatenate([radii_S, radius_M])
    points_P3 = (starts_S3[:, None] + steps[:, None] * (ends_S3 - starts_S3)[:, None]).reshape(-1, 3)
    radii_P = np.repeat(np.maximum(radii_S, 1e-6), len(steps))
    above_P = np.maximum(points_P3[:, 2] - radii_P - ground, 0.0)
    below_P3 = np.column_stack([points_P3[:, :2], np.full(len(points_P3), ground)]) - np.asarray(camera.target, float)
    u_P, v_P, _ = camera.basis() @ below_P3.T
    spread_P = 0.9 * radii_P + 0.3 * above_P
    tall_m = float(np.ptp(solids.extent(np.array([0.0, 0.0, 1.0]))))
    weight_P = 0.22 * np.square(radii_P / spread_P) * np.exp(-above_P / (0.25 * max(tall_m, 1e-6)))
    across_PW = _bell(canvas.u_W, u_P, spread_P)
    along_PH = _bell(canvas.v_H, v_P, spread_P * max(rise, 0.05)) * weight_P[:, None].astype(np.float32)
    shadow_HW = along_PH.T @ across_PW
    shadow_HW = 0.3 * (1.0 - np.exp(-2.0 * shadow_HW))
    for axis, count in enumerate((height, width)):  # fades towards the border, instead of being cut off there
        fade_X = np.clip(8.0 * (1.0 - np.abs(np.linspace(-1.0, 1.0, count))), 0.0, 1.0).astype(np.float32)
        shadow_HW *= np.expand_dims(fade_X, 1 - axis)
    return shadow_HW


def _bell(x_X: np.ndarray, centre_P: np.ndarray, spread_P: np.ndarray) -> np.ndarray:
    """Gaussians (P, X) at the positions ``x_X``, 1 at their centres."""
    inverse_P = (np.sqrt(0.5) / spread_P).astype(np.float32)
    return np.exp(-np.square(x_X * inverse_P[:, None] - (centre_P * inverse_P).astype(np.float32)[:, None]))


def _shrink(picture_HW: np.ndarray, factor: int) -> np.ndarray:
    """Mean over blocks of factor x factor samples."""
    total = picture_HW[::factor, ::factor].copy()
    for row in range(factor):
        for column in range(factor):
            if row or column:
                total += picture_HW[row::factor, column::factor]
    return total * np.float32(1.0 / factor**2)


def _compose(
    linear_HW4: np.ndarray, window: tuple[slice, slice], shadow_HW: np.ndarray, background: Color | None
) -> Image.Image:
    """Gamma, then the figure, which is in the window, over its shadow over the background: edges look smoother when
    mixed after the gamma.
    """
    alpha_HW1 = linear_HW4[..., 3:]
    color_HW3 = np.sqrt(linear_HW4[..., :3] * alpha_HW1)  # = alpha * sqrt(color), as the colour is already times alpha
    behind_HW1 = 1.0 - shadow_HW[..., None]
    behind_HW1[window] *= 1.0 - alpha_HW1
    if background is not None:
        mixed_HW3 = behind_HW1 * np.asarray(background, np.float32)
        mixed_HW3[window] += color_HW3
        return Image.fromarray(_bytes(mixed_HW3))
    straight_HW4 = np.concatenate([np.zeros((*shadow_HW.shape, 3), np.float32), 1.0 - behind_HW1], axis=-1)
    straight_HW4[window][..., :3] = color_HW3 / np.maximum(straight_HW4[window][..., 3:], 1e-6)
    return Image.fromarray(_bytes(straight_HW4))


def _bytes(values: np.ndarray) -> np.ndarray:
    return (np.clip(values, 0.0, 1.0) * np.float32(255.0) + np.float32(0.5)).astype(np.uint8)
