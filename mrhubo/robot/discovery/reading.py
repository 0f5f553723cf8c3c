"""From a URDF to bodies and hinges: joints that move nothing are taken for fixed ones."""

from __future__ import annotations

import numpy as np

from mrhubo.errors import UserError
from mrhubo.robot.discovery.bodies import Bodies, Hinge
from mrhubo.robot.discovery.lines import Line
from mrhubo.robot.joint import ROTARY, drive
from mrhubo.robot.urdf import Description


def read_bodies(description: Description) -> Bodies:
    """The bodies of a robot. Joints whose numbers cannot be used are taken as fixed where they stand."""
    below: dict[str, list[str]] = {}
    for joint in description.joints.values():
        below.setdefault(joint.parent, []).append(joint.name)
    pose_44, body_of, order = {description.root: np.eye(4)}, {description.root: 0}, [description.root]
    hinges: list[Hinge] = []
    sources = _sources(description)
    for link in order:
        for name in below.get(link, []):
            joint = description.joints[name]
            child_44 = pose_44[link] @ joint.origin_44
            pose_44[joint.child] = child_44
            order.append(joint.child)
            if (
                joint.kind not in (*ROTARY, "prismatic")
                or name in description.faults
                or _stuck(joint.lower, joint.upper)
            ):
                body_of[joint.child] = body_of[link]
                continue
            body_of[joint.child] = max(body_of.values()) + 1
            line = Line(child_44[:3, 3], child_44[:3, :3] @ joint.axis_3)
            hinges.append(Hinge(
                name, line, joint.rotary, (body_of[link], body_of[joint.child]), joint.lower, joint.upper,
                joint.mimic is None, name in sources, (link, joint.child),
            ))  # fmt: skip
    return Bodies(description, pose_44, body_of, tuple(hinges))


def _stuck(lower: float | None, upper: float | None) -> bool:
    """Whether limits leave a joint no way to move."""
    return lower is not None and upper is not None and upper - lower < 1e-3


def _sources(description: Description) -> set[str]:
    found = set()
    for joint in description.joints.values():
        if joint.mimic is not None:
            try:
                found.add(drive(description.joints, joint.name).joint)
            except UserError:  # told where it matters
                continue
    return found
