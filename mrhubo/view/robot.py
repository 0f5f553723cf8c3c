"""Robots as solids: the shapes and meshes of a URDF, placed by the poses of its links."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mrhubo.errors import unknown_name
from mrhubo.robot import ROBOT_COLOR, LinkGeometry
from mrhubo.robot.looks import read_looks
from mrhubo.robot.urdf import Description
from mrhubo.view.solids import Color, Solids
from mrhubo.view.surfaces import Placed, Surface

_FINEST = 1 / 450
"""What is smaller, as a share of a robot's height, is not seen where it is drawn among others."""


class RobotShape:
    """What is drawn of a robot, to be placed by the poses of its links."""

    def __init__(self, description: Description) -> None:
        looks = read_looks(description)
        self._shapes, self._sticks = looks.shapes, looks.sticks
        self._surfaces = [(m.link, Surface.of(m.vertices_V3, m.faces_F3, m.color)) for m in looks.meshes]

    def solids(self, link_poses: Mapping[str, np.ndarray]) -> Solids:
        """The robot with its links at ``link_poses``, as for :func:`robot_solids`."""
        meshes = tuple(Placed.of(surface, _pose(link_poses, link)) for link, surface in self._surfaces)
        return replace(robot_solids(self._shapes, link_poses, self._sticks), meshes=meshes)

    def coarser(self, tall_m: float) -> RobotShape:
        """The same without what is not seen of the meshes of a robot that is so tall [m], so that pictures take less
        time.
        """
        found = copy.copy(self)
        finest = _FINEST * max(tall_m, 1e-3)
        found._surfaces = [(link, surface.coarser(finest)) for link, surface in self._surfaces]
        return found


def robot_solids(
    geometry: Sequence[LinkGeometry],
    link_poses: Mapping[str, np.ndarray],
    sticks: Mapping[str, str | None] | None = None,
) -> Solids:
    """The robot with its links at ``link_poses``: name -> pose (4, 4), m, in the world frame, or any frame with z up.

    ``sticks`` (link -> the link from which a stick leads to it): for links without shapes, so that the picture shows
    the robot whole (:func:`mrhubo.robot.bare_sticks`).
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
    return Solids.concatenate([shapes, stick_solids(link_poses, sticks)]) if sticks else shapes


def stick_solids(
    link_poses: Mapping[str, np.ndarray],
    parents: Mapping[str, str | None],
    color: Color = ROBOT_COLOR,
    radius_m: float | None = None,
) -> Solids:
    """Links without primitive shapes: a capsule from the origin of every link to that of its parent.

    ``link_poses``: link -> pose (4, 4), m. ``parents``: link -> parent link; the root is missing or has None.
    ``radius_m``: default that of :func:`stick_radius`.
    """
    if radius_m is None:
        radius_m = stick_radius(link_poses)
    rows = []
    for link, parent in parents.items():
        if parent is None:
            continue
        start, end = _pose(link_poses, parent)[:3, 3], _pose(link_poses, link)[:3, 3]
        rows.append((start, end, radius_m, radius_m))
        rows.append((end, end, 1.35 * radius_m, 1.35 * radius_m))
    return Solids.capsules(rows, color)


def stick_radius(link_poses: Mapping[str, np.ndarray]) -> float:
    """How thick [m] a robot's sticks are: 1.5% of its largest extent."""
    origins_L3 = np.array([np.asarray(pose_44)[:3, 3] for pose_44 in link_poses.values()]).reshape(-1, 3)
    return max(0.015 * float(np.ptp(origins_L3, axis=0).max()) if len(origins_L3) else 0.0, 1e-3)


def _pose(link_poses: Mapping[str, np.ndarray], link: str) -> np.ndarray:
    if link not in link_poses:
        raise ValueError(f"link_poses: {unknown_name('link', link, link_poses)}")
    return np.asarray(link_poses[link], float)
