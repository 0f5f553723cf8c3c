"""A URDF as the few facts that kinematics needs, read by yourdfpy from what `mrhubo.robot.tree` leaves of the file.

yourdfpy loads no meshes. Lengths in metres, angles in radians.
"""

from __future__ import annotations

import io
import logging
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import yourdfpy
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)

from mrhubo.config import fingerprint
from mrhubo.errors import UserError, unknown_name
from mrhubo.robot.document import read_text
from mrhubo.robot.joint import ROTARY, Joint, Mimic
from mrhubo.robot.limits import with_soft_limits, without_empty_limits
from mrhubo.robot.mesh_axes import turns_upright
from mrhubo.robot.solid_shapes import SolidShapes, read_solids
from mrhubo.robot.tree import Tree, read_tree

# It warns at every pose about mimic joints whose source is fixed (NAO's fingers), which is no news to our users.
logging.getLogger("yourdfpy.urdf").setLevel(logging.ERROR)

_KEPT = 8
"""Files whose description is kept, so that it is not made, and the robot not looked through, once more."""
Found = TypeVar("Found")


@dataclass(frozen=True)
class Description:
    """A robot as its URDF tells it: joints by name, links by name, one root."""

    path: Path
    root: str
    links: tuple[str, ...]
    joints: dict[str, Joint]
    parent_joint: dict[str, Joint]
    """The joint above each link but the root."""
    parsed: yourdfpy.URDF = field(repr=False, compare=False)
    """What yourdfpy has made of what can be read: its shapes, and poses of its links (`link_poses`)."""
    faults: Mapping[str, str] = field(default_factory=dict, repr=False, compare=False)
    """By joint, why it cannot be used: line and sentence. It is no matter as long as nothing wanted hangs on it."""
    doubts: Mapping[str, str] = field(default_factory=dict, repr=False, compare=False)
    """By joint, what is odd about it: line and sentence."""
    left_out: tuple[str, ...] = field(default=(), repr=False, compare=False)
    """What else cannot be read and is not needed."""
    unread_collisions: frozenset[str] = field(default=frozenset(), repr=False, compare=False)
    """Links with a collision element that cannot be read."""
    masses: Mapping[str, tuple[float, float, float, float]] = field(default_factory=dict, repr=False, compare=False)
    """By link: mass [kg] and its centre [m] in the link's frame, of those that have a mass."""
    text: bytes = field(default=b"", repr=False, compare=False)
    """What was read, unpacked: the file may be another one by the time that a package takes it along."""
    _read: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)
    """What has been read when it was first asked for; the same robot in another form knows it too."""
    _found: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)
    """What `once` has found."""

    def __deepcopy__(self, memo: object) -> Description:
        """Itself: nothing in it changes."""
        return self

    @property
    def solids(self) -> SolidShapes:
        """The shapes that can bump into each other; meshes are read when first asked for."""
        if "solids" not in self._read:
            self._read["solids"] = read_solids(self.parsed, self.path, self.upright)
        return self._read["solids"]

    @property
    def upright(self) -> bool:
        """Whether meshes of files whose y is up are turned, so that their z is; told when first asked for."""
        if "upright" not in self._read:
            self._read["upright"] = turns_upright(self.parsed, self.path)
        return self._read["upright"]

    @cached_property
    def kinematics(self) -> str:
        """Fingerprint of joints, limits of their angles, and axes; looks, masses and speeds are not in it."""
        joints = []
        for j in self.joints.values():
            mimic = None if j.mimic is None else [j.mimic.joint, j.mimic.multiplier, j.mimic.offset]
            place = [j.origin_44.tolist(), j.axis_3.tolist()]
            joints.append([j.name, j.kind, j.parent, j.child, place, repr(j.lower), repr(j.upper), mimic])
        return fingerprint([self.root, joints])

    @cached_property
    def joints_below(self) -> dict[str, list[Joint]]:
        """By link, the joints that hang on it, in the file's order; links without any are not in it."""
        found: dict[str, list[Joint]] = {}
        for joint in self.joints.values():
            found.setdefault(joint.parent, []).append(joint)
        return found

    def once(self, name: str, find: Callable[[], Found]) -> Found:
        """What `find` makes of this description, and of nothing else, no file either. It is asked once, also where the
        same text is read again; nobody may change what it gives.
        """
        if name not in self._found:
            self._found[name] = find()
        return self._found[name]

    def with_joints(self, changed: Mapping[str, Joint]) -> Description:
        """The same robot with some joints in another form."""
        joints = {**self.joints, **changed}
        return replace(self, joints=joints, parent_joint={joint.child: joint for joint in joints.values()}, _found={})

    def joint(self, name: str) -> Joint:
        """UserError with the nearest name if there is no such joint."""
        if name not in self.joints:
            raise UserError(f"{self.path}: {unknown_name('joint', name, self.joints)}")
        return self.joints[name]

    def check_link(self, name: str) -> str:
        """The name itself; UserError with the nearest name if there is no such link."""
        if name not in self.links:
            raise UserError(f"{self.path}: {unknown_name('link', name, self.links)}")
        return name

    def joints_above(self, link: str) -> list[Joint]:
        """Joints from the link up to the root, nearest first."""
        chain = []
        while link in self.parent_joint:
            chain.append(self.parent_joint[link])
            link = chain[-1].parent
        return chain


def _parsed(tree: Tree) -> yourdfpy.URDF:
    """What yourdfpy makes of a tree, without its graph of all links, which takes long where they are many."""
    try:
        return yourdfpy.URDF.load(
            io.BytesIO(etree.tostring(tree.robot)),
            build_scene_graph=False,
            build_collision_scene_graph=False,
            load_meshes=False,
            load_collision_meshes=False,
        )
    except Exception as error:
        raise UserError(f"robot.urdf: {tree.path} cannot be read as a URDF: {type(error).__name__}: {error}") from error


