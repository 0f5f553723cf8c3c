"""Points beside the joints' centres, and what to write in their place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from mrhubo.config import RobotConfig
from mrhubo.errors import InputWarning
from mrhubo.robot import build_body_map
from tests.robot.more_robots import MORE, more_robot
from tests.robot.two_arms import joint_of

Pair = Callable[..., RobotConfig]


def on(link: str, *offset: float) -> dict[str, Any]:
    return {"link": link, "offset": list(offset)}


@pytest.mark.parametrize(
    ("left_shoulder", "axis"),
    [(on("l_upper", 0.03, 0, 0), "l_pitch"), (on("l_upper", 0, 0, -0.1), "l_(pitch|roll)"),
     (on("chest", 0, 0.2, 0.25), "l_(pitch|roll)"), (on("l_shoulder", 0, 0.1, 0), "l_roll")],
)  # fmt: skip
def test_a_shoulder_beside_its_axes(pair: Pair, left_shoulder: Any, axis: str) -> None:
    message = rf"left_shoulder: is \d+ mm from the axis of '{axis}'.* cross at left_shoulder: l_(upper|shoulder)$"
    with pytest.warns(InputWarning, match=message):
        build_body_map(pair(keypoints={"left_shoulder": left_shoulder}))


@pytest.mark.parametrize(
    ("keypoints", "message"),
    [
        ({"left_elbow": on("l_fore", 0.08, 0, 0)}, r"left_elbow: the left upper arm points 18 degrees beside .* left_elbow: l_(fore|lower)"),
        ({"left_wrist": on("l_lower", 0, 0, 0.22)}, r"left_wrist: the left forearm points 180 degrees beside .* left_wrist: l_hand"),
    ],
)  # fmt: skip
def test_a_limb_that_points_beside_the_line_between_joints(pair: Pair, keypoints: dict[str, Any], message: str) -> None:
    sure = (joint_of("l_wrist"), joint_of("l_wrist").replace("fixed", "revolute").replace(
        "</joint>", '<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'))  # fmt: skip
    right = (joint_of("r_wrist"), joint_of("r_wrist").replace("fixed", "revolute").replace(
        "</joint>", '<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'))  # fmt: skip
    with pytest.warns(InputWarning, match=message):
        build_body_map(pair(sure, right, keypoints=keypoints))


def test_a_clavicle_may_pass_the_shoulder_by(pair: Pair, recwarn: pytest.WarningsRecorder) -> None:
    def lengthened(side: str, y: float) -> tuple[str, str]:
        old = joint_of(f"{side}_pitch")
        clavicle = old.replace(f"{side}_pitch", f"{side}_clavicle").replace("0 1 0", "0 0 1").replace(
            f'child link="{side}_shoulder"', f'child link="{side}_collar"').replace(f"0 {y} 0.3", f"0 {y / 4} 0.3")  # fmt: skip
        new = old.replace('parent link="chest"', f'parent link="{side}_collar"').replace(
            f"0 {y} 0.3", f"0 {0.75 * y} 0"
        )
        return old, f'<link name="{side}_collar"/>{clavicle}{new}'

    names = [f"{s}_{j}" for s in "lr" for j in ("clavicle", "pitch", "roll", "yaw", "elbow")]
    build_body_map(pair(lengthened("l", 0.2), lengthened("r", -0.2), joints=names))
    assert not [str(warning.message) for warning in recwarn.list]


@pytest.mark.parametrize("name", MORE)
def test_mappings_written_with_care_are_silent(name: str, recwarn: pytest.WarningsRecorder) -> None:
    build_body_map(more_robot(name))
    assert not [str(warning.message) for warning in recwarn.list]


@pytest.mark.parametrize(
    ("link", "distance"), [("left_shoulder_pitch_link", r"4\d"), ("left_shoulder_yaw_link", r"1\d\d")]
)
def test_the_link_that_a_name_suggests(link: str, distance: str) -> None:
    message = rf"left_shoulder: is {distance} mm from the axis .*'left_shoulder_(roll|pitch)_joint'.* left_shoulder: {{link: left_shoulder_"
    with pytest.warns(InputWarning, match=message):
        build_body_map(more_robot("g1", keypoints={"left_shoulder": link}))
