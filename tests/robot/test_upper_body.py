"""A robot with legs is refused where only arms and a head can be answered; one without is as it ever was."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.fitting.preparation import prepare_pairs
from mrhubo.robot import read_keypoints
from mrhubo.robot.keypoints import entry_names
from mrhubo.robot.parts import PARTS, UPPER_BODY, OrientedPart
from mrhubo.robot.upper_body import check_upper_body


def test_legs_are_refused_and_named(root: Path) -> None:
    config = load_config(root / "conf" / "nao-whole-body.yaml")
    with pytest.raises(
        UserError, match=r"line 12: robot.keypoints.pelvis: .* not of pelvis, left_hip, .*retarget --robot"
    ):
        prepare_pairs(config)
    check_upper_body(load_config(root / "conf" / "nao.yaml").robot)


def test_a_robot_without_a_pelvis_has_the_upper_bodys_rows(root: Path) -> None:
    found = read_keypoints(load_config(root / "conf" / "reachy.yaml").robot.keypoints)
    assert found.parts == UPPER_BODY
    assert UPPER_BODY[0].direction_names == () and set(entry_names(UPPER_BODY)) < set(entry_names())


def test_a_chest_has_directions_where_something_can_turn_it(root: Path) -> None:
    waist = read_keypoints(load_config(root / "conf" / "coman-whole-body.yaml").robot.keypoints)
    none = read_keypoints(load_config(root / "conf" / "nao-whole-body.yaml").robot.keypoints)
    assert {part.name for part in waist.parts if isinstance(part, OrientedPart) and not part.seen_from} == {"pelvis"}
    assert {part.name for part in none.parts if isinstance(part, OrientedPart) and not part.seen_from} == {
        "pelvis",
        "chest",
    }
    assert set(waist.parts) <= set(PARTS)
    assert [d.name for d in waist.directions if d.part.region == "trunk"] == ["chest_forward", "chest_up"]
