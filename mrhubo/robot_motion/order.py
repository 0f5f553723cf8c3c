"""Joints in the order that somebody else has them: of a list of names, a URDF, or a MuJoCo model.

MuJoCo's qpos goes through the bodies depth first, a body's own joints first, seven numbers for a free joint (place,
then quaternion, w first) and one for a hinge or a slide: https://mujoco.readthedocs.io/en/stable/modeling.html and
XMLreference.html. Only names, kinds and nesting are read of a model here.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mrhubo.errors import UserError, listed, shortened, unknown_name
from mrhubo.files.regular import read_regular
from mrhubo.robot_motion.motion import RobotMotion, find_repeated

if TYPE_CHECKING:
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)

_MAX_BYTES = 20_000_000
_MAX_JOINTS = 4_096
_MAX_INCLUDES = 50
_FREE = "free"
_ONE_NUMBER = ("hinge", "slide")
_OTHER_TURNS = ("axisangle", "xyaxes", "zaxis", "euler")
"""What says how a body is turned besides `quat`."""
ORIGIN, UPRIGHT = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class JointOrder:
    """Names of joints in an order, and the free joint before them, if there is one."""

    names: tuple[str, ...]
    """Joints with one number each."""
    source: str = ""
    """The file, for messages."""
    free_joint: str | None = None
    """Name of the base's free joint; None: there is none."""
    position: tuple[float, float, float] = ORIGIN
    """Where the model has its base [m], x forward, y left, z up."""
    quaternion_wxyz: tuple[float, float, float, float] = UPRIGHT
    """How it is turned there."""
    free_body: str = ""
    """Name of the body that the free joint moves."""


def read_joint_order(path: Path) -> JointOrder:
    """The order of the joints in a file: a MuJoCo model, a URDF (the order in which they stand there), or a text with a
    name a line; what is in the file, and not its ending, says which.

    Raises:
        UserError: the file is missing, too large, or has no joints, or one that is not read (ball joints, joints
            without a name, two of one name).
    """
    path = Path(path)
    content = read_regular(path, _MAX_BYTES)
    if content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        root = _parse(path, content)
        if root.tag == "mujoco":
            order = _Model(path, root).order()
        elif root.tag == "robot":
            joints = [joint for joint in root.iterchildren("joint") if joint.get("type") != "fixed"]
            order = JointOrder(tuple(joint.get("name") or "" for joint in joints), str(path))
        else:
            raise UserError(f"{path}: begins with <{shortened(root.tag)}>; expected a MuJoCo model or a URDF")
    else:
        try:
            order = JointOrder(tuple(_lines(content.decode("utf-8-sig"))), str(path))
        except UnicodeDecodeError as error:
            raise UserError(f"{path}: is no text; expected the name of a joint a line, or an XML model") from error
    if not order.names or len(order.names) > _MAX_JOINTS:
        raise UserError(f"{path}: names {len(order.names)} joints; expected 1 to {_MAX_JOINTS}")
    if (repeated := find_repeated(order.names)) is not None:
        raise UserError(f"{path}: names joint '{shortened(repeated)}' twice")
    if not all(order.names):
        raise UserError(f"{path}: has a joint without a name")
    return order


def in_order(motion: RobotMotion, order: JointOrder) -> tuple[RobotMotion, tuple[str, ...]]:
    """The motion with its joints in an order, and what had to be done for it, a sentence each.

    Joints of the robot that the motion does not turn follow the joint that they mimic, or are held where the robot
    holds them. Limits are told no more where such joints are in.

    Raises:
        UserError: a name is no joint of the robot.
    """
    others = {other.name: other for other in motion.robot.others}
    columns, held, following = [], [], []
    for name in order.names:
        if name in motion.joint_names:
            columns.append(motion.q[..., motion.joint_names.index(name)])
            continue
        if name not in others:
            known = [*motion.joint_names, *others]
            said = unknown_name("joint", shortened(name), known, f"the robot {motion.robot.name}".strip())
            hint = "" if others else "; of a file, only the joints that move are known"
            raise UserError(f"{order.source}: {said}{hint}")
        other = others[name]
        driver = motion.q[..., motion.joint_names.index(other.joint)] if other.joint else np.zeros(motion.q.shape[:-1])
        columns.append((other.multiplier * driver + other.offset).astype(np.float32))
        (following if other.joint else held).append(other)
    notes = []
    if held:
        angles = sorted({f"{other.offset:.4g}" for other in held})
        where = f"at {angles[0]} rad" if len(angles) == 1 else "where the robot holds them, not all at 0 rad"
        notes.append(f"held {where}, as the motion does not turn them: {listed(other.name for other in held)}")
    if following:
        notes.append(f"joints that mimic others follow them: {listed(other.name for other in following)}")
    if left := [name for name in motion.joint_names if name not in order.names]:
        notes.append(f"joints that {order.source or 'the order'} does not have are left out: {listed(left)}")
    picked = [motion.joint_names.index(name) for name in order.names if name in motion.joint_names]
    whole = len(picked) == len(order.names)
    facts = motion.robot
    limits: dict[str, Any] = {
        key: array[picked] if whole and array is not None else None
        for key, array in {"lower": facts.lower, "upper": facts.upper, "velocity": facts.velocity}.items()
    }
    own = set(order.names)
    rest = tuple(o for o in facts.others if o.name not in own and (not o.joint or o.joint in own))
    robot = dataclasses.replace(facts, **limits, others=rest)
    q = np.stack(columns, axis=-1)
    return dataclasses.replace(motion, q=q, joint_names=order.names, robot=robot), tuple(notes)


