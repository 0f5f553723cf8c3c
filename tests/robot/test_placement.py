"""Left on the left, up at the top: a chest's frame, arms and axes against a human's."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import pytest
import torch

from mrhubo.config import RobotConfig
from mrhubo.errors import InputWarning, UserError
from mrhubo.robot import build_body_map
from tests.robot.two_arms import KEYPOINTS, joint_of

Pair = Callable[..., RobotConfig]
ONE_ARM = {f"right_{point}": None for point in ("shoulder", "elbow", "wrist")}
LEFT = ["l_pitch", "l_roll", "l_yaw", "l_elbow"]


def swapped(*points: str) -> dict[str, Any]:
    found = dict(KEYPOINTS)
    for point in points:
        left, right = f"left_{point}", f"right_{point}"
        found[left], found[right] = KEYPOINTS[right], KEYPOINTS[left]
    return found


def test_arms_on_the_wrong_sides_are_refused(pair: Pair) -> None:
    with pytest.raises(
        UserError,
        match=r"robot.keypoints.chest: the line from 'right_shoulder' .* 180 degrees .*exchanged: write left_shoulder: l_upper",
    ):
        build_body_map(pair(keypoints=swapped("shoulder", "elbow", "wrist")))


@pytest.mark.parametrize("turn", [1.2, 1.9, 3.14159])
def test_a_chest_that_does_not_look_forward(pair: Pair, turn: float) -> None:
    """The base is turned; the chest, fixed on it, is right, and the base as the chest is not."""
    waist = joint_of("waist")
    edit = (waist, waist.replace('xyz="0 0 0.5"', f'xyz="0 0 0.5" rpy="0 0 {turn}"'))
    build_body_map(pair(edit))
    expected = pytest.raises(UserError, match=r"away from a human's, seen from 'base'") if turn > 1.6 else pytest.warns(
        InputWarning, match=r"69 degrees away from a human's"
    )  # fmt: skip
    with expected:
        build_body_map(pair(edit, keypoints={"chest": "base"}))
    cosine, sine = torch.tensor(turn).cos().item(), torch.tensor(turn).sin().item()
    told = {"link": "base", "forward": [cosine, sine, 0], "up": [0, 0, 1]}
    build_body_map(pair(edit, keypoints={"chest": told}))


AXES = [[sign if i == k else 0 for k in range(3)] for i in range(3) for sign in (1, -1)]
FRAMES = [(f, u) for f, u in itertools.product(AXES, AXES) if not any(a * b for a, b in zip(f, u, strict=True))]


@pytest.mark.parametrize(("forward", "up"), FRAMES)
def test_of_all_upright_frames_one_is_silent(
    pair: Pair, forward: list[int], up: list[int], recwarn: pytest.WarningsRecorder
) -> None:
    """Nothing but the chest's entry differs; 23 of 24 are wrong."""
    config = pair(keypoints={"chest": {"link": "chest", "forward": forward, "up": up}})
    try:
        build_body_map(config)
        said = [str(warning.message) for warning in recwarn.list]
    except UserError as error:
        said = [str(error)]
    right = (forward, up) == ([1, 0, 0], [0, 0, 1])
    assert not said if right else len(said) == 1 and said[0].startswith("robot.keypoints.chest: ")


def test_one_arm_on_the_wrong_side_is_warned_of(pair: Pair, recwarn: pytest.WarningsRecorder) -> None:
    left = {f"left_{p}": KEYPOINTS[f"left_{p}"] for p in ("shoulder", "elbow", "wrist")}
    build_body_map(pair(keypoints={**ONE_ARM, **left}, joints=LEFT))
    assert not recwarn.list
    as_right = {name.replace("left", "right"): link for name, link in left.items()}
    with pytest.warns(InputWarning, match=r"robot.keypoints.right_shoulder: lies on the left of 'chest'"):
        build_body_map(pair(keypoints={**dict.fromkeys(left), **as_right}, joints=LEFT))


@pytest.mark.parametrize(
    ("name", "entry", "word"),
    [
        ("left_hand", {"link": "l_hand", "fingers": [0, 0, 1], "thumb": [1, 0, 0]}, "fingers"),
        ("head", {"link": "head", "forward": [-1, 0, 0]}, "forward"),
        ("head", {"link": "head", "up": [0, 0, -1]}, "up"),
    ],
)
def test_an_axis_that_points_the_other_way_is_warned_of(
    pair: Pair, name: str, entry: dict[str, Any], word: str
) -> None:
    joints = [*LEFT, "r_pitch", "r_roll", "r_yaw", "r_elbow", *(["neck"] if name == "head" else [])]
    with pytest.warns(InputWarning, match=rf"robot.keypoints.{name}: '{word}' points the other way than a human's"):
        build_body_map(pair(keypoints={name: entry}, joints=joints))


def test_a_head_that_turns_all_the_way_round_is_silent(pair: Pair, recwarn: pytest.WarningsRecorder) -> None:
    wide = (joint_of("neck"), joint_of("neck").replace('lower="-1.5" upper="1.5"', 'lower="-3.1" upper="3.1"'))
    joints = [*LEFT, "r_pitch", "r_roll", "r_yaw", "r_elbow", "neck"]
    build_body_map(pair(wide, keypoints={"head": "head"}, joints=joints))
    assert not recwarn.list
