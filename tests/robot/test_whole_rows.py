"""Which rows of the table of body parts a robot has: with a pelvis, and as it ever was, without."""

from __future__ import annotations

from pathlib import Path

from mrhubo.config import load_config
from mrhubo.robot import read_keypoints
from mrhubo.robot.keypoints import entry_names
from mrhubo.robot.parts import PARTS, UPPER_BODY, OrientedPart


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
