"""What kinematics need of a URDF, links and joints alone, checked and taken out of the file.

What nobody needs may be broken: masses, looks, shapes, and the numbers of joints that no part of the body hangs on. It
is left out and listed. How links hang together must be right everywhere.
"""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass, field
from pathlib import Path

from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)

from mrhubo.errors import UserError, unknown_name
from mrhubo.robot.attributes import MOST_METRES, MOST_RADIANS, expression_in, problem, read_numbers, shown
from mrhubo.robot.document import Document, read_document
from mrhubo.robot.joint import ROTARY

_KINDS = (*ROTARY, "prismatic", "fixed", "floating", "planar")
_SHAPES = {
    "sphere": {"radius": 1}, "cylinder": {"radius": 1, "length": 1}, "box": {"size": 3}, "mesh": {}
}  # fmt: skip
"""Shapes by tag, their attributes and how many numbers each has."""
_READ: dict[str, dict[str, int]] = {
    "origin": {"xyz": 3, "rpy": 3},
    "parent": {"link": 0},
    "child": {"link": 0},
    "axis": {"xyz": 3},
    "limit": {"lower": 1, "upper": 1, "velocity": 1},
    "mimic": {"joint": 0, "multiplier": 1, "offset": 1},
}
"""What is read of a joint, and how many numbers it has."""
_MOST_FACTOR = 1e6
_MOST_TURN = 7.0
"""A little over one turn."""
_UNREAD: dict[str, dict[str, dict[str, int]]] = {
    "link": {
        "inertial/mass": {"value": 1},
        "inertial/inertia": dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 1),
        "inertial/origin": {"xyz": 3, "rpy": 3},
    },
    "joint": {
        "limit": {"effort": 1, "velocity": 1},
        "dynamics": {"damping": 1, "friction": 1},
        "safety_controller": {"soft_lower_limit": 1, "soft_upper_limit": 1},
    },
}
"""What a robot can do without: a broken number there is told, and that is all."""


@dataclass(frozen=True)
class Tree:
    """The links and joints of a URDF."""

    path: Path
    root: str
    links: tuple[str, ...]
    joints: dict[str, etree._Element]
    """The file's elements by name, in its order."""
    robot: etree._Element
    """A URDF of what can be read, and of links and joints alone."""
    faults: dict[str, str]
    """By joint, why its numbers cannot be used: line and sentence. Without a place it is not in `robot`."""
    doubts: dict[str, str]
    """By joint, what is odd about it: line and sentence."""
    left_out: tuple[str, ...]
    """What cannot be read and is not needed."""
    unread_collisions: frozenset[str]
    """Links with a collision element that cannot be read."""
    masses: dict[str, tuple[float, float, float, float]]
    """By link: mass [kg] and its centre [m] in the link's frame, of those that have a mass."""


@dataclass
class _Findings:
    faults: dict[str, str] = field(default_factory=dict)
    doubts: dict[str, str] = field(default_factory=dict)
    misplaced: set[str] = field(default_factory=set)
    """Joints whose child link has no place."""
    left_out: list[str] = field(default_factory=list)
    unread_collisions: set[str] = field(default_factory=set)


def read_tree(path: Path) -> Tree:
    """The links and joints of a URDF file.

    Raises:
        UserError: the file is no URDF, or its links and joints are no tree; names the joint or link and the line.
    """
    document = read_document(path)
    links = _named(document, "link")
    joints = _named(document, "joint")
    for name, joint in joints.items():
        _check_joint(document, name, joint, links)
    root, order = _check_tree(document, links, joints)
    for name, joint in joints.items():
        if joint.get("type") in ("floating", "planar") and joint.find("parent").get("link") != root:
            raise UserError(
                f"{document.place(joint)}: joint '{name}' is {joint.get('type')}; only rotary, prismatic and fixed "
                "joints can be handled below the root"
            )
    found = _Findings()
    for name, joint in joints.items():
        _find_faults(document, name, joint, found)
    lost: set[str] = set()
    for joint in (joints[name] for name in order):
        child, parent = (str(joint.find(end).get("link")) for end in ("child", "parent"))
        if joint.get("name") in found.misplaced or parent in lost:
            lost.add(child)
    robot = etree.Element("robot", name=document.robot.get("name") or path.stem)
    robot.extend(_material(document, e, found) for e in document.robot.findall("material"))
    robot.extend(_link(document, links[name], found) for name in links if name not in lost)
    robot.extend(_joint(document, joint, found) for joint in joints.values() if _child(joint) not in lost)
    collisions = frozenset(found.unread_collisions)
    masses = {name: mass for name, link in links.items() if (mass := _mass(link)) is not None}
    return Tree(
        path, root, tuple(links), joints, robot, found.faults, found.doubts, tuple(found.left_out), collisions, masses
    )


