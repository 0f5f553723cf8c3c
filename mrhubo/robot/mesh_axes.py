"""Whether a robot's COLLADA files whose y is up are to be turned, so that their z is.

A URDF does not say it, and programs differ: RViz and most others take such files as they are, some turn them, and a
file is made for the one or the other. A link's mesh lies around the link's joints, so that tells which.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yourdfpy

from mrhubo.robot.mesh_files import UPRIGHT_33, is_y_up, mesh_of, read_mesh, scale_of
from mrhubo.robot.shapes import place_of

_MOST = 12
"""Meshes that are looked at."""
_LESS = 0.5
"""Turned, joints must be nearer to the meshes than this share of how far they are from them as they are."""
_CLEARLY = 0.1
"""And they must be as they are farther from them than this share of the distance between a link's joints."""


def turns_upright(urdf: yourdfpy.URDF, path: Path) -> bool:
    """Whether meshes of files whose y is up lie around the joints of their links if they are turned, and not as they
    are.

    Args:
        urdf: what yourdfpy has made of the robot.
        path: its file.
    """
    joints: dict[str, list[np.ndarray]] = {}
    for joint in urdf.robot.joints:
        joints.setdefault(joint.parent, []).append(np.zeros(3) if joint.origin is None else joint.origin[:3, 3])
    off_K2, lengths = [], []
    for link in urdf.robot.links:
        for element in (link.visuals or link.collisions)[:1]:
            mesh = mesh_of(element)
            if mesh is None or len(off_K2) >= _MOST or not is_y_up(str(mesh.filename), path):
                continue
            points_J3 = np.array([np.zeros(3), *joints.get(link.name, [])])
            place_44 = place_of(element)
            if (read := read_mesh(str(mesh.filename), path, np.ones(3))) is None:
                continue
            both = [scale_of(mesh) * vertices_V3 for vertices_V3 in (read[0], read[0] @ UPRIGHT_33.T)]
            off_K2.append([_off(each_V3 @ place_44[:3, :3].T + place_44[:3, 3], points_J3) for each_V3 in both])
            lengths += np.linalg.norm(points_J3[1:], axis=1).tolist()
    if not off_K2:
        return False
    as_they_are, turned = np.mean(off_K2, axis=0)
    return bool(turned < _LESS * as_they_are and as_they_are > _CLEARLY * float(np.mean(lengths or [np.inf])))


def _off(vertices_V3: np.ndarray, points_J3: np.ndarray) -> float:
    """How far points (J, 3) are from the box around vertices (V, 3), in the mean [m]."""
    low_3, high_3 = vertices_V3.min(axis=0), vertices_V3.max(axis=0)
    return float(np.linalg.norm(np.maximum(0.0, np.maximum(low_3 - points_J3, points_J3 - high_3)), axis=1).mean())
