"""The capsules that stand for each link's collision shapes, as many as can be compared."""

from __future__ import annotations

import warnings

from mrhubo.errors import InputWarning
from mrhubo.robot.capsules import Capsule, capsules
from mrhubo.robot.driven_bodies import DrivenBodies
from mrhubo.robot.model import Robot

_MOST = 2_000
"""Most capsules."""


def link_capsules(robot: Robot, bodies: DrivenBodies) -> dict[str, list[Capsule]]:
    """Capsules by link, each in the frame of the link that stands for all that move with it.

    Args:
        robot: its URDF tells the shapes.
        bodies: of the robot.
    """
    found: dict[str, list[Capsule]] = {}
    for shape in robot.description.solids.shapes:
        pose_44 = bodies.inside(shape.link) @ shape.origin_44
        found.setdefault(shape.link, []).extend(capsules(shape, pose_44))
    _leave_out(found, robot)
    return found


def _leave_out(found: dict[str, list[Capsule]], robot: Robot) -> None:
    """Takes away the capsules of the links with most, until there are few enough."""
    count = sum(map(len, found.values()))
    left_out = []
    for link in sorted(found, key=lambda link: len(found[link]), reverse=True):
        if sum(map(len, found.values())) > _MOST:
            left_out.append(link)
            del found[link]
    if left_out:
        warnings.warn(
            f"robot.urdf: {robot.urdf}: has {count:,} collision shapes, more than {_MOST:,}; those of "
            f"{', '.join(left_out)} are not looked at",
            InputWarning,
            stacklevel=2,
        )
