"""Elements of a URDF, with what is read of them and as far as it can be; what is left out is listed."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass, field

from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)

from mrhubo.robot.attributes import MOST_METRES, MOST_RADIANS, problem, read_numbers, shown
from mrhubo.robot.document import Document

_SHAPES = {
    "sphere": {"radius": 1}, "cylinder": {"radius": 1, "length": 1}, "capsule": {"radius": 1, "length": 1},
    "box": {"size": 3}, "mesh": {},
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
MOST_FACTOR = 1e6
"""Numbers without a unit are no larger."""
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


@dataclass
class Findings:
    """What is wrong in a file, as it is found: lines and sentences."""

    faults: dict[str, str] = field(default_factory=dict)
    """By joint, why its numbers cannot be used."""
    doubts: dict[str, str] = field(default_factory=dict)
    """By joint, what is odd about it."""
    misplaced: set[str] = field(default_factory=set)
    """Joints whose child link has no place."""
    left_out: list[str] = field(default_factory=list)
    unread_collisions: set[str] = field(default_factory=set)


def clean_joint(document: Document, joint: etree._Element, found: Findings) -> etree._Element:
    """A joint with what is read, as far as it can be."""
    _list_unread(document, joint, f"joint '{joint.get('name')}'", found)
    clean = etree.Element("joint", name=str(joint.get("name")), type=str(joint.get("type")))
    for tag, attributes in _READ.items():
        element = joint.find(tag)
        # Where a floating base is at the start says nothing of the robot; it is where the motion has it.
        if element is None or (tag == "origin" and joint.get("type") == "floating"):
            continue
        given = {word: str(element.get(word)) for word in attributes if element.get(word) is not None}
        most, infinite = (math.inf, True) if tag == "limit" else (MOST_FACTOR, False)
        wrong = [word for word, n in attributes.items() if n and problem(element, word, n, most, infinite)]
        if tag == "mimic" and (wrong or not given.get("joint") or joint.get("name") in found.faults):
            continue
        etree.SubElement(clean, tag, {word: text for word, text in given.items() if word not in wrong})
    return clean


def clean_link(document: Document, link: etree._Element, found: Findings) -> etree._Element:
    """A link with the shapes that can be read."""
    name = str(link.get("name"))
    _list_unread(document, link, f"link '{name}'", found)
    clean = etree.Element("link", name=name)
    for element in link:
        if element.tag not in ("visual", "collision"):
            continue
        wrong = _shape_problem(element)
        if wrong is None:
            clean.extend(_parts(_shape(document, element, found)))
            continue
        found.left_out.append(f"{document.line(element)}: the {element.tag} of link '{name}' {wrong}")
        if element.tag == "collision":
            found.unread_collisions.add(name)
    return clean


def read_mass(link: etree._Element) -> tuple[float, float, float, float] | None:
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
        numbers = read_numbers(shape.get(word), count, MOST_METRES)
        if isinstance(numbers, str):
            return f"has {shown(shape, word, numbers)}"
    return None


def _shape(document: Document, element: etree._Element, found: Findings) -> etree._Element:
    """A visual or collision element whose colours and scales can be read."""
    clean = copy.deepcopy(element)
    for material in clean.findall("material"):
        clean.replace(material, clean_material(document, material, found))
    for mesh in clean.iterfind("geometry/mesh"):
        if any(isinstance(read_numbers(word, 1), str) for word in mesh.get("scale", "").split()):
            del mesh.attrib["scale"]
    return clean


def _parts(element: etree._Element) -> list[etree._Element]:
    """A visual or collision element; of a capsule, which Bullet and others read in a URDF and the parser does not, a
    cylinder as long as it is without its round ends, and a ball at either end, as `mrhubo.robot.shapes` knows them.
    """
    capsule = element.find("geometry/capsule")
    if capsule is None:
        return [element]
    origin = element.find("origin")
    x, y, z, roll, pitch, yaw = (
        number
        for word in ("xyz", "rpy")
        for number in map(float, ("0 0 0" if origin is None else origin.get(word, "0 0 0")).split())
    )
    # The third column of the rotation: where the capsule's axis points.
    level, side = math.sin(pitch) * math.cos(roll), math.sin(roll)
    ahead, left = math.cos(yaw), math.sin(yaw)
    axis_3 = (ahead * level + left * side, left * level - ahead * side, math.cos(pitch) * math.cos(roll))
    radius, length = str(capsule.get("radius")), str(capsule.get("length"))
    found = []
    for kind, along in (("cylinder", 0.0), ("sphere", -0.5), ("sphere", 0.5)):
        part = copy.deepcopy(element)
        for old in (*part.findall("origin"), part.find("geometry")):
            part.remove(old)
        at_3 = (place + along * float(length) * way for place, way in zip((x, y, z), axis_3, strict=True))
        etree.SubElement(part, "origin", xyz=" ".join(map(repr, at_3)), rpy=f"{roll!r} {pitch!r} {yaw!r}")
        sizes = {"radius": radius} if kind == "sphere" else {"radius": radius, "length": length}
        etree.SubElement(etree.SubElement(part, "geometry"), kind, sizes)
        found.append(part)
    return found


def clean_material(document: Document, material: etree._Element, found: Findings) -> etree._Element:
    """A material's name and colour: a texture only trips the parser."""
    clean = etree.Element("material", {"name": material.get("name")} if material.get("name") is not None else {})
    color = material.find("color")
    numbers = [] if color is None else [read_numbers(word, 1) for word in color.get("rgba", "1 1 1 1").split()]
    if len(numbers) >= 3 and not any(isinstance(number, str) for number in numbers):
        clean.append(copy.deepcopy(color))
    elif color is not None:
        found.left_out.append(f"{document.line(color)}: the colour of a material, {shown(color, 'rgba', 'is none')}")
    return clean


def _list_unread(document: Document, element: etree._Element, name: str, found: Findings) -> None:
    for path, attributes in _UNREAD[element.tag].items() if len(element) else ():
        part = element.find(path)
        wrong = [] if part is None else [problem(part, word, n, infinite=True) for word, n in attributes.items()]
        if first := next((text for text in wrong if text is not None), None):
            found.left_out.append(f"{document.line(part)}: {name}: {first}")
