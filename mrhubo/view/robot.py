"""Robots as solids: the primitive shapes of a URDF, placed by the poses of its links."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import yourdfpy

from mrhubo.errors import unknown_name
from mrhubo.view.solids import Color, Solids

ROBOT_COLOR: Color = (0.80, 0.83, 0.87)
"""Colour of shapes whose URDF names none."""


Kind = Literal["sphere", "cylinder", "capsule", "box"]


@dataclass(frozen=True)
class LinkGeometry:
    """One primitive shape of a link."""

    link: str
    """Name of the link that carries it."""
    kind: Kind
    size: tuple[float, ...]
    """Metres. sphere: (radius,); cylinder, along z: (radius, length); capsule, along z: (radius, length without the
    round ends); box: (x, y, z)."""
    origin_44: np.ndarray
    """Pose (4, 4) of the shape's centre in the link's frame."""
    color: Color
    """RGB, 0..1."""


def read_geometry(urdf: yourdfpy.URDF, default_color: Color = ROBOT_COLOR) -> list[LinkGeometry]:
    """The spheres, cylinders and boxes of every link: those of its visual elements, or, where these hold none, those
    of its collision elements. Meshes are skipped, and so is what has no size. URDF has no capsules: a cylinder with a
    sphere of its radius and colour at either end becomes one.
    """
    palette = {material.name: _rgb(material) for material in urdf.robot.materials}
    shapes: list[LinkGeometry] = []
    for link in urdf.robot.links:
        materials = [visual.material for visual in link.visuals]
        colors = [_rgb(material) or palette.get(getattr(material, "name", None)) for material in materials]
        named = next((color for color in colors if color is not None), default_color)
        visible = [
            _shape(link.name, item, color or default_color) for item, color in zip(link.visuals, colors, strict=True)
        ]
        solid = [_shape(link.name, item, named) for item in link.collisions]
        found = [shape for shape in visible if shape is not None] or [shape for shape in solid if shape is not None]
        shapes.extend(_with_capsules(found))
    return shapes


def _with_capsules(shapes: list[LinkGeometry]) -> list[LinkGeometry]:
    """The shapes of one link, with every cylinder and the two spheres that round it off replaced by a capsule."""
    spheres = [shape for shape in shapes if shape.kind == "sphere"]
    used: set[int] = set()
    kept: list[LinkGeometry] = []
    for shape in shapes:
        ends: list[LinkGeometry] = []
        if shape.kind == "cylinder":
            radius, length = shape.size
            for sign in (-0.5, 0.5):
                tip_3 = shape.origin_44[:3, 3] + sign * length * shape.origin_44[:3, 2]
                ends += [sphere for sphere in spheres if _rounds_off(sphere, tip_3, radius, shape.color)][:1]
        if len(ends) == 2:
            used.update(id(sphere) for sphere in ends)
            shape = replace(shape, kind="capsule")
        kept.append(shape)
    return [shape for shape in kept if id(shape) not in used]


def _rounds_off(sphere: LinkGeometry, tip_3: np.ndarray, radius: float, color: Color) -> bool:
    apart = float(np.abs(sphere.origin_44[:3, 3] - tip_3).max())
    return apart < 1e-3 * radius + 1e-6 and abs(sphere.size[0] - radius) < 1e-3 * radius and sphere.color == color


def _rgb(material: yourdfpy.urdf.Material | None) -> Color | None:
    if material is None or material.color is None:
        return None
    red, green, blue = np.clip(np.asarray(material.color.rgba, float)[:3], 0.0, 1.0).tolist()
    return red, green, blue


def _shape(link: str, element: yourdfpy.urdf.Visual | yourdfpy.urdf.Collision, color: Color) -> LinkGeometry | None:
    geometry = element.geometry
    origin_44 = np.eye(4) if element.origin is None else np.asarray(element.origin, float)
    if geometry is None:
        return None
    if geometry.sphere is not None:
        kind: Kind = "sphere"
        size: tuple[float, ...] = (float(geometry.sphere.radius),)
    elif geometry.cylinder is not None:
        kind, size = "cylinder", (float(geometry.cylinder.radius), float(geometry.cylinder.length))
    elif geometry.box is not None:
        kind, size = "box", tuple(np.asarray(geometry.box.size, float).tolist())
    else:
        return None
    return LinkGeometry(link, kind, size, origin_44, color) if min(size) > 0.0 else None


def robot_solids(
    geometry: Sequence[LinkGeometry],
    link_poses: Mapping[str, np.ndarray],
    parents: Mapping[str, str | None] | None = None,
) -> Solids:
    """The robot with its links at ``link_poses``: name -> pose (4, 4), m, in the world frame, or any frame with z up.

    ``parents`` (link -> parent link, None at the root): where given, a robot of which fewer than a third of the links
    have shapes (the rest are meshes) gets sticks too (:func:`stick_solids`), so that the picture shows it whole.
    """
    poses_S44 = np.array([_pose(link_poses, shape.link) @ shape.origin_44 for shape in geometry]).reshape(-1, 4, 4)
    centres_S3 = poses_S44[:, :3, 3]
    half_S3, sides_S3 = np.zeros_like(centres_S3), np.zeros_like(centres_S3)
    radii_S = np.zeros(len(geometry))
    for row, shape in enumerate(geometry):
        axes_33 = poses_S44[row, :3, :3]
        radii_S[row] = shape.size[0]
        if shape.kind in ("cylinder", "capsule"):
            half_S3[row] = 0.5 * shape.size[1] * axes_33[:, 2]
        elif shape.kind == "box":
            thin, wide, long = np.argsort(shape.size)
            half_S3[row] = 0.5 * shape.size[long] * axes_33[:, long]
            sides_S3[row] = 0.5 * shape.size[wide] * axes_33[:, wide]
            radii_S[row] = 0.5 * shape.size[thin]
    shapes = Solids(
        centres_S3 - half_S3,
        centres_S3 + half_S3,
        radii_S,
        np.array([shape.color for shape in geometry]).reshape(-1, 3),
        flat_S=np.array([shape.kind == "cylinder" for shape in geometry]),
        sides_S3=sides_S3,
    )
    shaped = {shape.link for shape in geometry}
    if parents is None or 3 * len(shaped) >= len(link_poses):
        return shapes
    return Solids.concatenate([shapes, stick_solids(link_poses, parents)])


def stick_solids(
    link_poses: Mapping[str, np.ndarray],
    parents: Mapping[str, str | None],
    color: Color = ROBOT_COLOR,
    radius_m: float | None = None,
) -> Solids:
    """A robot without primitive shapes: a capsule from the origin of every link to that of its parent.

    ``link_poses``: link -> pose (4, 4), m. ``parents``: link -> parent link; the root is missing or has None.
    ``radius_m``: default 1.5% of the robot's largest extent.
    """
    if radius_m is None:
        origins_L3 = np.array([np.asarray(pose_44)[:3, 3] for pose_44 in link_poses.values()]).reshape(-1, 3)
        radius_m = max(0.015 * float(np.ptp(origins_L3, axis=0).max()) if len(origins_L3) else 0.0, 1e-3)
    rows = []
    for link, parent in parents.items():
        if parent is None:
            continue
        start, end = _pose(link_poses, parent)[:3, 3], _pose(link_poses, link)[:3, 3]
        rows.append((start, end, radius_m, radius_m))
        rows.append((end, end, 1.35 * radius_m, 1.35 * radius_m))
    return Solids.capsules(rows, color)


def _pose(link_poses: Mapping[str, np.ndarray], link: str) -> np.ndarray:
    if link not in link_poses:
        raise ValueError(f"link_poses: {unknown_name('link', link, link_poses)}")
    return np.asarray(link_poses[link], float)
