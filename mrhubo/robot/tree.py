"""What kinematics need of a URDF, links and joints alone, checked and taken out of the file.

What nobody needs may be broken: masses, looks, shapes, and the numbers of joints that no part of the body hangs on. It
is left out and listed. How links hang together must be right everywhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)

from mrhubo.errors import UserError, unknown_name
from mrhubo.robot.attributes import MOST_METRES, MOST_RADIANS, expression_in, problem, read_numbers, shown
from mrhubo.robot.document import Document, read_document
from mrhubo.robot.joint import ROTARY
from mrhubo.robot.tree_elements import MOST_FACTOR, Findings, clean_joint, clean_link, clean_material, read_mass

_KINDS = (*ROTARY, "prismatic", "fixed", "floating", "planar")
_MOST_TURN = 7.0
"""A little over one turn."""


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


def read_tree(path: Path, text: bytes | None = None) -> Tree:
    """The links and joints of a URDF file; `text` as for `read_document`.

    Raises:
        UserError: the file is no URDF, or its links and joints are no tree; names the joint or link and the line.
    """
    document = read_document(path, text)
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
    found = Findings()
    for name, joint in joints.items():
        _find_faults(document, name, joint, found)
    lost: set[str] = set()
    for joint in (joints[name] for name in order):
        child, parent = (str(joint.find(end).get("link")) for end in ("child", "parent"))
        if joint.get("name") in found.misplaced or parent in lost:
            lost.add(child)
    robot = etree.Element("robot", name=document.robot.get("name") or path.stem)
    robot.extend(clean_material(document, e, found) for e in document.robot.findall("material"))
    robot.extend(clean_link(document, links[name], found) for name in links if name not in lost)
    robot.extend(clean_joint(document, joint, found) for joint in joints.values() if _child(joint) not in lost)
    collisions = frozenset(found.unread_collisions)
    masses = {name: mass for name, link in links.items() if (mass := read_mass(link)) is not None}
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


def _find_faults(document: Document, name: str, joint: etree._Element, found: Findings) -> None:
    """Why a joint's numbers cannot be used: the first reason."""
    origin, axis, limit, mimic = (joint.find(tag) for tag in ("origin", "axis", "limit", "mimic"))
    kind = joint.get("type")
    far = problem(origin, "xyz", 3, MOST_METRES)
    place = [(origin, far and f"{far}; lengths are in metres"), (origin, problem(origin, "rpy", 3, MOST_RADIANS))]
    motion: list[tuple[etree._Element | None, str | None]] = []
    if kind in (*ROTARY, "prismatic"):
        place.append((axis, problem(axis, "xyz", 3, MOST_FACTOR) or _zero(axis)))
        motion += [(mimic, problem(mimic, word, 1, MOST_FACTOR)) for word in ("multiplier", "offset")]
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
    elif name not in found.faults and kind in ("revolute", "prismatic") and limit is not None:
        lower, upper = (float(limit.get(word, "nan")) for word in ("lower", "upper"))
        if lower > upper:
            found.doubts[name] = (
                f"{document.line(limit)}: joint '{name}' has the limits {lower:g} .. {upper:g}, the wrong way round; "
                f"taken: {upper:g} .. {lower:g}"
            )


def _zero(axis: etree._Element | None) -> str | None:
    """Whether an axis has no direction."""
    numbers = [] if axis is None else read_numbers(axis.get("xyz", "1 0 0"), 3)
    if isinstance(numbers, str) or not numbers or math.hypot(*numbers) >= 1e-9:
        return None
    return shown(axis, "xyz", "is zero, which is no direction")
