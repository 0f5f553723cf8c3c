"""What a robot looks like: of each link its meshes and shapes, as a viewer shows them."""

from __future__ import annotations

from dataclasses import dataclass

import yourdfpy

from mrhubo.robot.bare import bare_sticks
from mrhubo.robot.mesh_files import find_mesh, mesh_of
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
    elements, or the capsules that stand for collision meshes whose files are not there. A link that only collides
    is not drawn where it keeps its place to one that is seen: a box around a hand is there for safety.
    """
    parsed = description.parsed
    unseen = _seen_by_others(description)
    meshes = read_meshes(description, unseen)
    meshed = {mesh.link for mesh in meshes}
    visible = {
        link.name
        for link in parsed.robot.links
        for visual in link.visuals
        if visual.geometry is not None and visual.geometry.mesh is None
    }
    shapes = [shape for shape in read_geometry(parsed) if shape.link not in meshed or shape.link in visible]
    shapes = [shape for shape in shapes if shape.link not in unseen]
    dressed = meshed | {shape.link for shape in shapes} | unseen
    if any(link.collisions and link.name not in dressed for link in parsed.robot.links):  # finding them takes seconds
        shapes += [shape for shape in description.solids.of_meshes if shape.link not in dressed]
    return Looks(meshes, shapes, bare_sticks(description, meshed | {shape.link for shape in shapes}))


def _seen_by_others(description: Description) -> set[str]:
    """Links without looks of their own, each fixed to links of which some have any that can be read."""
    parsed = description.parsed
    body_of = {
        link.name: next((j.child for j in description.joints_above(link.name) if j.kind != "fixed"), description.root)
        for link in parsed.robot.links
    }
    looking = {link.name for link in parsed.robot.links if any(_seen(visual, description) for visual in link.visuals)}
    seen = {body_of[link] for link in looking}
    return {link.name for link in parsed.robot.links if not link.visuals and body_of[link.name] in seen}


def _seen(visual: yourdfpy.urdf.Visual, description: Description) -> bool:
    """Whether there is something to be drawn of an element."""
    mesh = mesh_of(visual)
    if mesh is None:
        return visual.geometry is not None
    return find_mesh(str(mesh.filename), description.path) is not None
