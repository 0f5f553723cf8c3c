"""A robot written in another way that is the same robot: other names, another order, axes negated, another base.

Config and URDF are rewritten as files, as a user would bring them.
"""

from __future__ import annotations

import copy
import random
import string
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch
import yaml
from lxml import etree
from torch import Tensor

KINDS = ("names", "order", "signs", "base")
"""The kinds of changes."""


@dataclass(frozen=True)
class Change:
    """What is written otherwise. The empty change changes nothing."""

    links: Mapping[str, str] = field(default_factory=dict)
    """New names of links."""
    joints: Mapping[str, str] = field(default_factory=dict)
    """New names of joints."""
    order: Sequence[int] | None = None
    """The new list of `robot.joints`, as positions in the old one."""
    negated: frozenset[str] = frozenset()
    """Joints (by their old names) whose axis points the other way, so that their angle has the other sign."""
    base: tuple[str, str] | None = None
    """xyz [m] and rpy [rad] of the old root link in a new one."""
    shuffle: int | None = None
    """Seed of another order of the elements in the file."""


def draw_change(config: Path, seed: int, *kinds: str) -> Change:
    """A random change of the given `KINDS`."""
    draw = random.Random(seed)
    settings, robot = read(config)
    joints = settings["robot"]["joints"]
    change: dict[str, Any] = {}
    if "names" in kinds:
        for kind, tag in (("links", "link"), ("joints", "joint")):
            old = [element.get("name") for element in robot.findall(tag)]
            new = ["".join(draw.choices(string.ascii_letters, k=8)) + f"_{i}" for i in range(len(old))]
            draw.shuffle(new)
            change[kind] = dict(zip(old, new, strict=True))
    if "order" in kinds:
        change["order"] = draw.sample(range(len(joints)), len(joints))
        change["shuffle"] = draw.randrange(1000)
    if "signs" in kinds:
        turning = [e.get("name") for e in robot.findall("joint") if e.get("type") in ("revolute", "continuous")]
        change["negated"] = frozenset(name for name in turning if draw.random() < 0.5)
    if "base" in kinds:
        change["base"] = (" ".join(f"{draw.uniform(-1, 1):.3f}" for _ in range(3)),
                          " ".join(f"{draw.uniform(-3, 3):.3f}" for _ in range(3)))  # fmt: skip
    return Change(**change)


def read(config: Path) -> tuple[dict[str, Any], etree._Element]:
    """The settings and the robot's URDF that they name."""
    settings = yaml.safe_load(config.read_text())
    urdf = config.parent / settings["robot"]["urdf"]
    return settings, etree.parse(str(urdf), etree.XMLParser(remove_comments=True)).getroot()


def rewrite(config: Path, change: Change, folder: Path) -> Path:
    """Writes the changed config and URDF into a folder; the config's path."""
    settings, robot = read(config)
    folder.mkdir(parents=True, exist_ok=True)
    for joint in robot.findall("joint"):
        _turn(joint, change)
    _rename(robot, change)
    if change.base is not None:
        _put_on_a_base(robot, *change.base)
    if change.shuffle is not None:
        elements = list(robot)
        random.Random(change.shuffle).shuffle(elements)
        robot[:] = elements
    etree.ElementTree(robot).write(str(folder / "robot.urdf"))
    settings["robot"] = changed_settings(settings["robot"], change)
    settings["robot"]["urdf"] = "robot.urdf"
    (folder / "config.yaml").write_text(yaml.safe_dump(settings, sort_keys=False))
    return folder / "config.yaml"


def changed_settings(robot: Mapping[str, Any], change: Change) -> dict[str, Any]:
    """The `robot` section for the changed URDF."""
    found = copy.deepcopy(dict(robot))
    joints = list(robot["joints"])
    order = range(len(joints)) if change.order is None else change.order
    found["joints"] = [change.joints.get(joints[i], joints[i]) for i in order]

    def link(name: str) -> str:
        return change.links.get(name, name)

    found["key_links"] = [link(name) for name in robot["key_links"]]
    found["keypoints"] = {
        part: {**entry, "link": link(entry["link"])} if isinstance(entry, dict) else link(entry)
        for part, entry in robot["keypoints"].items()
    }
    for key in ("ranges", "hold"):
        entries = {}
        for name, value in (robot.get(key) or {}).items():
            if name in change.negated:
                value = [-value[1], -value[0]] if key == "ranges" else -value
            entries[change.joints.get(name, name)] = value
        if entries:
            found[key] = entries
    return found


def undo(change: Change, joints: Sequence[str], q_TN: Tensor) -> Tensor:
    """Angles (T, N) of the changed robot, as those of the old one, whose joints are given in its config's order."""
    order = list(range(len(joints))) if change.order is None else list(change.order)
    found = torch.empty_like(q_TN)
    found[:, order] = q_TN
    return found * torch.tensor([-1.0 if name in change.negated else 1.0 for name in joints]).to(q_TN)


def _turn(joint: etree._Element, change: Change) -> None:
    """Negates the axis, mirrors the limits, and keeps what mimics in step."""
    own = joint.get("name") in change.negated
    mimic = joint.find("mimic")
    if mimic is not None:
        other = mimic.get("joint") in change.negated
        mimic.set("multiplier", repr(float(mimic.get("multiplier", "1")) * (-1 if own != other else 1)))
        mimic.set("offset", repr(float(mimic.get("offset", "0")) * (-1 if own else 1)))
    if not own:
        return
    axis = joint.find("axis")
    if axis is None:
        axis = etree.SubElement(joint, "axis", xyz="1 0 0")
    axis.set("xyz", " ".join(repr(-float(number)) for number in axis.get("xyz").split()))
    limit = joint.find("limit")
    if limit is not None and limit.get("lower") is not None and limit.get("upper") is not None:
        lower, upper = float(limit.get("lower")), float(limit.get("upper"))
        limit.set("lower", repr(-upper))
        limit.set("upper", repr(-lower))


def _rename(robot: etree._Element, change: Change) -> None:
    for link in robot.findall("link"):
        link.set("name", change.links.get(link.get("name"), link.get("name")))
    for joint in robot.findall("joint"):
        joint.set("name", change.joints.get(joint.get("name"), joint.get("name")))
        for end in ("parent", "child"):
            element = joint.find(end)
            element.set("link", change.links.get(element.get("link"), element.get("link")))
        mimic = joint.find("mimic")
        if mimic is not None:
            mimic.set("joint", change.joints.get(mimic.get("joint"), mimic.get("joint")))


def _put_on_a_base(robot: etree._Element, xyz: str, rpy: str) -> None:
    children = {joint.find("child").get("link") for joint in robot.findall("joint")}
    (root,) = [link.get("name") for link in robot.findall("link") if link.get("name") not in children]
    etree.SubElement(robot, "link", name="another_base")
    joint = etree.SubElement(robot, "joint", name="another_base_joint", type="fixed")
    etree.SubElement(joint, "origin", xyz=xyz, rpy=rpy)
    etree.SubElement(joint, "parent", link="another_base")
    etree.SubElement(joint, "child", link=root)
