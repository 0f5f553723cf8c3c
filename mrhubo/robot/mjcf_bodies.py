"""A compiled MuJoCo model -> the text of a URDF, body by body (`mrhubo.robot.mjcf`)."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)
from scipy.spatial.transform import Rotation

from mrhubo.errors import UserError, listed

_FREE, _BALL, _SLIDE, _HINGE = range(4)
"""mjtJoint."""
_SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX = range(2, 7)
"""mjtGeom; a plane, a field of heights, and what only pictures use have other numbers."""
_JOINT_EQUALITY = 2
"""mjtEq: one joint's position as a polynomial of another's."""
_BESIDE = 0.5
"""Share of the robot's joints that a body beside it carries at least that belongs to it."""


@dataclass(frozen=True)
class Converted:
    """A robot that was a MuJoCo model."""

    name: str
    """The model's name, or its file's."""
    urdf: str
    """The text of the URDF."""
    notes: tuple[str, ...]
    """What was left out or changed, a sentence each."""


@dataclass
class _Frame:
    """A link, and where the body that it belongs to is in its frame."""

    link: str
    body_44: np.ndarray = field(default_factory=lambda: np.eye(4))


class UrdfWriter:
    """A compiled model -> URDF. Body by body, from the root outwards; a body with several joints becomes as many links,
    each at its joint's anchor, since a URDF's link hangs on one joint, about its own origin. `ranges` are limits of
    joints to which the model gives none.
    """

    def __init__(
        self, path: Path, model: Any, meshes: dict[str, tuple[str, str]], weighed: Collection[int],
        ranges: Mapping[str, tuple[float, float]], notes: Collection[str] = (),
    ) -> None:  # fmt: skip
        self.path, self.model, self.meshes, self.weighed, self.ranges = path, model, meshes, weighed, ranges
        name = model.names[: model.names.index(b"\0")].decode(errors="replace")
        self.robot = etree.Element("robot", name=path.stem if name in ("", "MuJoCo Model") else name)
        self.notes: list[str] = list(notes)
        self.links: dict[str, etree._Element] = {}
        self.joints: dict[str, etree._Element] = {}
        self.names: dict[int, str] = {}
        """Of the joints that became one joint, by MuJoCo's number."""

    def converted(self) -> Converted:
        """The whole robot."""
        root, *beside = self._root_bodies()
        if beside or any(kind != _FREE for kind in self._joint_kinds(root)):  # its base is the world
            base = _Frame(self._link("base"))
            frames = {body: self._body(body, base) for body in (root, *beside)}
        else:
            frames = {root: _Frame(self._link(self._body_name(root)))}
        for body, frame in frames.items():
            self._mass(body, frame)
            self._shapes(body, frame)
        for body in range(1, self.model.nbody):
            parent = frames.get(int(self.model.body_parentid[body]))
            if parent is not None and body not in frames:
                frames[body] = self._body(body, parent)
                self._mass(body, frames[body])
                self._shapes(body, frames[body])
        self._mimics()
        text = etree.tostring(self.robot, pretty_print=True, encoding="unicode")
        head = f"<!-- Made by `mrhubo describe` of the MuJoCo model {self.path.name.replace('--', '- -')}. -->\n"
        text = f'<?xml version="1.0" encoding="utf-8"?>\n{head}{text}'
        return Converted(str(self.robot.get("name")), text, tuple(self.notes))

    def _joint_kinds(self, body: int) -> np.ndarray:
        first, count = int(self.model.body_jntadr[body]), int(self.model.body_jntnum[body])
        return self.model.jnt_type[first : first + count]

    def _root_bodies(self) -> list[int]:
        """The body on the world that carries most joints: floors, tables and balls carry fewer. Where it does not
        float, also those beside it that carry at least half as many, as two arms on a table do.
        """
        model, counts = self.model, {}
        top = {0: 0}
        for body in range(1, model.nbody):
            parent = int(model.body_parentid[body])
            top[body] = body if parent == 0 else top[parent]
            counts[top[body]] = counts.get(top[body], 0) + int(model.body_jntnum[body])
        if not counts or max(counts.values()) == 0:
            raise UserError(f"{self.path}: has no joint, so it is no robot")
        root = max(counts, key=lambda body: (counts[body], -body))
        floats = {body for body in counts if _FREE in self._joint_kinds(body)}
        least = max(_BESIDE * counts[root], 2)
        beside = [body for body in counts if counts[body] >= least and not {root, body} & floats and body != root]
        others = [self._body_name(body) for body in counts if body not in (root, *beside)]
        if others:
            self.notes.append(f"bodies beside the robot are left out: {listed(others)}")
        return [root, *beside]

    def _body_name(self, body: int) -> str:
        return self.model.body(body).name or f"body_{body}"

    def _link(self, name: str) -> str:
        while name in self.links:
            name += "_"
        self.links[name] = etree.SubElement(self.robot, "link", name=name)
        return name

    def _body(self, body: int, parent: _Frame) -> _Frame:
        model = self.model
        place_44 = parent.body_44 @ _pose(model.body_pos[body], model.body_quat[body])
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        turns = [turn for joint in range(first, first + count) for turn in self._turns(joint, body)]
        frame = parent
        for number, turn in enumerate(turns):
            last = number == len(turns) - 1
            name = self._link(self._body_name(body) if last else f"{self._body_name(body)}_{number + 1}")
            origin_44 = place_44 @ _pose(turn.anchor_3) @ turn.zero_44
            self._joint(turn.name, turn.kind, frame.link, name, origin_44, turn)
            frame, place_44 = _Frame(name, _pose(-turn.anchor_3)), _pose(-turn.anchor_3)
        if turns:
            return frame
        name = self._link(self._body_name(body))
        self._joint(f"{name}_fixed", "fixed", parent.link, name, place_44)
        return _Frame(name)

    def _turns(self, joint: int, body: int) -> Iterator[_Turn]:
        """The joints of URDF that one of MuJoCo is."""
        model = self.model
        name = model.joint(joint).name or f"{self._body_name(body)}_joint_{joint}"
        kind, anchor_3 = int(model.jnt_type[joint]), np.array(model.jnt_pos[joint])
        limits = tuple(map(float, model.jnt_range[joint])) if model.jnt_limited[joint] else None
        if kind == _FREE:
            self.notes.append(f"the free joint '{name}' is fixed")
            return
        if kind == _BALL:
            self.notes.append(f"the ball joint '{name}' became three: {name}_x, {name}_y, {name}_z")
            reach = min(limits[1], math.pi) if limits else math.pi
            for letter, axis_3 in zip("xyz", np.eye(3), strict=True):
                yield _Turn(f"{name}_{letter}", "revolute", anchor_3, axis_3, (-reach, reach))
            return
        self.names[joint] = name
        limits = limits or self.ranges.get(name)
        axis_3, zero = np.array(model.jnt_axis[joint]), float(model.qpos0[model.jnt_qposadr[joint]])
        back_44 = np.eye(4)
        if kind == _SLIDE:
            back_44[:3, 3] = -zero * axis_3
            yield _Turn(name, "prismatic", anchor_3, axis_3, limits, back_44)
        elif kind == _HINGE:
            back_44[:3, :3] = Rotation.from_rotvec(-zero * axis_3).as_matrix()
            yield _Turn(name, "revolute" if limits else "continuous", anchor_3, axis_3, limits, back_44)

    def _joint(
        self, name: str, kind: str, parent: str, child: str, origin_44: np.ndarray, turn: _Turn | None = None
    ) -> None:
        joint = self.joints[name] = etree.SubElement(self.robot, "joint", name=name, type=kind)
        _origin(joint, origin_44)
        etree.SubElement(joint, "parent", link=parent)
        etree.SubElement(joint, "child", link=child)
        if turn is None:
            return
        etree.SubElement(joint, "axis", xyz=_numbers(turn.axis_3))
        if turn.limits is not None:
            low, high = map(_number, turn.limits)
            etree.SubElement(joint, "limit", lower=low, upper=high, effort="0", velocity="0")

    def _mimics(self) -> None:
        """Joints whose position is a straight line of another's, by an active equality."""
        model, loops = self.model, 0
        for row in (row for row in range(model.neq) if model.eq_active0[row]):
            if int(model.eq_type[row]) != _JOINT_EQUALITY:
                loops += 1
                continue
            follower, source = int(model.eq_obj1id[row]), int(model.eq_obj2id[row])
            constant, slope, *bends = map(float, model.eq_data[row][:5])
            if source < 0 or any(bends) or not {follower, source} <= self.names.keys():
                loops += 1
                continue
            zero, other = (float(model.qpos0[model.jnt_qposadr[joint]]) for joint in (follower, source))
            etree.SubElement(
                self.joints[self.names[follower]], "mimic", joint=self.names[source],
                multiplier=_number(slope), offset=_number(zero + constant - slope * other),
            )  # fmt: skip
        if loops:
            self.notes.append(f"constraints that no URDF can tell (loops, curves) are left out: {loops}")

    def _mass(self, body: int, frame: _Frame) -> None:
        """Mass and its centre, where the model gives them; what MuJoCo works out of shapes hangs on meshes."""
        if body not in self.weighed:
            return
        model, element = self.model, etree.SubElement(self.links[frame.link], "inertial")
        _origin(element, frame.body_44 @ _pose(model.body_ipos[body], model.body_iquat[body]))
        etree.SubElement(element, "mass", value=_number(model.body_mass[body]))
        x, y, z = map(_number, model.body_inertia[body])
        etree.SubElement(element, "inertia", ixx=x, iyy=y, izz=z, ixy="0", ixz="0", iyz="0")

    def _shapes(self, body: int, frame: _Frame) -> None:
        model, link = self.model, self.links[frame.link]
        first = int(model.body_geomadr[body])
        for geom in range(first, first + int(model.body_geomnum[body])):
            tag = "collision" if model.geom_contype[geom] or model.geom_conaffinity[geom] else "visual"
            place_44 = frame.body_44 @ _pose(model.geom_pos[geom], model.geom_quat[geom])
            mesh = self.meshes.get(model.geom(geom).name)
            if mesh is not None:
                self._shape(link, tag, place_44, "mesh", filename=mesh[0], scale=mesh[1])
            elif (write := _SHAPES.get(int(model.geom_type[geom]))) is not None:
                for shape, offset_44, sizes in write(np.array(model.geom_size[geom])):
                    words = {word: _numbers(size) for word, size in sizes.items()}
                    self._shape(link, tag, place_44 @ offset_44, shape, **words)

    @staticmethod
    def _shape(link: etree._Element, tag: str, place_44: np.ndarray, shape: str, **sizes: str) -> None:
        element = etree.SubElement(link, tag)
        _origin(element, place_44)
        etree.SubElement(etree.SubElement(element, "geometry"), shape, sizes)