def _child(joint: etree._Element) -> str:
    return str(joint.find("child").get("link"))


def _named(document: Document, kind: str) -> dict[str, etree._Element]:
    """The links or joints by name."""
    found: dict[str, etree._Element] = {}
    for element in document.robot.findall(kind):
        name = element.get("name")
        if not name:
            raise UserError(f"{document.place(element)}: a {kind} has no name")
        if name in found:
            raise UserError(f"{document.place(element)}: {kind} '{name}' appears twice")
        found[name] = element
    return found


def _check_joint(document: Document, name: str, joint: etree._Element, links: dict[str, etree._Element]) -> None:
    place, kind = f"{document.place(joint)}: joint '{name}'", joint.get("type")
    if kind is None:
        raise UserError(f"{place} has no type; write one of {', '.join(_KINDS)}")
    if kind not in _KINDS:
        if (expression := expression_in(kind, "type")) is not None:
            raise UserError(f"{place}: {shown(joint, 'type', expression)}")
        raise UserError(f"{place} has an unknown type: {unknown_name('joint type', kind, _KINDS)}")
    for end in ("parent", "child"):
        element = joint.find(end)
        link = element.get("link") if element is not None else None
        if link is None:
            raise UserError(f'{place} has no <{end} link="...">; name its {end} link')
        if link not in links:
            raise UserError(f"{place} has the {end} link '{link}', which does not exist")


def _check_tree(
    document: Document, links: dict[str, etree._Element], joints: dict[str, etree._Element]
) -> tuple[str, list[str]]:
    """The root, and the joints from it outwards."""
    above: dict[str, str] = {}
    below: dict[str, list[str]] = {}
    for name, joint in joints.items():
        child = _child(joint)
        if child in above:
            raise UserError(
                f"{document.place(joint)}: link '{child}' hangs on two joints, '{above[child]}' and '{name}'"
            )
        above[child] = name
        below.setdefault(str(joint.find("parent").get("link")), []).append(name)
    roots = [name for name in links if name not in above]
    if len(roots) != 1:
        shown_roots = ", ".join(f"'{root}'" for root in roots[:5]) or "none (the joints form a loop)"
        raise UserError(
            f"robot.urdf: {document.path}: a robot has one root link, this file has {len(roots)}: {shown_roots}"
        )
    order = list(below.get(roots[0], []))
    for name in order:
        order += below.get(_child(joints[name]), [])
    if len(order) < len(joints):
        reached = set(order)
        lost = next(name for name in joints if name not in reached)
        raise UserError(
            f"{document.place(joints[lost])}: link '{_child(joints[lost])}' hangs in a loop of joints, not on the root "
            f"'{roots[0]}'"
        )
    return roots[0], order


def _find_faults(document: Document, name: str, joint: etree._Element, found: _Findings) -> None:
    """Why a joint's numbers cannot be used: the first reason."""
    origin, axis, limit, mimic = (joint.find(tag) for tag in ("origin", "axis", "limit", "mimic"))
    kind = joint.get("type")
    far = problem(origin, "xyz", 3, MOST_METRES)
    place = [(origin, far and f"{far}; lengths are in metres"), (origin, problem(origin, "rpy", 3, MOST_RADIANS))]
    motion: list[tuple[etree._Element | None, str | None]] = []
    if kind in (*ROTARY, "prismatic"):
        place.append((axis, problem(axis, "xyz", 3, _MOST_FACTOR) or _zero(axis)))
        motion += [(mimic, problem(mimic, word, 1, _MOST_FACTOR)) for word in ("multiplier", "offset")]
        if mimic is not None and not mimic.get("joint"):
            motion.append((mimic, "<mimic> names no joint"))
    if kind in ("revolute", "prismatic"):
        motion += [(limit, problem(limit, word, 1, infinite=True)) for word in ("lower", "upper")]
    wrong = next(((element, text) for element, text in (*place, *motion) if element is not None and text), None)
    if wrong is not None:
        what = " has impossible limits: " if wrong[0] is limit else ": "
        found.faults[name] = f"{document.line(wrong[0])}: joint '{name}'{what}{wrong[1]}"
    if any(text is not None for _, text in place):
        found.misplaced.add(name)
    if name not in found.faults and (odd := problem(origin, "rpy", 3, _MOST_TURN)) is not None:
        found.doubts[name] = f"{document.line(origin)}: joint '{name}': {odd} rad: are these degrees?"


def _zero(axis: etree._Element | None) -> str | None:
    """Whether an axis has no direction."""
    numbers = [] if axis is None else read_numbers(axis.get("xyz", "1 0 0"), 3)
    if isinstance(numbers, str) or not numbers or math.hypot(*numbers) >= 1e-9:
        return None
    return shown(axis, "xyz", "is zero, which is no direction")


