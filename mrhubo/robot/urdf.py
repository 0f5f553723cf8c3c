"""Reads a URDF with yourdfpy into the few facts that kinematics needs, and refuses what cannot work.

Meshes are never loaded. Lengths in metres, angles in radians.
"""

from __future__ import annotations

import io
import logging
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yourdfpy
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)

from mrhubo.config import fingerprint
from mrhubo.errors import UserError, unknown_name

# It warns at every pose about mimic joints whose source is fixed (NAO's fingers), which is no news to our users.
logging.getLogger("yourdfpy.urdf").setLevel(logging.ERROR)

_MAX_BYTES = 50_000_000
_ROTARY = ("revolute", "continuous")


@dataclass(frozen=True)
class Mimic:
    """This joint's angle = multiplier * (angle of `joint`) + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class Joint:
    """One joint: from link `parent` to link `child`, placed by `origin_44`, turning about `axis_3` (unit, child
    frame).
    """

    name: str
    kind: str
    parent: str
    child: str
    origin_44: np.ndarray
    axis_3: np.ndarray
    lower: float | None
    upper: float | None
    mimic: Mimic | None

    @property
    def rotary(self) -> bool:
        """Revolute or continuous."""
        return self.kind in _ROTARY


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
    """What yourdfpy has made of the file: its shapes, and poses of all links (`link_poses`)."""

    @property
    def kinematics(self) -> str:
        """Fingerprint of joints, limits and axes; looks and masses are not in it."""
        joints = []
        for j in self.joints.values():
            mimic = None if j.mimic is None else [j.mimic.joint, j.mimic.multiplier, j.mimic.offset]
            place = [j.origin_44.tolist(), j.axis_3.tolist()]
            joints.append([j.name, j.kind, j.parent, j.child, place, repr(j.lower), repr(j.upper), mimic])
        return fingerprint([self.root, joints])

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


def load_urdf(path: Path) -> yourdfpy.URDF:
    """The parsed URDF with its scene graph (for poses of all links), without meshes.

    Raises:
        UserError: the file is missing, too large, or no URDF.
    """
    if not path.is_file():
        raise UserError(f"robot.urdf: {path} does not exist; name a URDF file, relative to the YAML")
    if path.stat().st_size > _MAX_BYTES:
        raise UserError(
            f"robot.urdf: {path} has {path.stat().st_size:,} bytes; the most that is read is {_MAX_BYTES:,}"
        )
    try:
        parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True)
        tree = etree.parse(str(path), parser)
        if tree.getroot().tag != "robot":
            raise UserError(f"robot.urdf: {path} is no URDF: its root element is <{tree.getroot().tag}>, not <robot>")
        _check_structure(path, tree.getroot())
        clean = _kinematic_part(tree.getroot())
        return yourdfpy.URDF.load(
            io.BytesIO(etree.tostring(clean)),
            build_scene_graph=True,
            build_collision_scene_graph=False,
            load_meshes=False,
            load_collision_meshes=False,
        )
    except (etree.XMLSyntaxError, OSError) as error:
        raise UserError(f"robot.urdf: {path} is no well-formed XML: {error}") from error
    except UserError:
        raise
    except Exception as error:
        raise UserError(f"robot.urdf: {path} cannot be read as a URDF: {type(error).__name__}: {error}") from error


def link_poses(urdf: yourdfpy.URDF, configuration: dict[str, float]) -> dict[str, np.ndarray]:
    """Pose (4, 4) of every link in the root's frame, at angles [rad] by joint (`Robot.configuration`)."""
    urdf.update_cfg({name: configuration[name] for name in urdf.actuated_joint_names if name in configuration})
    return {link.name: urdf.get_transform(link.name, urdf.base_link) for link in urdf.robot.links}


def _kinematic_part(robot: etree._Element) -> etree._Element:
    """Links, joints and colours alone: simulators' and sensors' tags, and textures, only trip the parser."""
    for element in list(robot):
        if element.tag not in ("link", "joint", "material"):
            robot.remove(element)
    for texture in list(robot.iter("texture")):
        texture.getparent().remove(texture)
    return robot


