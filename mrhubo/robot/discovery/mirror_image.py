"""A robot with the arm that it lacks: the mirror image of the one that it has, so that it is read as one with two.

Each link of the image stands as the reflected one, with its own frame reflected in its xz plane, so that it is a
right-handed frame again.
"""

from __future__ import annotations

import copy
import re
import warnings
from collections.abc import Collection

import numpy as np
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)
from scipy.spatial.transform import Rotation

from mrhubo.robot.discovery.lines import reflection
from mrhubo.robot.tree import read_tree
from mrhubo.robot.urdf import Description, describe_text

_OTHER = {"left": "right", "right": "left", "l": "r", "r": "l"}
_SIDE = re.compile(
    r"[Ll]eft|[Rr]ight|LEFT|RIGHT|(?<![A-Za-z])[lrLR](?![A-Za-z])|^[lrLR](?=[A-Z])|(?<=[a-z])[LR](?=[A-Z_]|$)"
)
_FLIP_44 = np.diag([1.0, -1.0, 1.0, 1.0])
"""A frame's own reflection."""


def with_mirror_image(
    description: Description, joint: str, parent_44: np.ndarray, normal_3: np.ndarray, middle_3: np.ndarray
) -> tuple[Description, dict[str, str]]:
    """The robot with a second arm, and the image of each of the arm's joints and links by name.

    Args:
        description: the robot.
        joint: the arm's first joint.
        parent_44: pose of the link that carries it, in the root's frame.
        normal_3: across the mirror plane, unit, in the root's frame.
        middle_3: a point of that plane.
    """
    robot = read_tree(description.path, description.text).robot
    links = _below(description, description.joints[joint].child)
    names = {
        *(element.get("name") for element in robot.findall("link")),
        *(element.get("name") for element in robot.findall("joint")),
    }
    images: dict[str, str] = {}
    inside = [j for j in robot.findall("joint") if j.find("child").get("link") in links]
    for name in (*links, *(str(element.get("name")) for element in inside)):
        if name not in images:
            images[name] = _other_name(name, names | set(images.values()))
    for element in [link for link in robot.findall("link") if link.get("name") in links]:
        robot.append(_image_of_link(element, images))
    mirror_44 = np.eye(4)
    mirror_44[:3, :3] = reflection(normal_3)
    mirror_44[:3, 3] = 2 * float(normal_3 @ middle_3) * normal_3
    for element in inside:
        image = _image_of_joint(element, images)
        if element.get("name") == joint:
            first_44 = description.joints[joint].origin_44
            _place(image, np.linalg.inv(parent_44) @ mirror_44 @ parent_44 @ first_44 @ _FLIP_44)
        robot.append(image)
    return describe_text(description.path, etree.tostring(robot)), images


def _below(description: Description, link: str) -> list[str]:
    """A link and all that hang on it."""
    found = [link]
    for name in found:
        found += [joint.child for joint in description.joints.values() if joint.parent == name]
    return found


def _image_of_link(link: etree._Element, images: dict[str, str]) -> etree._Element:
    image = copy.deepcopy(link)
    image.set("name", images[str(link.get("name"))])
    for origin in image.iter("origin"):
        _reflect(origin)
    return image


def _image_of_joint(joint: etree._Element, images: dict[str, str]) -> etree._Element:
    image = copy.deepcopy(joint)
    image.set("name", images[str(joint.get("name"))])
    for end in ("parent", "child"):
        element = image.find(end)
        element.set("link", images.get(str(element.get("link")), str(element.get("link"))))
    mimic = image.find("mimic")
    if mimic is not None:
        mimic.set("joint", images.get(str(mimic.get("joint")), str(mimic.get("joint"))))
    for origin in image.findall("origin"):
        _reflect(origin)
    axis = image.find("axis")
    x, y, z = _numbers(axis, "xyz", "1 0 0")
    # A turn is an axial vector: mirrored, it turns the other way about the mirrored axis. A slide is none.
    sign = 1.0 if joint.get("type") == "prismatic" else -1.0
    if axis is None:
        axis = etree.SubElement(image, "axis")
    axis.set("xyz", _text((sign * x, -sign * y, sign * z)))
    return image


def _reflect(origin: etree._Element) -> None:
    x, y, z = _numbers(origin, "xyz")
    roll, pitch, yaw = _numbers(origin, "rpy")
    origin.set("xyz", _text((x, -y, z)))
    origin.set("rpy", _text((-roll, pitch, -yaw)))


def _place(joint: etree._Element, pose_44: np.ndarray) -> None:
    for origin in joint.findall("origin"):
        joint.remove(origin)
    with warnings.catch_warnings(action="ignore"):  # where pitch is a right angle, any of the angles will do
        rpy = Rotation.from_matrix(pose_44[:3, :3]).as_euler("xyz")
    etree.SubElement(joint, "origin", xyz=_text(pose_44[:3, 3]), rpy=_text(rpy))


def _numbers(element: etree._Element | None, word: str, default: str = "0 0 0") -> list[float]:
    text = default if element is None else element.get(word, default)
    return [float(number) for number in text.split()]


def _text(numbers: Collection[float] | np.ndarray) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def _other_name(name: str, taken: Collection[str]) -> str:
    """A name on the other side, `right_elbow` of `left_elbow`, that nothing has yet; of one without a side, one of no
    side.
    """
    other = _SIDE.sub(lambda found: _cased(found.group()), name, count=1)
    while other in taken:
        other += "~"
    return other


def _cased(word: str) -> str:
    other = _OTHER[word.lower()]
    return other.upper() if word.isupper() else other.capitalize() if word[0].isupper() else other