def link_poses(urdf: yourdfpy.URDF, configuration: Mapping[str, float]) -> dict[str, np.ndarray]:
    """Pose (4, 4) of every link in the root's frame, at angles [rad] by joint (`Robot.configuration`).

    Joints without an angle are at 0. One that mimics another follows it where that is one of those that can be moved;
    else it is at its offset, as if the other were at 0.
    """
    joints = urdf.robot.joints
    free = {joint.name for joint in joints if joint.mimic is None and joint.type != "fixed"}
    below: dict[str, list[yourdfpy.urdf.Joint]] = {}
    for joint in joints:
        below.setdefault(joint.parent, []).append(joint)
    children = {joint.child for joint in joints}
    root = next(link.name for link in urdf.robot.links if link.name not in children)
    poses, order = {root: np.eye(4)}, [root]
    for link in order:
        for joint in below.get(link, []):
            angle = configuration.get(joint.name, 0.0)
            if (mimic := _mimic(joint)) is not None:
                source = configuration.get(mimic.joint, 0.0) if mimic.joint in free else 0.0
                angle = source * mimic.multiplier + mimic.offset
            poses[joint.child] = poses[link] @ _placed(joint, angle)
            order.append(joint.child)
    return {link.name: poses[link.name] for link in urdf.robot.links}


def _placed(joint: yourdfpy.urdf.Joint, angle: float) -> np.ndarray:
    """Pose (4, 4) of a joint's child in its parent's frame."""
    origin_44 = np.eye(4) if joint.origin is None else joint.origin
    if joint.type not in (*ROTARY, "prismatic"):
        return origin_44
    return origin_44 @ moved(np.asarray(joint.axis, dtype=float), angle, joint.type == "prismatic")


def moved(axis_3: np.ndarray, angle: float, slides: bool) -> np.ndarray:
    """The motion (4, 4) of a joint about its axis (which need not be unit), or along it [m]; O. Rodrigues, 1840."""
    if slides:
        motion_44 = np.eye(4)
        motion_44[:3, 3] = angle * axis_3
        return motion_44
    # Plain numbers: arrays of three of them take NumPy ten times as long.
    x, y, z = (axis_3 / np.sqrt(np.dot(axis_3, axis_3))).tolist()
    sine, cosine = math.sin(angle), math.cos(angle)
    rest = 1.0 - cosine
    return np.array(
        [
            [cosine + x * x * rest, x * y * rest - z * sine, x * z * rest + y * sine, 0.0],
            [x * y * rest + z * sine, cosine + y * y * rest, y * z * rest - x * sine, 0.0],
            [x * z * rest - y * sine, y * z * rest + x * sine, cosine + z * z * rest, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def describe(path: Path) -> Description:
    """Joints, links and the root of a URDF file.

    Raises:
        UserError: the file is missing or no URDF; it has several roots, a loop, a joint of an unknown type, or a
            floating or planar joint anywhere but directly under the root (where it only places the robot in the world,
            and is taken as fixed).
    """
    return describe_text(path, read_text(path))


def describe_text(path: Path, text: bytes) -> Description:
    """As `describe`, of a text that is in no file.

    Args:
        path: what sentences about it name.
        text: a URDF.
    """
    # Meshes may have changed since the same text was read before.
    return replace(_described(path, text), _read={})


@lru_cache(maxsize=_KEPT)
def _described(path: Path, text: bytes) -> Description:
    tree = read_tree(path, text)
    parsed = _parsed(tree)
    read = {joint.name: joint for joint in parsed.robot.joints}
    joints = without_empty_limits({name: _joint(element, read.get(name)) for name, element in tree.joints.items()})
    above = {joint.child: joint for joint in joints.values()}
    return Description(
        path, tree.root, tree.links, joints, above, parsed,
        tree.faults, tree.doubts, tree.left_out, tree.unread_collisions, tree.masses, text,
    )  # fmt: skip


def _joint(element: etree._Element, read: yourdfpy.urdf.Joint | None) -> Joint:
    """A joint of the file, and what yourdfpy has read of it: nothing, if it has no place."""
    name, kind = str(element.get("name")), str(element.get("type"))
    kind = "fixed" if kind in ("floating", "planar") else kind
    parent, child = (str(element.find(end).get("link")) for end in ("parent", "child"))
    if read is None:
        return Joint(name, kind, parent, child, np.eye(4), np.array([1.0, 0.0, 0.0]), None, None, None)
    axis_3 = np.asarray(read.axis, dtype=float)
    origin_44 = np.eye(4) if read.origin is None else np.asarray(read.origin, dtype=float)
    limit = read.limit if kind != "continuous" else None
    lower, upper = (None, None) if limit is None else (limit.lower, limit.upper)
    if lower is not None and upper is not None and lower > upper:
        lower, upper = upper, lower  # `mrhubo.robot.tree` tells it
    axis_3 = axis_3 / max(np.linalg.norm(axis_3), 1e-9)
    velocity = None if read.limit is None else read.limit.velocity
    joint = Joint(name, kind, parent, child, origin_44, axis_3, lower, upper, _mimic(read), velocity=velocity)
    return with_soft_limits(joint, element.find("safety_controller"))


def _mimic(joint: yourdfpy.urdf.Joint) -> Mimic | None:
    mimic = joint.mimic
    if mimic is None:
        return None
    multiplier = 1.0 if mimic.multiplier is None else float(mimic.multiplier)
    return Mimic(mimic.joint, multiplier, 0.0 if mimic.offset is None else float(mimic.offset))
