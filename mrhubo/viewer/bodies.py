"""A robot as rigid bodies: all links between two joints that move are one, so that a viewer has few parts to move.

Legend: T frames, N moved joints, B bodies.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mrhubo.errors import UserError
from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.robot import Robot
from mrhubo.robot.joint import Mimic, drive
from mrhubo.robot.looks import read_looks
from mrhubo.robot.urdf import Description, moved
from mrhubo.view import Solids, stick_radius, stick_solids
from mrhubo.viewer.meshing import Mesh, capsule_meshes, joined, shape_mesh


@dataclass
class Body:
    """Links that keep their places to each other. The root's body comes first, each other after the one below it."""

    name: str
    """Of its first link."""
    parent: int | None
    """The body that it hangs on, a number; None for the root's."""
    origin_44: np.ndarray
    """Its place in the frame of `parent` where its joint is at 0."""
    axis_3: np.ndarray
    """Of its joint, unit, in its own frame."""
    slides: bool = False
    """Whether the joint is prismatic."""
    column: int = 0
    """Which of the moved joints drives it, by `multiplier` and `offset`."""
    multiplier: float = 0.0
    offset: float = 0.0
    links: dict[str, np.ndarray] = field(default_factory=dict)
    """Places (4, 4) of links in its frame."""
    meshes: list[Mesh] = field(default_factory=list)
    """What it looks like, in its frame, a mesh a colour."""

    def local_poses(self, q_TN: np.ndarray) -> np.ndarray:
        """Poses (T, 4, 4) in the frame of its parent, at angles [rad] of the moved joints."""
        value_T = self.multiplier * q_TN[:, self.column].astype(float) + self.offset
        motion_T44 = np.tile(np.eye(4), (len(value_T), 1, 1))
        if self.slides:
            motion_T44[:, :3, 3] = value_T[:, None] * self.axis_3
        else:
            motion_T44[:, :3, :3] = axis_angle_to_matrix(value_T[:, None] * self.axis_3)
        return self.origin_44 @ motion_T44


def read_bodies(robot: Robot, joints: Sequence[str]) -> list[Body]:
    """The bodies of a robot in which some joints move, and all others are held where the robot holds them.

    Args:
        robot: the robot.
        joints: those that move; each is a joint of its URDF, and mimics none.

    Raises:
        UserError: a joint does not exist, or does not move; its angles would be of no use.
    """
    description = robot.description
    for name in joints:
        joint = description.joint(name)
        why = "is fixed" if joint.kind == "fixed" else None if joint.mimic is None else f"mimics '{joint.mimic.joint}'"
        if why is not None:
            raise UserError(f"joint '{name}' {why} in {description.path}, so nothing else can move it")
    bodies = [Body(description.root, None, np.eye(4), np.array([1.0, 0.0, 0.0]), links={description.root: np.eye(4)})]
    order = [(description.root, 0)]
    for link, body in order:
        place_44 = bodies[body].links[link]
        for joint in description.joints_below.get(link, []):
            driver = _driver(description, joint.name)
            if joint.kind != "fixed" and driver.joint in joints:
                bodies.append(
                    Body(
                        joint.child,
                        body,
                        place_44 @ joint.origin_44,
                        joint.axis_3,
                        not joint.rotary,
                        joints.index(driver.joint),
                        driver.multiplier,
                        driver.offset,
                        {joint.child: np.eye(4)},
                    )  # fmt: skip
                )
                order.append((joint.child, len(bodies) - 1))
                continue
            value = robot.held.get(driver.joint, 0.0) * driver.multiplier + driver.offset
            still_44 = np.eye(4) if joint.kind == "fixed" else moved(joint.axis_3, value, not joint.rotary)
            bodies[body].links[joint.child] = place_44 @ joint.origin_44 @ still_44
            order.append((joint.child, body))
    return bodies


def _driver(description: Description, joint: str) -> Mimic:
    try:
        return drive(description.joints, joint)
    except UserError:  # it mimics what is not there: it is held at 0, as no angle of it is known
        return Mimic(joint, 1.0, 0.0)


def dress(bodies: Sequence[Body], robot: Robot) -> None:
    """Gives bodies their looks (:func:`mrhubo.robot.looks.read_looks`)."""
    looks = read_looks(robot.description)
    found: dict[str, list[Mesh]] = {}
    for mesh in looks.meshes:
        found.setdefault(mesh.link, []).append(Mesh(mesh.vertices_V3, mesh.faces_F3, mesh.color))
    for shape in looks.shapes:
        found.setdefault(shape.link, []).append(shape_mesh(shape))
    for body, solids in zip(bodies, body_sticks(bodies, looks.sticks), strict=True):
        parts = [mesh.placed(pose_44) for link, pose_44 in body.links.items() for mesh in found.get(link, [])]
        body.meshes = joined(parts) + capsule_meshes(solids)


def body_sticks(bodies: Sequence[Body], sticks: Mapping[str, str]) -> list[Solids]:
    """Of each body, in its own frame, the sticks that start at its links, as thick as in pictures.

    Args:
        bodies: of one robot.
        sticks: `{end: start}`, links by name (:func:`mrhubo.robot.bare_sticks`).
    """
    poses: list[np.ndarray] = []
    for body in bodies:
        poses.append(body.origin_44 if body.parent is None else poses[body.parent] @ body.origin_44)
    places = {
        link: pose_44 @ own_44
        for body, pose_44 in zip(bodies, poses, strict=True)
        for link, own_44 in body.links.items()
    }
    radius_m = stick_radius(places)
    return [
        stick_solids(places, {end: start for end, start in sticks.items() if start in body.links}, radius_m=radius_m)
        .transformed(np.linalg.inv(pose_44))
        for body, pose_44 in zip(bodies, poses, strict=True)
    ]  # fmt: skip


def link_places(bodies: Sequence[Body], q_TN: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Names of all links, and their poses (T, L, 4, 4) in the frame of the root link."""
    poses: list[np.ndarray] = []
    for body in bodies:
        local_T44 = body.local_poses(q_TN)
        poses.append(local_T44 if body.parent is None else poses[body.parent] @ local_T44)
    names = [link for body in bodies for link in body.links]
    placed = [
        pose_T44 @ place_44 for body, pose_T44 in zip(bodies, poses, strict=True) for place_44 in body.links.values()
    ]
    return names, np.stack(placed, axis=1)
