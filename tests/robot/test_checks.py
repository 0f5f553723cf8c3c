"""Wrong body maps, none of which may train without a word; and odd ones that must."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import torch
import yaml

from mrhubo.config import RobotConfig, load_config
from mrhubo.errors import InputWarning, UserError
from mrhubo.robot import BodyMap, Robot, build_body_map
from tests.robot.two_arms import KEYPOINTS

Pair = Callable[..., RobotConfig]
SIDES = ("left", "right")
OTHER_SIDE = {f"{side}_{point}": f"{other}_{point}" for side, other in (SIDES, SIDES[::-1])
              for point in ("shoulder", "elbow", "wrist")}  # fmt: skip


def on(link: str, *offset: float) -> dict[str, Any]:
    return {"link": link, "offset": list(offset)}


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"left_elbow": "r_lower"}, r"robot.keypoints.right_elbow: is where 'left_elbow' is, on the link 'r_lower'"),
    ({"left_wrist": on("l_lower", 0, 0, -0.1), "right_wrist": on("l_lower", 0, 0, -0.1)}, r"right_wrist: is where 'left_wrist' is"),
    ({"left_wrist": "r_hand", "right_wrist": "l_hand"},
     r"left_wrist: 'left_elbow' \('l_lower'\) is turned by the joint 'l_elbow', and 'left_wrist' \('r_hand'\) is not: .* apart"),
    ({"left_wrist": on("r_lower", 0, 0, -0.1)}, r"left_wrist: 'left_elbow' .* on different chains"),
    ({"left_elbow": "l_hand", "left_wrist": "l_lower"}, r"'left_elbow' \('l_hand'\) lies below 'left_wrist' \('l_lower'\)"),
    ({"left_shoulder": "l_lower", "left_elbow": "l_upper"}, r"'left_shoulder' \('l_lower'\) lies below 'left_elbow' \('l_upper'\)"),
    ({"left_elbow": on("chest", 0, 0.3, 0)}, r"'left_shoulder' \('l_upper'\) lies below 'left_elbow' \('chest'\)"),
    ({"chest": "l_upper"}, r"robot.keypoints.chest: 'l_upper' is turned by the joint 'l_roll', which does not turn 'right_shoulder'"),
    ({"chest": "l_hand"}, r"robot.keypoints.chest: 'l_hand' is turned by the joint 'l_elbow'"),
    ({"chest": "l_hand", **{f"right_{p}": None for p in ("shoulder", "elbow", "wrist")}}, r"chest: 'l_hand' is turned by the joint 'l_elbow'"),
    ({"left_hand": {"link": "r_hand", "fingers": [0, 0, -1], "thumb": [1, 0, 0]}},
     r"left_hand: 'r_hand' is not turned by the joint 'l_roll', which turns 'left_elbow' .* different chains|'l_elbow'"),
    ({f"{side}_hand": {"link": "l_hand", "fingers": [0, 0, -1], "thumb": [1, 0, 0]} for side in SIDES},
     r"right_hand: is the link 'l_hand', as is 'left_hand'; one link cannot stand for both"),
    ({"left_elbow": "l_shoulder"}, r"lies below|lie on one point"),
    ({"left_wrist": on("l_lower", 0, 0, -220)},
     r"left_wrist: lies 219 m from every link of a robot of 0.98 m; .* millimetres\? Write left_wrist: {link: l_lower, offset: \[0, 0, -0.22\]}"),
]  # fmt: skip


@pytest.mark.parametrize(("keypoints", "message"), WRONG)
def test_what_cannot_be_right_is_refused(pair: Pair, keypoints: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        build_body_map(pair(keypoints=keypoints))


ODD: list[tuple[dict[str, Any], str]] = [
    ({"left_wrist": on("l_lower", 0.01, 0, 0)}, r"left forearm .* is 1 cm long, and what it hangs on 25 cm"),
    ({"left_wrist": on("l_lower", 0, 0, -0.001)}, r"left forearm .* is 0.1 cm long"),
    ({"right_elbow": on("r_upper", 0, 0, -0.05)}, r"right forearm .* long"),
    ({"left_shoulder": "chest"}, r"left upper arm .* is \d+(\.\d)? .. \d+(\.\d)? cm long, as the joints stand"),
    ({"left_shoulder": "base"}, r"left upper arm .* as the joints stand"),
    ({"right_elbow": "r_hand", "right_wrist": None}, r"right upper arm .* as the joints stand"),
    ({"left_wrist": on("l_lower", 0.9, 0, 0)}, r"left_wrist: lies 0.\d* m from every link of a robot of 0.98 m; offsets are in metres"),
    ({"head": "chest"}, r"robot.keypoints.head: is the link 'chest', as is 'chest', against which it never turns"),
]  # fmt: skip


@pytest.mark.parametrize(("keypoints", "message"), ODD)
def test_what_may_be_a_mistake_is_warned_of(pair: Pair, keypoints: dict[str, Any], message: str) -> None:
    with pytest.warns(InputWarning, match=message):
        build_body_map(pair(keypoints=keypoints))


ENTRY = re.compile(r"(\w+): (\{link: [^}]*\}|\w+)")


@pytest.mark.parametrize(
    "keypoints",
    [
        *(keypoints for keypoints, _ in (*WRONG[:10], WRONG[-2], WRONG[-1], *ODD[:7])),
        {"left_shoulder": on("l_upper", 0, 0.05, 0)},
        {"left_elbow": on("l_fore", 0, 0, 0.25)},
        {"chest": {"link": "chest", "forward": [-1, 0, 0]}},
        {name: KEYPOINTS[OTHER_SIDE.get(name, name)] for name in KEYPOINTS},
        {"chest": {"link": "chest", "forward": [-1, 0, 0]}}
        | {name: KEYPOINTS[OTHER_SIDE[name]] for name in KEYPOINTS if name in OTHER_SIDE},
    ],
)
def test_who_pastes_what_is_said_gets_a_right_map(pair: Pair, keypoints: dict[str, Any]) -> None:
    """Every sentence has an entry to paste; of two, the first is taken."""
    entries = {**KEYPOINTS, **{name: entry for name, entry in keypoints.items() if entry is not None}}
    for _ in range(6):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                build_body_map(pair(keypoints=entries))
                said = [str(warning.message) for warning in caught]
            except UserError as error:
                said = [str(error)]
        if not said:
            break
        for sentence in said[:1]:
            after = re.split(r"\b(?:tell:?|[Ww]rite|cross at) ", sentence, maxsplit=1)[-1]
            found = ENTRY.findall(re.split(r"[;,] or ", after)[0])
            pasted = {name: yaml.safe_load(entry) for name, entry in found if name in KEYPOINTS}
            assert pasted, sentence
            entries |= pasted
    assert said == []


RIGHT: list[dict[str, Any]] = [
    {},
    {"left_shoulder": on("chest", 0, 0.2, 0.3)},  # a point of the trunk where the shoulder turns
    {"left_shoulder": "l_shoulder", "left_elbow": "l_fore"},
    {"left_elbow": on("l_upper", 0, 0, -0.25), "left_wrist": on("l_lower", 0, 0, -0.22)},
    {"left_elbow": on("l_hand", 0, 0, 0.22), "left_wrist": on("l_lower", 0, 0, -0.22)},  # below in the tree, not on the arm
    {"left_wrist": on("l_lower", 0, 0, -0.4), "right_wrist": on("r_lower", 0, 0, -0.4)},
    {"left_shoulder": on("l_upper", 0.01, 0, -0.01), "left_elbow": on("l_lower", 0, 0.01, 0)},
    {"chest": "base"},
    {"head": "head"},
    {f"right_{point}": None for point in ("shoulder", "elbow", "wrist")},
    {f"{side}_hand": {"link": f"{side[0]}_hand", "fingers": [0, 0, -1], "thumb": [1, 0, 0]} for side in SIDES},
]  # fmt: skip


@pytest.mark.parametrize("keypoints", RIGHT)
def test_right_maps_are_silent(pair: Pair, keypoints: dict[str, Any], recwarn: pytest.WarningsRecorder) -> None:
    names = [
        f"{s}_{j}" for s in ("lr" if "right_elbow" not in keypoints else "l") for j in ("pitch", "roll", "yaw", "elbow")
    ]
    build_body_map(pair(keypoints=keypoints, joints=[*names, *(["neck"] if "head" in keypoints else [])]))
    assert not [str(warning.message) for warning in recwarn.list]


@pytest.mark.parametrize("name", ["nao", "coman", "reachy"])
def test_shipped_robots_are_silent(root: Path, name: str, recwarn: pytest.WarningsRecorder) -> None:
    build_body_map(load_config(root / "conf" / f"{name}.yaml").robot)
    assert not [str(warning.message) for warning in recwarn.list]


def test_key_links_that_nothing_moves_are_refused(pair: Pair) -> None:
    for links in (["base", "chest"], ["head"], ["l_upper", "r_shoulder"]):  # the last turn where they are
        with pytest.raises(UserError, match=rf"robot.key_links: none of robot.joints moves '{links[0]}'.* always be 0"):
            build_body_map(pair(key_links=links))
    build_body_map(pair(key_links=["chest", "l_hand"]))


def test_a_map_made_in_python_is_checked_too(pair: Pair) -> None:
    config = pair()
    wrong = {**config.keypoints, "left_wrist": "r_hand", "right_wrist": "l_hand"}
    robot = Robot.from_urdf(config.urdf, config.joints, wrong)
    with pytest.raises(UserError, match="different chains"):
        BodyMap.of(robot)


def test_the_main_random_stream_is_not_touched(pair: Pair) -> None:
    torch.manual_seed(3)
    expected = torch.rand(4)
    torch.manual_seed(3)
    build_body_map(pair())
    assert torch.equal(torch.rand(4), expected)
