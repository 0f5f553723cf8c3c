"""A robot whose root lies on a limb, as a foot that a drawing began with, written anew with its trunk as the root.

Joints between the old root and the new one are turned round: what carried is carried, about the same axis the other
way, so that angles, limits and the frames of all links stay what they were.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Collection
from pathlib import Path

import numpy as np
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)
from scipy.spatial.transform import Rotation

from mrhubo.robot.document import read_document
from mrhubo.robot.joint import ROTARY, Joint
from mrhubo.robot.mesh_files import find_mesh
from mrhubo.robot.urdf import Description

_MOVES = (*ROTARY, "prismatic")


def is_carried(link: str, joints: Collection[str], description: Description) -> bool:
    """Whether one of some joints lies between the root and a link."""
    return any(joint.name in joints for joint in description.joints_above(link))


def rooted(description: Description, link: str, folder: Path | None = None) -> bytes:
    """The URDF of a robot whose root is a link.

    Args:
        description: the robot.
        link: the root to be.
        folder: where the text will lie, from which its meshes are then named; None: where the file lies.
    """
    robot = read_document(description.path, description.text).robot
    elements = {str(joint.get("name")): joint for joint in robot.findall("joint")}
    for joint in elements.values():
        if joint.get("type") not in _MOVES:
            joint.set("type", "fixed")  # what floats is placed in the world below a root, and this is none any more
    names = {*description.links, *elements}
    for joint in description.joints_above(link):
        _turn_round(robot, elements[joint.name], joint, names)
    for mesh in robot.iter("mesh") if folder is not None else ():
        if (found := find_mesh(str(mesh.get("filename")), description.path)) is not None:
            mesh.set("filename", os.path.relpath(found, folder))
    return etree.tostring(robot)


def _turn_round(robot: etree._Element, element: etree._Element, joint: Joint, names: set[str]) -> None:
    """A joint whose child carries its parent.

    Of the pose of the child in the parent, origin @ turn(axis, q), that of the parent in the child is
    turn(-axis, q) @ origin^-1: the joint first, and then what is fixed to it.
    """
    for tag in ("origin", "parent", "child", "axis"):
        for old in element.findall(tag):
            element.remove(old)
    back_44 = np.linalg.inv(joint.origin_44)
    if joint.kind not in _MOVES:
        _connect(element, joint.child, joint.parent, back_44)
        return
    turned, place = (_unused(f"{joint.name}_{word}", names) for word in ("turned", "place"))
    etree.SubElement(robot, "link", name=turned)
    _connect(element, joint.child, turned, np.eye(4))
    etree.SubElement(element, "axis", xyz=_numbers(-joint.axis_3))
    _connect(etree.SubElement(robot, "joint", name=place, type="fixed"), turned, joint.parent, back_44)


def _connect(element: etree._Element, parent: str, child: str, origin_44: np.ndarray) -> None:
    etree.SubElement(element, "parent", link=parent)
    etree.SubElement(element, "child", link=child)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of a pitch of 90 degrees, where one of many answers is taken
        rpy = Rotation.from_matrix(origin_44[:3, :3]).as_euler("xyz")
    etree.SubElement(element, "origin", xyz=_numbers(origin_44[:3, 3]), rpy=_numbers(rpy))


def _unused(name: str, names: set[str]) -> str:
    while name in names:
        name += "_"
    names.add(name)
    return name


def _numbers(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)