def _check_structure(path: Path, robot: etree._Element) -> None:
    links = [e.get("name") for e in robot.findall("link")]
    joints = [e for e in robot.findall("joint") if e.get("type")]
    children: dict[str | None, str | None] = {}
    below: dict[str | None, list[str | None]] = {}
    for kind, names in (("link", links), ("joint", [e.get("name") for e in joints])):
        if None in names:
            raise UserError(f"robot.urdf: {path}: a {kind} has no name")
        repeated = {n for n in names if names.count(n) > 1}
        if repeated:
            raise UserError(f"robot.urdf: {path}: {kind} '{sorted(map(str, repeated))[0]}' appears twice")
    for joint in joints:
        for end in ("parent", "child"):
            element = joint.find(end)
            link = element.get("link") if element is not None else None
            if link not in links:
                raise UserError(
                    f"robot.urdf: {path}: joint '{joint.get('name')}' has the {end} link '{link}', which does not exist"
                )
            if end == "child" and link in children:
                raise UserError(
                    f"robot.urdf: {path}: link '{link}' hangs on two joints, '{children[link]}' and "
                    f"'{joint.get('name')}'"
                )
            if end == "child":
                children[link] = joint.get("name")
                below.setdefault(joint.find("parent").get("link"), []).append(link)
    roots = [n for n in links if n not in children]
    if len(roots) != 1:
        shown = ", ".join(f"'{r}'" for r in roots[:5]) or "none (the joints form a loop)"
        raise UserError(f"robot.urdf: {path}: a robot has one root link, this file has {len(roots)}: {shown}")
    reached = list(roots)
    for link in reached:
        reached += below.get(link, [])
    lost = [link for link in links if link not in reached]
    if lost:
        raise UserError(f"robot.urdf: {path}: link '{lost[0]}' hangs in a loop of joints, not on the root '{roots[0]}'")


def describe(path: Path) -> Description:
    """Joints, links and the root of a URDF file.

    Raises:
        UserError: the file is missing or no URDF; it has several roots, a loop, or a floating or planar joint anywhere
            but directly under the root (where it only places the robot in the world, and is taken as fixed).
    """
    parsed = load_urdf(path)
    robot = parsed.robot
    children = {joint.child for joint in robot.joints}
    root = next(link.name for link in robot.links if link.name not in children)
    joints = {}
    for joint in robot.joints:
        kind = joint.type
        if kind in ("floating", "planar"):
            if joint.parent != root:
                raise UserError(
                    f"{path}: joint '{joint.name}' is {kind}; only rotary, prismatic and fixed joints can be "
                    "handled below the root"
                )
            kind = "fixed"
        elif kind not in (*_ROTARY, "prismatic", "fixed"):
            raise UserError(f"{path}: joint '{joint.name}' has the unknown type '{kind}'")
        axis = np.array([1.0, 0.0, 0.0]) if joint.axis is None else np.asarray(joint.axis, dtype=float)
        origin = np.eye(4) if joint.origin is None else np.asarray(joint.origin, dtype=float)
        length = np.linalg.norm(axis)
        if not (np.isfinite(origin).all() and np.isfinite(axis).all()) or (kind != "fixed" and length < 1e-9):
            raise UserError(f"{path}: joint '{joint.name}' has an origin or axis that is zero, NaN or infinite")
        limit = joint.limit if kind != "continuous" else None
        mimic = joint.mimic
        joints[joint.name] = Joint(
            joint.name,
            kind,
            joint.parent,
            joint.child,
            origin,
            axis / max(length, 1e-9),
            None if limit is None or limit.lower is None else float(limit.lower),
            None if limit is None or limit.upper is None else float(limit.upper),
            None
            if mimic is None
            else Mimic(
                mimic.joint,
                1.0 if mimic.multiplier is None else float(mimic.multiplier),
                0.0 if mimic.offset is None else float(mimic.offset),
            ),
        )
    above = {joint.child: joint for joint in joints.values()}
    return Description(path, root, tuple(link.name for link in robot.links), joints, above, parsed)


def joint_range(path: Path, joint: Joint, narrower: list[float] | None) -> tuple[float, float]:
    """Lower and upper limit [rad] of a joint that is to be sampled.

    Raises:
        UserError: the joint is not rotary, has no limits and no range is given, or its range is empty or outside them.
    """
    if not joint.rotary:
        raise UserError(f"{path}: joint '{joint.name}' is {joint.kind}; only rotary joints can be sampled")
    if joint.mimic is not None:
        raise UserError(
            f"{path}: joint '{joint.name}' mimics '{joint.mimic.joint}'; name '{joint.mimic.joint}' instead"
        )
    if narrower is not None:
        if len(narrower) != 2 or not all(map(math.isfinite, narrower)) or not narrower[0] < narrower[1]:
            raise UserError(
                f"robot.ranges.{joint.name}: expected [lower, upper] in rad with lower < upper, found {list(narrower)}"
            )
    if joint.lower is None or joint.upper is None:
        if narrower is None:
            raise UserError(f"{path}: joint '{joint.name}' has no limits; give it a range in robot.ranges")
        return narrower[0], narrower[1]
    if not (math.isfinite(joint.lower) and math.isfinite(joint.upper) and joint.lower < joint.upper):
        raise UserError(f"{path}: joint '{joint.name}' has the impossible limits {joint.lower} .. {joint.upper}")
    if narrower is None:
        return joint.lower, joint.upper
    if narrower[0] < joint.lower - 1e-9 or narrower[1] > joint.upper + 1e-9:
        raise UserError(
            f"robot.ranges.{joint.name}: {list(narrower)} leaves the URDF's limits {joint.lower} .. {joint.upper}"
        )
    return narrower[0], narrower[1]