@dataclass(frozen=True)
class _Turn:
    """A joint about (or along) one axis, through an anchor, in the frame of its body."""

    name: str
    kind: str
    anchor_3: np.ndarray
    axis_3: np.ndarray
    limits: tuple[float, ...] | None
    zero_44: np.ndarray = field(default_factory=lambda: np.eye(4))
    """Takes the body from where the model stands to where the joint's position is 0."""


_Parts = list[tuple[str, np.ndarray, dict[str, np.ndarray]]]
"""Shapes of URDF: kind, place in the frame of MuJoCo's, sizes."""


def _capsule(size_3: np.ndarray) -> _Parts:
    """A cylinder and a ball at either end."""
    radius, half = size_3[:1], float(size_3[1])
    ends = [("sphere", _pose(np.array([0.0, 0.0, end])), {"radius": radius}) for end in (-half, half)]
    return [("cylinder", np.eye(4), {"radius": radius, "length": np.array([2 * half])}), *ends]


def _ellipsoid(size_3: np.ndarray) -> _Parts:
    """A capsule along its longest axis, as thick as it is in the middle."""
    order = np.argsort(size_3)
    radius = float(size_3[order[:2]].mean())
    place_44 = np.eye(4)
    place_44[:3, :3] = np.roll(np.eye(3), 2 - order[2], axis=1)  # z is its longest axis
    half = float(size_3[order[2]]) - radius
    if half < 1e-6:
        return [("sphere", np.eye(4), {"radius": np.array([radius])})]
    return [(kind, place_44 @ at_44, sizes) for kind, at_44, sizes in _capsule(np.array([radius, half]))]


