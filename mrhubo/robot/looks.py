"""What a robot looks like: of each link its meshes and shapes, as a viewer shows them."""

from __future__ import annotations

from dataclasses import dataclass

from mrhubo.robot.bare import bare_sticks
from mrhubo.robot.meshes import LinkMesh, read_meshes
from mrhubo.robot.shapes import LinkGeometry, read_geometry
from mrhubo.robot.urdf import Description


@dataclass(frozen=True)
class Looks:
    """What is drawn of a robot."""

    meshes: list[LinkMesh]
    shapes: list[LinkGeometry]
    sticks: dict[str, str]
    """`{end: start}`, links where neither is (`bare_sticks`)."""


def read_looks(description: Description) -> Looks:
    """The meshes and shapes of the URDF's visual elements; for a link without any that can be read its collision
    elements, or the capsules that stand for collision meshes whose files are not there.
    """
    parsed = description.parsed
    meshes = read_meshes(description)
    meshed = {mesh.link for mesh in meshes}
    visible = {
        link.name
        for link in parsed.robot.links
        for visual in link.visuals
        if visual.geometry is not None and visual.geometry.mesh is None
    }
    shapes = [shape for shape in read_geometry(parsed) if shape.link not in meshed or shape.link in visible]
    dressed = meshed | {shape.link for shape in shapes}
    if any(link.collisions and link.name not in dressed for link in parsed.robot.links):  # finding them takes seconds
        shapes += [shape for shape in description.solids.of_meshes if shape.link not in dressed]
    return Looks(meshes, shapes, bare_sticks(description, dressed | {shape.link for shape in shapes}))
