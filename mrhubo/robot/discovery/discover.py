"""From a URDF to what its links mean."""

from __future__ import annotations

from pathlib import Path

from mrhubo.robot.discovery.result import Discovery
from mrhubo.robot.urdf import Description


def discover(robot: Description | Path | str) -> Discovery:
    """Which link and point of a robot stands for which part of a human body.

    Args:
        robot: a URDF file, or what `mrhubo.robot.urdf.describe` made of it.

    Raises:
        UserError: the file is no robot (as `describe`), or it has no two arms that could be told; says what it has.
    """
    raise NotImplementedError("the interface stands, the detection follows")