_SHAPES: dict[int, Callable[[np.ndarray], _Parts]] = {
    _SPHERE: lambda size_3: [("sphere", np.eye(4), {"radius": size_3[:1]})],
    _CAPSULE: _capsule,
    _ELLIPSOID: _ellipsoid,
    _CYLINDER: lambda size_3: [("cylinder", np.eye(4), {"radius": size_3[:1], "length": 2 * size_3[1:2]})],
    _BOX: lambda size_3: [("box", np.eye(4), {"size": 2 * size_3})],
}


def _pose(position_3: np.ndarray, quaternion_4: np.ndarray | None = None) -> np.ndarray:
    """Pose (4, 4) of a position [m] and MuJoCo's quaternion (w, x, y, z)."""
    pose_44 = np.eye(4)
    pose_44[:3, 3] = position_3
    if quaternion_4 is not None:
        pose_44[:3, :3] = Rotation.from_quat(np.roll(quaternion_4, -1)).as_matrix()
    return pose_44


def _origin(element: etree._Element, pose_44: np.ndarray) -> None:
    with warnings.catch_warnings(action="ignore"):  # pitched by 90 degrees: roll and yaw are one, which is no matter
        rpy = Rotation.from_matrix(pose_44[:3, :3]).as_euler("xyz")
    etree.SubElement(element, "origin", xyz=_numbers(pose_44[:3, 3]), rpy=_numbers(rpy))


def _numbers(values: np.ndarray) -> str:
    return " ".join(map(_number, values))


def _number(value: float) -> str:
    return f"{round(float(value), 9) + 0.0:.9g}"