def left_out(motion: RobotMotion, order: JointOrder | None) -> tuple[str, ...]:
    """What is to be said of a file that has a motion's joints alone, and no word of the robot's others: those that are
    not at 0 are elsewhere in whatever plays it. Nothing, where the joints of an order are written: it knows which
    there are.
    """
    if order is not None:
        return ()
    turned = [other.name for other in motion.robot.others if other.joint or other.offset]
    if not turned:
        return ()
    return (f"joints that mimic others, or are held at another angle than 0, are not in it: {listed(turned)}; a"
            " --joint-order that names them has them written",)  # fmt: skip


def _lines(text: str) -> Iterator[str]:
    """Names that stand one a line, or with commas between; after # is a comment, and a list's dashes are no names."""
    for line in text.splitlines():
        for name in line.partition("#")[0].split(","):
            if name := name.strip().removeprefix("- ").strip("[]'\" "):
                yield name


def _parse(path: Path, content: bytes) -> etree._Element:
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]; an answer needs none

    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False, remove_comments=True, remove_pis=True
    )
    try:
        return etree.fromstring(content, parser)
    except (etree.XMLSyntaxError, ValueError) as error:
        raise UserError(f"{path}: is no XML: {shortened(error, 200)}") from error


@dataclass
class _Model:
    """A MuJoCo model being read."""

    path: Path
    root: etree._Element
    included: int = 0
    kinds: dict[str, str] = field(default_factory=dict)
    """Kind of joint that a class of defaults gives."""
    names: list[str] = field(default_factory=list)
    free: tuple[str, etree._Element] | None = None

    def order(self) -> JointOrder:
        sections = list(self._inside(self.root))
        for section in sections:
            if section.tag == "default":
                self._defaults(section, "hinge", "main")
        for section in sections:
            if section.tag == "worldbody":
                self._bodies(section, "main")
        if self.free is None:
            return JointOrder(tuple(self.names), str(self.path))
        name, body = self.free
        if other := next((key for key in _OTHER_TURNS if body.get(key)), None):
            raise UserError(f"{self.path}, line {body.sourceline}: the base is turned by '{other}'; write it as 'quat'")
        place, turn = self._numbers(body, "pos", ORIGIN), self._numbers(body, "quat", UPRIGHT)
        return JointOrder(tuple(self.names), str(self.path), name, place, turn, body.get("name") or "")

    def _inside(self, element: etree._Element) -> Iterator[etree._Element]:
        """What is in an element, with what it includes in its place."""
        for child in element:
            if child.tag != "include":
                yield child
                continue
            self.included += 1
            if self.included > _MAX_INCLUDES:
                raise UserError(f"{self.path}: includes more than {_MAX_INCLUDES} files")
            file = self.path.parent / (child.get("file") or "")
            yield from self._inside(_parse(file, read_regular(file, _MAX_BYTES)))

    def _defaults(self, element: etree._Element, kind: str, name: str) -> None:
        children = list(self._inside(element))
        for child in children:
            if child.tag == "joint":
                kind = child.get("type") or kind
        self.kinds[element.get("class") or name] = kind
        for child in children:
            if child.tag == "default":
                self._defaults(child, kind, "")

    def _bodies(self, element: etree._Element, inherited: str) -> None:
        """Joints of a body, then those of the bodies on it. A frame only places what is in it."""
        children = list(self._flat(element))
        inherited = element.get("childclass") or inherited
        for child in children:
            if child.tag in ("joint", "freejoint"):
                self._joint(element, child, inherited)
            elif child.tag in ("replicate", "attach", "composite", "flexcomp"):
                raise UserError(f"{self.path}: has <{child.tag}>, which only MuJoCo can take apart; save the compiled "
                                "model with mj_saveLastXML, or list the joints in a text file")  # fmt: skip
        for child in children:
            if child.tag == "body":
                self._bodies(child, inherited)

    def _flat(self, element: etree._Element) -> Iterator[etree._Element]:
        for child in self._inside(element):
            if child.tag == "frame":
                yield from self._flat(child)
            else:
                yield child

    def _joint(self, body: etree._Element, joint: etree._Element, inherited: str) -> None:
        given = self.kinds.get(joint.get("class") or inherited, "hinge")
        kind = _FREE if joint.tag == "freejoint" else joint.get("type") or given
        name = joint.get("name") or ""
        if kind == _FREE:
            if self.free is not None or self.names:
                raise UserError(f"{self.path}: has a free joint '{shortened(name)}' behind other joints; expected one, "
                                "of the robot's base, before all others")  # fmt: skip
            self.free = (name, body)
        elif kind in _ONE_NUMBER:
            if not name:
                raise UserError(f"{self.path}, line {joint.sourceline}: a joint has no name")
            self.names.append(name)
        else:
            raise UserError(f"{self.path}: joint '{shortened(name)}' is of type '{shortened(kind)}'; expected hinge, "
                            "slide, or free for the base")  # fmt: skip

    def _numbers(self, body: etree._Element, key: str, default: Any) -> Any:
        text = body.get(key)
        if text is None:
            return default
        try:
            numbers = tuple(map(float, text.split()))
        except ValueError:
            numbers = ()
        size = float(np.linalg.norm(numbers)) if numbers else 0.0
        if len(numbers) != len(default) or not np.isfinite(size) or (key == "quat" and size == 0):
            raise UserError(
                f"{self.path}, line {body.sourceline}: {key}='{shortened(text)}' are not {len(default)} numbers"
            )
        return tuple(number / size for number in numbers) if key == "quat" else numbers
