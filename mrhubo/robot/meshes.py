"""The meshes of a URDF's links: read where their files are, and passed over where they are not.

Legend: V vertices, F triangles.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np
import yourdfpy

from mrhubo.robot.mesh_files import MOST_TRIANGLES, mesh_of, read_mesh, scale_of
from mrhubo.robot.shapes import ROBOT_COLOR, Color, place_of, visual_colors
from mrhubo.robot.urdf import Description


@dataclass(frozen=True)
class LinkMesh:
    """A mesh of a link, in the link's frame."""

    link: str
    vertices_V3: np.ndarray
    """Metres."""
    faces_F3: np.ndarray
    """Numbers of vertices."""
    color: Color = ROBOT_COLOR
    """RGB, 0..1: of the element's material; what colours the file itself has are not read."""


def read_meshes(description: Description, without: Collection[str] = ()) -> list[LinkMesh]:
    """The meshes of every link's visual elements, or, where these have none to be read, of its collision elements.

    Args:
        description: the robot: meshes are looked for beside its file, and in the folders above it.
        without: links whose meshes are not wanted.
    """
    found: list[LinkMesh] = []
    triangles, colors_of = 0, visual_colors(description.parsed)
    for link in description.parsed.robot.links:
        for elements in () if link.name in without else (link.visuals, link.collisions):
            meshes = list(_meshes(link.name, elements, colors_of[link.name], description))
            if meshes:
                found += meshes
                triangles += sum(len(mesh.faces_F3) for mesh in meshes)
                break
        if triangles > MOST_TRIANGLES:
            break
    return found


def _meshes(
    link: str,
    elements: list[yourdfpy.urdf.Visual] | list[yourdfpy.urdf.Collision],
    colors: list[Color | None],
    description: Description,
) -> Iterator[LinkMesh]:
    named = next((color for color in colors if color is not None), ROBOT_COLOR)
    for number, element in enumerate(elements):
        mesh = mesh_of(element)
        if mesh is None:
            continue
        found = read_mesh(str(mesh.filename), description.path, scale_of(mesh), description.upright)
        if found is None:
            continue
        place_44 = place_of(element)
        color = (colors[number] if isinstance(element, yourdfpy.urdf.Visual) else None) or named
        yield LinkMesh(link, found[0] @ place_44[:3, :3].T + place_44[:3, 3], found[1], color)
