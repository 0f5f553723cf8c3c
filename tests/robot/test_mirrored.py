"""Entries of one side against those of the other."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from mrhubo.config import RobotConfig
from mrhubo.errors import InputWarning
from mrhubo.robot import build_body_map
from tests.robot.more_robots import more_robot
from tests.robot.two_arms import joint_of

Pair = Callable[..., RobotConfig]


@pytest.mark.parametrize(
    ("keypoints", "entry"),
    [
        (
            {"left_wrist": {"link": "l_lower", "offset": [0, 0.03, -0.22]}, "right_wrist": {"link": "r_lower", "offset": [0, 0.03, -0.22]}},
            r"right_wrist: is no mirror image of 'left_wrist' \(60 mm.*write right_wrist: {link: r_lower, offset: \[0, -0.03, -0.22\]}",
        ),
        (
            {"left_hand": {"link": "l_hand", "fingers": [0, 0, -1], "thumb": [0, -1, 0]},
             "right_hand": {"link": "r_hand", "fingers": [0, 0, -1], "thumb": [0, -1, 0]}},
            r"right_hand: is no mirror image of 'left_hand' \(180 degrees.*right_hand: {link: r_hand, fingers: \[0, 0, -1\], thumb: \[0, 1, 0\]}",
        ),
    ],
)  # fmt: skip
def test_what_does_not_mirror_is_told(pair: Pair, keypoints: dict[str, Any], entry: str) -> None:
    with pytest.warns(InputWarning, match=entry):
        build_body_map(pair(keypoints=keypoints))


def test_arms_that_do_not_mirror_need_not(pair: Pair, recwarn: pytest.WarningsRecorder) -> None:
    shorter = (joint_of("r_wrist"), joint_of("r_wrist").replace("-0.22", "-0.15"))
    lower = (joint_of("r_yaw"), joint_of("r_yaw").replace("-0.25", "-0.2"))
    build_body_map(pair(shorter, lower))
    assert not [str(warning.message) for warning in recwarn.list]


def test_a_real_robot(recwarn: pytest.WarningsRecorder) -> None:
    thumbs = {f"{side}_hand": {"link": f"{side}_wrist_yaw_link", "fingers": [1, 0, 0], "thumb": [0, -1, 0]}
              for side in ("left", "right")}  # fmt: skip
    build_body_map(more_robot("g1", keypoints=thumbs))
    assert any("right_hand: is no mirror image" in str(warning.message) for warning in recwarn.list)
