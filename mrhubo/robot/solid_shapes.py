"""What of a robot can bump into what: the primitive shapes of its collision elements, and capsules in place of meshes.

Hands often have no collision element, though what they are fixed to has: of these, what is seen counts, a mesh as one
capsule. Where three hug a flat hand, it stays between two shapes of a thigh more often when it is to give way.

A mesh is looked for where the URDF names it, and in the folders above (`mrhubo.robot.mesh_files`). Where it is
not there, or cannot be read, the link has a gap, and nobody knows whether it touches anything.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yourdfpy

from mrhubo.fast.rotations import shortest_turn
from mrhubo.robot.capsules import Capsule
from mrhubo.robot.kept_capsules import kept_capsules
from mrhubo.robot.mesh_files import MOST_TRIANGLES, mesh_of, read_mesh, scale_of
from mrhubo.robot.shapes import ROBOT_COLOR, LinkGeometry, place_of, read_collision_geometry, read_geometry

_MOST_MESHES = 300
"""Different meshes of one robot: a few hundredths of a second each."""

_Key = tuple[str, tuple[float, ...], bool]
"""A mesh's file and scale, and whether one capsule is to stand for it."""


@dataclass(frozen=True)
class SolidShapes:
    """The shapes of a robot's links."""

    shapes: tuple[LinkGeometry, ...]
    """Primitive shapes, and what stands for meshes."""
    of_meshes: tuple[LinkGeometry, ...]
    """Those of them that stand for meshes: capsules and balls."""
    gaps: frozenset[str]
    """Links with a mesh that is not there, cannot be read, or is too much."""


def read_solids(urdf: yourdfpy.URDF, path: Path, upright: bool) -> SolidShapes:
    """The shapes of every link's collision elements, and what is seen of hands that have none.

    Args:
        urdf: what yourdfpy has made of the robot.
        path: its file.
        upright: whether meshes whose y is up are turned (`mrhubo.robot.mesh_axes`).
    """
    seen_alone = _ends_seen_alone(urdf)
    meshes: dict[_Key, np.ndarray | None] = {}
    places: list[tuple[str, _Key, np.ndarray]] = []
    triangles = 0
    for link in urdf.robot.links:
        alone = link.name in seen_alone
        for element in link.visuals if alone else link.collisions:
            mesh = mesh_of(element)
            if mesh is None:
                continue
            scale_3 = scale_of(mesh)
            key = str(mesh.filename), tuple(scale_3.tolist()), alone
            if key not in meshes:
                enough = len(meshes) >= _MOST_MESHES or triangles > MOST_TRIANGLES
                read = None if enough else read_mesh(key[0], path, scale_3, upright)
                meshes[key] = None if read is None else read[0][np.unique(read[1])]
                triangles += 0 if read is None else len(read[1])
            places.append((link.name, key, place_of(element)))
    there = {key: vertices_V3 for key, vertices_V3 in meshes.items() if vertices_V3 is not None}
    hugging = kept_capsules([(vertices_V3, key[2]) for key, vertices_V3 in there.items()])
    known = dict(zip(there, hugging, strict=True))
    found = [_geometry(link, c, place_44) for link, key, place_44 in places for c in known.get(key, [])]
    gaps = {link for link, key, _ in places if key not in known and not key[2]}
    simple = [shape for shape in read_geometry(urdf) if shape.link in seen_alone]
    return SolidShapes((*read_collision_geometry(urdf), *simple, *found), tuple(found), frozenset(gaps))


def _ends_seen_alone(urdf: yourdfpy.URDF) -> set[str]:
    """Links that end a limb, are seen, and collide with nothing by the file, while what they are fixed to does: hands,
    most of the time, which go through the thighs if nobody looks at them.
    """
    links = {link.name: link for link in urdf.robot.links}
    onward = {joint.parent for joint in urdf.robot.joints}
    held = {joint.child: joint.parent for joint in urdf.robot.joints if joint.type == "fixed"}
    return {
        name
        for name, link in links.items()
        if link.visuals and not link.collisions and name not in onward and name in held and links[held[name]].collisions
    }


def _geometry(link: str, capsule: Capsule, place_44: np.ndarray) -> LinkGeometry:
    """A capsule, given in the frame at a place in the link, as a shape of the link."""
    start_3, end_3 = (place_44[:3, :3] @ end + place_44[:3, 3] for end in capsule[:2])
    length, pose_44 = float(np.linalg.norm(end_3 - start_3)), np.eye(4)
    pose_44[:3, 3] = (start_3 + end_3) / 2
    if length < 1e-9:
        return LinkGeometry(link, "sphere", (capsule[2],), pose_44, ROBOT_COLOR)
    along_3 = (end_3 - start_3) / length
    # A capsule's ends are alike, and upwards is never opposite to z, where no shortest turn is told.
    pose_44[:3, :3] = shortest_turn(np.array([0.0, 0.0, 1.0]), along_3 if along_3[2] >= 0 else -along_3)
    return LinkGeometry(link, "capsule", (capsule[2], length), pose_44, ROBOT_COLOR)
