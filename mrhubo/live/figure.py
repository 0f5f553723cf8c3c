"""The robot as the page draws it: rigid bodies that hang on each other, each of capsules, as JSON.

The page places the bodies by the joint angles of every message (`page/robot.js`). Boxes become the capsules along them,
and so do meshes that stand for no collision; nothing that is drawn here is used for motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from mrhubo.robot import Robot
    from mrhubo.view import Solids
    from mrhubo.viewer.bodies import Body

_MOST = 400
"""Capsules of a robot; of more the largest are kept."""


def figure_of(robot: Robot, joint_names: Sequence[str]) -> dict[str, Any]:
    """What `robot.json` tells: `bodies`, each after the one on which it hangs, with

    - `parent`: a number, or null; `origin` (4, 4): its place [m] in the parent's frame, its joint at 0, row by row;
    - `axis` (3,), `slides`, `column`, `multiplier`, `offset`: its joint, driven by `angles[column]` of a message;
    - `capsules`: rows of start (3,) and end (3,) [m] in its own frame, radii of both [m], and red, green, blue 0..255.

    Args:
        robot: whose URDF tells.
        joint_names: those of the messages, in their order.
    """
    from mrhubo.robot.looks import read_looks
    from mrhubo.view import Solids, robot_solids
    from mrhubo.view.surfaces import Placed, Surface, rods
    from mrhubo.viewer.bodies import body_sticks, read_bodies

    looks, of_meshes = read_looks(robot.description), robot.description.solids.of_meshes
    seen, hugged = {shape.link for shape in looks.shapes}, {shape.link for shape in of_meshes}
    geometry = [*looks.shapes, *(shape for shape in of_meshes if shape.link not in seen)]
    meshes = [mesh for mesh in looks.meshes if mesh.link not in hugged]
    bodies = read_bodies(robot, joint_names)

    def of(body: Body, own: Solids) -> Solids:
        placed = [
            Placed.of(Surface.of(mesh.vertices_V3, mesh.faces_F3, mesh.color), body.links[mesh.link])
            for mesh in meshes
            if mesh.link in body.links
        ]
        rows = [(start_3, end_3, radius, radius) for start_3, end_3, radius in zip(*rods(placed), strict=True)]
        about = Solids.capsules(rows, [mesh.color for mesh in placed])
        return Solids.concatenate([robot_solids([s for s in geometry if s.link in body.links], body.links), about, own])

    solids = [of(body, own) for body, own in zip(bodies, body_sticks(bodies, looks.sticks), strict=True)]
    rows = [
        np.column_stack([s.starts_S3, s.ends_S3, s.radii_S, s.end_radii_S, (255 * s.colors_S3).round()]) for s in solids
    ]
    sizes = np.sort(np.concatenate([_size(row_S11) for row_S11 in rows]))[::-1]
    least = sizes[_MOST] if len(sizes) > _MOST else -1.0
    return {
        "bodies": [
            {
                "parent": body.parent, "origin": _rounded(body.origin_44), "axis": _rounded(body.axis_3),
                "slides": body.slides, "column": body.column, "multiplier": body.multiplier, "offset": body.offset,
                "capsules": _rounded(row_S11[_size(row_S11) > least]),
            }
            for body, row_S11 in zip(bodies, rows, strict=True)
        ]
    }  # fmt: skip


def _size(row_S11: np.ndarray) -> np.ndarray:
    return np.linalg.norm(row_S11[:, 3:6] - row_S11[:, :3], axis=1) + 2 * row_S11[:, 6:8].max(axis=1, initial=0.0)


def _rounded(values: np.ndarray) -> Any:
    return np.asarray(values, float).round(6).tolist()
