"""pytorch-kinematics' kinematic chain: of the joints that matter, and without the plotting library that its import asks
for.

Its package imports `matplotlib.pyplot`, for one picture of its inverse kinematics, which nothing here calls. That is 30
MB and most of a second which a robot's computer has no use for, so matplotlib need not be there, and is not loaded.
"""

from __future__ import annotations

import copy
import dataclasses
import sys
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
import torch
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)
from scipy.spatial.transform import Rotation
from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.robot.joint import Joint
from mrhubo.robot.urdf import Description, moved

if TYPE_CHECKING:
    from pytorch_kinematics.chain import Chain

_DEEPEST = 100
"""Most joints in a row: pytorch-kinematics goes down a tree by recursion."""
_KEPT = 8
"""Chains that are kept for the next robot with the same joints."""


def chain_joints(
    description: Description, links: Sequence[str], turned: Collection[str], rest: Mapping[str, float]
) -> list[Joint]:
    """The joints that place the links: those above them. Where too many are in a row, what rests becomes a part of what
    moves.

    Args:
        description: the robot.
        links: the links whose poses are wanted.
        turned: the joints among them that move.
        rest: angle [rad] or position [m] of the others.

    Raises:
        UserError: too many joints in a row move.
    """
    above = [description.joints_above(link) for link in links]
    if max(map(len, above), default=0) <= _DEEPEST:
        needed = {joint.name for joints in above for joint in joints}
        return [joint for joint in description.joints.values() if joint.name in needed]
    for link, joints in zip(links, above, strict=True):
        count = sum(joint.name in turned for joint in joints)
        if count >= _DEEPEST:
            raise UserError(
                f"{description.path}: {count} joints in a row move the link '{link}'; at most {_DEEPEST - 1} can"
            )
    kept: dict[str, Joint] = {}
    pending = list(links)
    for link in pending:
        if link != description.root and link not in kept:
            kept[link] = _folded(description, link, turned, rest)
            pending.append(kept[link].parent)
    return [kept[joint.child] for joint in description.joints.values() if joint.child in kept]


def _folded(description: Description, link: str, turned: Collection[str], rest: Mapping[str, float]) -> Joint:
    """The joint above a link, placed in the next link above it that moves, or the root."""
    joint = description.parent_joint[link]
    moves = joint.name in turned
    origin_44 = joint.origin_44 if moves else _at_rest(joint, rest)
    parent = joint.parent
    while parent != description.root and description.parent_joint[parent].name not in turned:
        between = description.parent_joint[parent]
        origin_44, parent = _at_rest(between, rest) @ origin_44, between.parent
    kind = joint.kind if moves else "fixed"
    return dataclasses.replace(joint, kind=kind, parent=parent, origin_44=origin_44)


def _at_rest(joint: Joint, rest: Mapping[str, float]) -> np.ndarray:
    if joint.kind == "fixed":
        return joint.origin_44
    return joint.origin_44 @ moved(joint.axis_3, rest[joint.name], joint.kind == "prismatic")


def chain_xml(root: str, joints: Sequence[Joint]) -> bytes:
    """A URDF of these joints alone: pytorch-kinematics trips over much that it does not need."""
    robot = etree.Element("robot", name="chain")
    etree.SubElement(robot, "link", name=root)
    for joint in joints:
        etree.SubElement(robot, "link", name=joint.child)
        element = etree.SubElement(robot, "joint", name=joint.name, type=joint.kind)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of a pitch of 90 degrees, where one of many answers is taken
            rpy = Rotation.from_matrix(joint.origin_44[:3, :3]).as_euler("xyz")
        etree.SubElement(element, "origin", xyz=_numbers(joint.origin_44[:3, 3]), rpy=_numbers(rpy))
        etree.SubElement(element, "parent", link=joint.parent)
        etree.SubElement(element, "child", link=joint.child)
        etree.SubElement(element, "axis", xyz=_numbers(joint.axis_3))
        etree.SubElement(element, "limit", lower="-1000", upper="1000", effort="1", velocity="1")
    return etree.tostring(robot)


def _numbers(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)


@lru_cache(maxsize=_KEPT)
def build_chain(xml: bytes) -> Chain:
    """The chain of a URDF's joints and links, in float32; who wants another one changes a copy (`chain_like`)."""
    with _without_matplotlib():
        import pytorch_kinematics

    return pytorch_kinematics.build_chain_from_urdf(xml).to(dtype=torch.float32)


def chain_like(chain: Chain, like: Tensor) -> Chain:
    """The same chain with a tensor's type and device; pytorch-kinematics would change the chain itself."""
    if chain.dtype == like.dtype and torch.device(chain.device) == like.device:
        return chain
    return copy.deepcopy(chain).to(dtype=like.dtype, device=like.device)


@contextmanager
def _without_matplotlib() -> Iterator[None]:
    """Empty modules in its place while something is imported, unless it has been imported already."""
    if "matplotlib" in sys.modules or "pytorch_kinematics" in sys.modules:
        yield
        return
    names = ("matplotlib", "matplotlib.pyplot", "matplotlib.cm")
    top, pyplot, cm = (ModuleType(name) for name in names)
    top.__dict__.update(pyplot=pyplot, cm=cm)
    sys.modules.update(zip(names, (top, pyplot, cm), strict=True))
    try:
        yield
    finally:
        for name in names:
            del sys.modules[name]
