"""Where a robot's feet touch the floor: the lowest parts of what is fixed to a foot's link.

Parts are balls (`mrhubo.robot.balls`). What lies more than a little above the lowest of them, with the foot upright,
never touches a flat floor before they do.

Legend: K balls, F of them where the foot stands flat.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mrhubo.robot.balls import balls_of, placed, points
from mrhubo.robot.entries import End
from mrhubo.robot.hulls import extremes
from mrhubo.robot.joint import stuck
from mrhubo.robot.meshes import read_meshes
from mrhubo.robot.parts import OrientedPart
from mrhubo.robot.shapes import read_collision_geometry, read_geometry, without_markers
from mrhubo.robot.standing import StandingRobot

if TYPE_CHECKING:
    from mrhubo.robot.body_map import BodyMap
    from mrhubo.robot.keypoints import Keypoints
    from mrhubo.robot.urdf import Description

_SIDES = 0.5
"""Balls lower than this share of the way from the foot's origin to its lowest part can touch the floor, where the foot
is tilted."""
_FLAT_M = 0.01
"""Balls up to this far above the lowest are where it stands: soles have a profile."""


@dataclass(frozen=True)
class Sole:
    """The sole of one foot, in the frame of its link; m."""

    part: OrientedPart
    link: str
    balls_K4: np.ndarray
    """Centres and radii (K, 4) of what can touch the floor."""
    rear_3: np.ndarray
    """The middle of the sole's rear edge."""
    front_3: np.ndarray
    """The middle of its front edge."""
    known: bool
    """Whether a shape or an entry tells; else the origins of the foot's links do."""


def find_soles(body_map: BodyMap) -> tuple[Sole, ...]:
    """The soles of the parts that stand on the floor, in the table's order."""
    return soles_of(body_map.keypoints, body_map.robot.description)


def soles_of(keypoints: Keypoints, description: Description) -> tuple[Sole, ...]:
    """As `find_soles`, of a robot's keypoints and its description."""
    return tuple(_sole(part, keypoints.ends[part.name], description) for part in keypoints.standing)


def _sole(part: OrientedPart, end: End, description: Description) -> Sole:
    forward_3, up_3 = end.axes_23.numpy().astype(float)
    if end.sole is not None:
        back, ahead, below = end.sole
        places_23 = np.stack((-back * forward_3, ahead * forward_3)) - below * up_3
        balls_K4, known = np.concatenate((places_23, np.zeros((2, 1))), axis=1), True
    else:
        balls_K4, known = sole_balls(end.link, description)
    height_K = balls_K4[:, :3] @ up_3 - balls_K4[:, 3]
    low = float(height_K.min())
    flat_K = height_K <= low + _FLAT_M
    along_F, left_3 = balls_K4[flat_K, :3] @ forward_3, np.cross(up_3, forward_3)
    side = float(np.mean(balls_K4[flat_K, :3] @ left_3))
    rear_3, front_3 = (x * forward_3 + side * left_3 + low * up_3 for x in (along_F.min(), along_F.max()))
    return Sole(part, end.link, balls_K4[flat_K | (height_K <= _SIDES * low)], rear_3, front_3, known)


def sole_balls(link: str, description: Description) -> tuple[np.ndarray, bool]:
    """Balls (K, 4) of all that is fixed to a link, in its frame: of collision shapes, or of looks where there are none,
    or the links' origins; and whether shapes told. What only looks beside meshes marks a place, as a ball at a foot's
    frame does.
    """
    links, parsed = _fixed_to(link, description), description.parsed
    poses = StandingRobot(description, {}).poses
    from_44 = {name: np.linalg.inv(poses[link]) @ poses[name] for name in links}
    size = float(np.linalg.norm(np.ptp([pose_44[:3, 3] for pose_44 in poses.values()], axis=0)))
    shaped = [shape for each in parsed.robot.links if each.name in links for shape in (*each.visuals, *each.collisions)]
    meshed = any(shape.geometry is not None and shape.geometry.mesh is not None for shape in shaped)
    for read in (read_collision_geometry, *(() if meshed else (read_geometry,))):
        shapes = without_markers(read(parsed), size)
        found = [placed(balls_of(s), from_44[s.link] @ s.origin_44) for s in shapes if s.link in links]
        if found:
            return np.concatenate(found), True
    others = {each.name for each in parsed.robot.links} - links
    meshes = read_meshes(description, others)
    found = [placed(points(extremes(mesh.vertices_V3)), from_44[mesh.link]) for mesh in meshes]
    if found:
        return np.concatenate(found), True
    return points(np.stack([from_44[name][:3, 3] for name in sorted(links)])), False


def _fixed_to(link: str, description: Description) -> set[str]:
    """A link and all below it that never move against it."""
    found, joints = {link}, [joint for joint in description.joints.values() if joint.kind == "fixed" or stuck(joint)]
    while more := {joint.child for joint in joints if joint.parent in found} - found:
        found |= more
    return found
