"""A URDF that needs no mesh for collisions: what stands for its meshes is written into it, for packages."""

from __future__ import annotations

import numpy as np
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)

from mrhubo.robot.document import read_document
from mrhubo.robot.shapes import LinkGeometry
from mrhubo.robot.urdf import Description


def urdf_without_meshes(description: Description) -> bytes:
    """The robot's file, in which collision meshes that were read are capsules: a cylinder with a ball at either end, as
    `mrhubo.robot.shapes` reads them. A link with a mesh that could not be read keeps all of its meshes.
    """
    robot = read_document(description.path, description.text).robot
    for link in robot.findall("link"):
        name = str(link.get("name"))
        shapes = [shape for shape in description.solids.of_meshes if shape.link == name]
        if not shapes or name in description.solids.gaps:
            continue
        for element in link.findall("collision"):
            if element.find("geometry/mesh") is not None:
                link.remove(element)
        for shape in shapes:
            for kind, size, centre_3 in _parts(shape):
                element = etree.SubElement(link, "collision")
                etree.SubElement(element, "origin", xyz=_text(centre_3), rpy=_text(_angles(shape.origin_44)))
                etree.SubElement(etree.SubElement(element, "geometry"), kind, size)
    return etree.tostring(robot, encoding="utf-8", xml_declaration=True)


def _parts(shape: LinkGeometry) -> list[tuple[str, dict[str, str], np.ndarray]]:
    """Tags, sizes and centres (3,) [m] of a capsule's parts, or of a ball."""
    centre_3, radius = shape.origin_44[:3, 3], repr(shape.size[0])
    if shape.kind == "sphere":
        return [("sphere", {"radius": radius}, centre_3)]
    half_3 = 0.5 * shape.size[1] * shape.origin_44[:3, 2]
    ends = [("sphere", {"radius": radius}, end_3) for end_3 in (centre_3 - half_3, centre_3 + half_3)]
    return [("cylinder", {"radius": radius, "length": repr(shape.size[1])}, centre_3), *ends]


def _angles(pose_44: np.ndarray) -> tuple[float, float, float]:
    """Roll, pitch and yaw [rad] that turn z to where a pose has it; a capsule is the same all around."""
    x, y, z = pose_44[:3, 2].tolist()
    return 0.0, float(np.arctan2(np.hypot(x, y), z)), float(np.arctan2(y, x))


def _text(numbers: object) -> str:
    return " ".join(repr(float(number)) for number in np.asarray(numbers, float))