def _joint(document: Document, joint: etree._Element, found: _Findings) -> etree._Element:
    """A joint with what is read, as far as it can be."""
    _list_unread(document, joint, f"joint '{joint.get('name')}'", found)
    clean = etree.Element("joint", name=str(joint.get("name")), type=str(joint.get("type")))
    for tag, attributes in _READ.items():
        element = joint.find(tag)
        if element is None:
            continue
        given = {word: str(element.get(word)) for word in attributes if element.get(word) is not None}
        most, infinite = (math.inf, True) if tag == "limit" else (_MOST_FACTOR, False)
        wrong = [word for word, n in attributes.items() if n and problem(element, word, n, most, infinite)]
        if tag == "mimic" and (wrong or not given.get("joint") or joint.get("name") in found.faults):
            continue
        etree.SubElement(clean, tag, {word: text for word, text in given.items() if word not in wrong})
    return clean


def _link(document: Document, link: etree._Element, found: _Findings) -> etree._Element:
    """A link with the shapes that can be read."""
    name = str(link.get("name"))
    _list_unread(document, link, f"link '{name}'", found)
    clean = etree.Element("link", name=name)
    for element in link:
        if element.tag not in ("visual", "collision"):
            continue
        wrong = _shape_problem(element)
        if wrong is None:
            clean.append(_shape(document, element, found))
            continue
        found.left_out.append(f"{document.line(element)}: the {element.tag} of link '{name}' {wrong}")
        if element.tag == "collision":
            found.unread_collisions.add(name)
    return clean


def _mass(link: etree._Element) -> tuple[float, float, float, float] | None:
    """Mass and centre of a link; None where they cannot be read, or there is no mass."""
    mass, origin = (link.find(f"inertial/{tag}") for tag in ("mass", "origin"))
    kilograms = read_numbers(mass.get("value", ""), 1) if mass is not None else []
    centre_3 = [0.0] * 3 if origin is None else read_numbers(origin.get("xyz", "0 0 0"), 3, MOST_METRES)
    if isinstance(kilograms, str) or isinstance(centre_3, str) or not kilograms or not 0 < kilograms[0] < math.inf:
        return None
    return kilograms[0], centre_3[0], centre_3[1], centre_3[2]


def _shape_problem(element: etree._Element) -> str | None:
    origin, geometry = element.find("origin"), element.find("geometry")
    wrong = problem(origin, "xyz", 3, MOST_METRES) or problem(origin, "rpy", 3, MOST_RADIANS)
    if wrong is not None:
        return f"has {wrong}"
    if geometry is None or len(geometry) == 0:
        return "has no shape"
    shape = geometry[0]
    if shape.tag not in _SHAPES:
        return f"is a <{shape.tag}>, which is no shape of URDF"
    for word, count in _SHAPES[shape.tag].items():
        if shape.get(word) is None:
            return f"is a <{shape.tag}> without {word}"
        numbers = read_numbers(shape.get(word).replace(",", " "), count, MOST_METRES)
        if isinstance(numbers, str):
            return f"has {shown(shape, word, numbers)}"
    return None


def _shape(document: Document, element: etree._Element, found: _Findings) -> etree._Element:
    """A visual or collision element whose colours and scales can be read."""
    clean = copy.deepcopy(element)
    for material in clean.findall("material"):
        clean.replace(material, _material(document, material, found))
    for mesh in clean.iterfind("geometry/mesh"):
        if any(isinstance(read_numbers(word, 1), str) for word in mesh.get("scale", "").replace(",", " ").split()):
            del mesh.attrib["scale"]
    return clean


def _material(document: Document, material: etree._Element, found: _Findings) -> etree._Element:
    """A material's name and colour: a texture only trips the parser."""
    clean = etree.Element("material", {"name": material.get("name")} if material.get("name") is not None else {})
    color = material.find("color")
    numbers = [] if color is None else [read_numbers(word, 1) for word in color.get("rgba", "1 1 1 1").split()]
    if len(numbers) >= 3 and not any(isinstance(number, str) for number in numbers):
        clean.append(copy.deepcopy(color))
    elif color is not None:
        found.left_out.append(f"{document.line(color)}: the colour of a material, {shown(color, 'rgba', 'is none')}")
    return clean


def _list_unread(document: Document, element: etree._Element, name: str, found: _Findings) -> None:
    for path, attributes in _UNREAD[element.tag].items() if len(element) else ():
        part = element.find(path)
        wrong = [] if part is None else [problem(part, word, n, infinite=True) for word, n in attributes.items()]
        if first := next((text for text in wrong if text is not None), None):
            found.left_out.append(f"{document.line(part)}: {name}: {first}")
