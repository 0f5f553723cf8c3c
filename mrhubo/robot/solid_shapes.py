"""What of a robot can bump into what: the primitive shapes of its collision elements, and capsules in place of meshes.

Hands often have no collision element, though what they are fixed to has: of these, what is seen counts, a mesh as one
capsule. Where three hug a flat hand, it stays between two shapes of a thigh more often when it is to give way.

A mesh is looked for where the URDF names it, beside it and in the folders above (`mrhubo.robot.meshes`). Where it is
not there, or cannot be read, the link has a gap, and nobody knows whether it touches anything.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yourdfpy

from mrhubo.fast.rotations import shortest_turn
from mrhubo.robot.capsules import Capsule
from mrhubo.robot.hulls import capsules_of
from mrhubo.robot.meshes import MOST_TRIANGLES, read_mesh, scale_of
from mrhubo.robot.shapes import ROBOT_COLOR, LinkGeometry, read_collision_geometry, read_geometry

_MOST_MESHES = 300
"""Different meshes of one robot: a few hundredths of a second each."""


@dataclass(frozen=True)
class SolidShapes:
    """The shapes of a robot's links."""

    shapes: tuple[LinkGeometry, ...]
    """Primitive shapes, and what stands for meshes."""
    of_meshes: tuple[LinkGeometry, ...]
    """Those of them that stand for meshes: capsules and balls."""
    gaps: frozenset[str]
    """Links with a mesh that is not there, cannot be read, or is too much."""


def read_solids(urdf: yourdfpy.URDF, path: Path) -> SolidShapes:
    """The shapes of every link's collision elements, and what is seen of hands that have none.

    Args:
        urdf: what yourdfpy has made of the robot.
        path: its file.
    """
    known: dict[tuple[str, tuple[float, ...], bool], list[Capsule]] = {}
    found: list[LinkGeometry] = []
    gaps: set[str] = set()
    triangles = 0
    seen_alone = _ends_seen_alone(urdf)
    for link in urdf.robot.links:
        for element in link.visuals if link.name in seen_alone else link.collisions:
            mesh = None if element.geometry is None else element.geometry.mesh
            if mesh is None:
                continue
            scale_3 = scale_of(mesh)
            key = str(mesh.filename), tuple(scale_3.tolist()), link.name in seen_alone
            if key not in known:
                known[key] = []
                enough = len(known) > _MOST_MESHES or triangles > MOST_TRIANGLES
                read = None if enough else read_mesh(key[0], path, scale_3)
                if read is not None:
                    triangles += len(read[1])
                    known[key] = capsules_of(read[0][np.unique(read[1])], alone=key[2])
            if not known[key] and not key[2]:
                gaps.add(link.name)
            place_44 = np.eye(4) if element.origin is None else np.asarray(element.origin, float)
            found += [_geometry(link.name, capsule, place_44) for capsule in known[key]]
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
