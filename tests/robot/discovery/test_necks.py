"""Necks that stand aside at the zero pose, and eyes that were measured, not drawn."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from mrhubo.robot.discovery import Discovery
from mrhubo.robot.urdf import describe
from tests.robot.discovery.made import SIDES, Made, X, Y, Z, about


def with_neck(folder: Path, aside: float, eyes: float | None = None) -> Discovery:
    """A robot whose head is turned by `aside` [rad] at zero; and with eyes, one higher than the other by `eyes` [m]."""
    made = Made()
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
        made.join(f"{side}_ankle", made.leg(side), (0, 0, -0.4), Y, (-0.8, 0.8))
    link = made.join("one", "chest", (0, 0, 0.5), Z, (-1.2 - aside, 1.2 - aside), rpy=(0, 0, aside))
    link = made.join("two", link, (0, 0, 0.05), Y)
    link = made.join("three", link, (0, 0, 0.02), X)
    for side, sign in SIDES.items() if eyes is not None else ():
        made.join(f"{side}_e", link, (0.05, 0.03 * sign, 0.1 + (eyes or 0.0) * sign), Y, (-0.4, 0.4))
    return made.found(folder)


@pytest.mark.parametrize("aside", [-0.9, 0.4, 1.0])
def test_a_head_that_is_turned_aside_at_zero_keeps_its_joints_and_faces_where_they_are_straight(
    aside: float, tmp_path: Path
) -> None:
    found = with_neck(tmp_path, aside)
    assert found.chains["neck"] == ("one_joint", "two_joint", "three_joint")
    assert "head" in about(found)
    description = describe(tmp_path / "made.urdf")
    pose_33 = np.eye(3)
    for joint in reversed(description.joints_above(found.ends["head"].link)):
        pose_33 = pose_33 @ joint.origin_44[:3, :3]
    forward_3 = pose_33 @ np.array(found.ends["head"].axes["forward"])
    assert forward_3 == pytest.approx([math.cos(aside), math.sin(aside), 0], abs=1e-4)


def test_a_head_that_faces_ahead_is_not_asked_about(tmp_path: Path) -> None:
    assert "head" not in about(with_neck(tmp_path, 0.0))


def test_eyes_that_are_a_millimetre_apart_are_no_neck(tmp_path: Path) -> None:
    assert with_neck(tmp_path, 0.0, eyes=0.0005).chains["neck"] == ("one_joint", "two_joint", "three_joint")
