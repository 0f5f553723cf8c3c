"""The same robot as another file would tell it: renamed, reordered, axes negated, turned, scaled."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)

from mrhubo.robot.document import read_document

_LENGTHS = ("xyz", "size", "radius", "length")


def variant(
    urdf: Path, seed: int, rename: bool = False, reorder: bool = False, negate: bool = False,
    turn: tuple[float, float, float] | None = None, scale: float = 1.0,
) -> tuple[str, Mapping[str, str]]:  # fmt: skip
    """The URDF text of a robot in another form, and the new name of each link and joint.

    Args:
        urdf: the file.
        seed: of what is random.
        rename: give every link and joint a random name.
        reorder: change the order of all elements.
        negate: turn some joints' axes round, with limits, and the multipliers of those that mimic them.
        turn: roll, pitch and yaw [rad] by which the whole robot is turned, below a new root.
        scale: by what factor all lengths grow.
    """
    random = np.random.default_rng(seed)
    robot = copy.deepcopy(read_document(urdf).robot)
    for tag in ("transmission", "gazebo"):
        for element in robot.findall(tag):
            robot.remove(element)
    joints = robot.findall("joint")
    if negate:
        signs = {str(joint.get("name")): -1.0 if random.random() < 0.5 else 1.0 for joint in joints}
        for joint in joints:
            _negate(joint, signs)
    if turn is not None:
        _turn(robot, turn)
    if scale != 1.0:
        _scale(robot, scale)
    names: dict[str, str] = {}
    if rename:
        elements = [*robot.findall("link"), *robot.findall("joint")]
        words = {str(element.get("name")): "" for element in elements}
        names = {word: "".join(random.choice([*"abcdeghikmnopqstuvwxyz"], 10)) for word in words}
        for element in robot.iter("link", "joint", "parent", "child", "mimic"):
            key = {"parent": "link", "child": "link", "mimic": "joint"}.get(element.tag, "name")
            if element.get(key) in names:
                element.set(key, names[str(element.get(key))])
    if reorder:
        children = list(robot)
        for element in children:
            robot.remove(element)
        robot.extend(children[i] for i in random.permutation(len(children)))
    return etree.tostring(robot).decode(), names


def _negate(joint: etree._Element, signs: Mapping[str, float]) -> None:
    sign = signs[str(joint.get("name"))]
    axis, limit, mimic = (joint.find(tag) for tag in ("axis", "limit", "mimic"))
    if sign < 0 and axis is not None and joint.get("type") in ("revolute", "continuous", "prismatic"):
        axis.set("xyz", " ".join(repr(-float(word)) for word in axis.get("xyz", "1 0 0").split()))
        if limit is not None and limit.get("lower") is not None and limit.get("upper") is not None:
            lower, upper = float(limit.get("lower")), float(limit.get("upper"))
            limit.set("lower", repr(-upper))
            limit.set("upper", repr(-lower))
    if mimic is not None:
        factor = float(mimic.get("multiplier", "1")) * sign * signs.get(str(mimic.get("joint")), 1.0)
        mimic.set("multiplier", repr(factor))
        mimic.set("offset", repr(float(mimic.get("offset", "0")) * sign))


def _turn(robot: etree._Element, turn: tuple[float, float, float]) -> None:
    children = {str(joint.find("child").get("link")) for joint in robot.findall("joint")}
    root = next(str(link.get("name")) for link in robot.findall("link") if link.get("name") not in children)
    etree.SubElement(robot, "link", name="turned_root")
    joint = etree.SubElement(robot, "joint", name="turned_joint", type="fixed")
    etree.SubElement(joint, "parent", link="turned_root")
    etree.SubElement(joint, "child", link=root)
    etree.SubElement(joint, "origin", xyz="0 0 0", rpy=" ".join(map(repr, turn)))


def _scale(robot: etree._Element, scale: float) -> None:
    for element in robot.iter("origin", "box", "sphere", "cylinder"):
        for word in _LENGTHS:
            if element.get(word) is not None:
                numbers = element.get(word).split()
                element.set(word, " ".join(repr(scale * float(number)) for number in numbers))
    for joint in robot.findall("joint"):
        limit = joint.find("limit")
        if joint.get("type") == "prismatic" and limit is not None:
            for word in ("lower", "upper"):
                if limit.get(word) is not None:
                    limit.set(word, repr(scale * float(limit.get(word))))
