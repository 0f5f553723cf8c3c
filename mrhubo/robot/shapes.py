"""The primitive shapes of a URDF's links: what they look like, and what can bump into what."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import yourdfpy

Color = tuple[float, float, float]
"""RGB, 0..1."""
ROBOT_COLOR: Color = (0.80, 0.83, 0.87)
"""Colour of shapes whose URDF names none."""

_MARKER = 0.003
"""Size under which a shape is no part of a robot, as a share of it: 5 mm on a human's. Contacts of feet have 10."""

_LARGE_M, _LARGE = 5.0, 10.0
"""Half of a file's shapes larger than that, and than so many times all links in a row, are in millimetres [m]."""
_SOME = 4
"""Shapes of a file at the least for its unit to be told by them."""

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
    """The spheres, cylinders and boxes of every link, for looks: those of its visual elements, or, where these hold
    none, those of its collision elements. Meshes are skipped, and so is what has no size. A cylinder with a
    sphere of its radius and colour at either end is a capsule.
    """
    shapes: list[LinkGeometry] = []
    colors_of = visual_colors(urdf)
    seen, solids = (metres_of(urdf, word) for word in ("visuals", "collisions"))
    for link in urdf.robot.links:
        colors = colors_of[link.name]
        named = next((color for color in colors if color is not None), default_color)
        visible = [
            _shape(link.name, item, color or default_color, seen)
            for item, color in zip(link.visuals, colors, strict=True)
        ]
        solid = [_shape(link.name, item, named, solids) for item in link.collisions]
        found = [shape for shape in visible if shape is not None] or [shape for shape in solid if shape is not None]
        shapes.extend(_with_capsules(found))
    return shapes


def visual_colors(urdf: yourdfpy.URDF) -> dict[str, list[Color | None]]:
    """The colour of each visual element, by link: its material's, or that of the robot's material of this name."""
    palette = {material.name: _rgb(material) for material in urdf.robot.materials}
    return {
        link.name: [_rgb(v.material) or palette.get(getattr(v.material, "name", None)) for v in link.visuals]
        for link in urdf.robot.links
    }


def read_collision_geometry(urdf: yourdfpy.URDF) -> list[LinkGeometry]:
    """The shapes of every link's collision elements, as above."""
    shapes, metres = [], metres_of(urdf, "collisions")
    for link in urdf.robot.links:
        found = [_shape(link.name, element, ROBOT_COLOR, metres) for element in link.collisions]
        shapes += _with_capsules([shape for shape in found if shape is not None])
    return shapes


def metres_of(urdf: yourdfpy.URDF, word: Literal["visuals", "collisions"]) -> float:
    """Metres of the unit in which a file gives its primitive shapes, those that are seen or those that collide: a
    thousandth where most are far larger than the robot, as where a drawing program wrote them; else 1.
    """
    reach = sum(float(np.linalg.norm(joint.origin[:3, 3])) for joint in urdf.robot.joints if joint.origin is not None)
    elements = (element for link in urdf.robot.links for element in getattr(link, word))
    sizes = [_extent(shape) for element in elements if (shape := _shape("", element, ROBOT_COLOR)) is not None]
    large = len(sizes) >= _SOME and reach > 0.0 and float(np.median(sizes)) > max(_LARGE_M, _LARGE * reach)
    return 1e-3 if large else 1.0


def without_markers(shapes: Iterable[LinkGeometry], size: float) -> list[LinkGeometry]:
    """The shapes without those that only mark a place, as a box of a millimetre at a frame does.

    Args:
        shapes: of a robot.
        size: about the robot's own [m].
    """
    return [shape for shape in shapes if _extent(shape) > _MARKER * size]


def place_of(element: yourdfpy.urdf.Visual | yourdfpy.urdf.Collision) -> np.ndarray:
    """Where an element is in its link: a new pose (4, 4) [m]."""
    return np.eye(4) if element.origin is None else np.array(element.origin, float)


def _extent(shape: LinkGeometry) -> float:
    """About the longest side of the box around a shape [m]."""
    if shape.kind == "box":
        return max(shape.size)
    radius, *length = shape.size
    return max(2 * radius, *(length or (0.0,)))


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


def _shape(
    link: str, element: yourdfpy.urdf.Visual | yourdfpy.urdf.Collision, color: Color, metres: float = 1.0
) -> LinkGeometry | None:
    geometry = element.geometry
    origin_44 = place_of(element)
    origin_44[:3, 3] *= metres
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
    size = tuple(metres * length for length in size)
    return LinkGeometry(link, kind, size, origin_44, color) if min(size) > 0.0 else None
