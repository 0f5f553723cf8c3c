"""The joints of a robot as an indented tree: what a person needs to see who writes a config by hand.

Positions and axes are in the frame of the root link, with every joint at 0: the joint's own frame tells nothing until
all turns above it are multiplied.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrhubo.errors import printable, shortened
from mrhubo.robot import link_poses
from mrhubo.robot.joint import Joint
from mrhubo.robot.urdf import Description

_DEEPEST = 30
"""Levels that are indented; deeper ones (cables, chains of markers) stand below each other."""
_COLUMNS = ("joint", "kind", "axis", "position [m]", "limits", "parent -> child")


def tree_text(description: Description, source: str | None = None) -> str:
    """The tree, a joint a line: kind, axis, position, limits, and the links above and below it.

    `source` is what the user calls the file, where it is another than that of the description.
    """
    rows = [_COLUMNS, *(_row(description, joint, depth, poses) for joint, depth, poses in _walk(description))]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_COLUMNS) - 1)]
    turning = sum(joint.rotary for joint in description.joints.values())
    counts = f"{len(description.links)} links, {len(description.joints)} joints, {turning} of which turn"
    lines = [
        f"{source or description.path}: {counts}",
        f"root link '{printable(description.root)}'; axes and positions are in its frame, with every joint at 0",
        "",
    ]
    for row in rows:
        cells = [cell.ljust(width) for cell, width in zip(row, widths, strict=False)]
        lines.append("  ".join([*cells, row[-1]]).rstrip())
    return "\n".join(lines)


def _walk(description: Description) -> Iterator[tuple[Joint, int, dict[str, np.ndarray]]]:
    """Every joint after the one above it, with its depth, and the poses (4, 4) of links."""
    poses = link_poses(description.parsed, {})
    below = description.joints_below
    waiting = [(joint, 0) for joint in reversed(below.get(description.root, []))]
    while waiting:
        joint, depth = waiting.pop()
        yield joint, depth, poses
        waiting += [(other, depth + 1) for other in reversed(below.get(joint.child, []))]


def _row(description: Description, joint: Joint, depth: int, poses: dict[str, np.ndarray]) -> tuple[str, ...]:
    name = "  " * min(depth, _DEEPEST) + shortened(joint.name, 60)
    links = f"{shortened(joint.parent, 60)} -> {shortened(joint.child, 60)}"
    if (fault := description.faults.get(joint.name)) is not None:
        return name, joint.kind, "", "", "", f"{links}  (cannot be used: {printable(fault)})"
    pose_44 = poses.get(joint.child)
    if pose_44 is None:
        return name, joint.kind, "", "", "", f"{links}  (has no place: a joint above it cannot be used)"
    axis = "" if joint.kind == "fixed" else _numbers(pose_44[:3, :3] @ joint.axis_3)
    return name, joint.kind, axis, _numbers(pose_44[:3, 3]), _limits(joint), links + _mimic(joint)


def _numbers(vector_3: np.ndarray) -> str:
    return " ".join(f"{number + 0.0:6.3f}" for number in np.round(vector_3, 3))


def _limits(joint: Joint) -> str:
    if joint.kind == "fixed":
        return ""
    if joint.kind == "continuous" or joint.lower is None or joint.upper is None:
        return "none"
    unit = "rad" if joint.rotary else "m"
    return f"{joint.lower:.5g} .. {joint.upper:.5g} {unit}"


def _mimic(joint: Joint) -> str:
    if joint.mimic is None:
        return ""
    mimic = joint.mimic
    return f"  (follows {shortened(mimic.joint, 60)}: times {mimic.multiplier:.4g}, plus {mimic.offset:.4g})"
