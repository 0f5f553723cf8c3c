"""Soles are where shapes, entries, or at last the links' origins have them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrhubo.config import load_config
from mrhubo.errors import InputWarning, UserError
from mrhubo.reference.standing import Legs
from mrhubo.robot import BodyMap, build_body_map, read_keypoints
from mrhubo.robot.soles import find_soles
from tests.reference.walkers import SOLE, entries, walker

ENTRY = {"link": "l_foot", "forward": [1, 0, 0], "up": [0, 0, 1]}


def test_a_box_tells_its_own_corners(tmp_path: Path) -> None:
    back, ahead, down = SOLE
    for sole in find_soles(walker(tmp_path)):
        np.testing.assert_allclose(sole.rear_3, [-back, 0, -down], atol=1e-9)
        np.testing.assert_allclose(sole.front_3, [ahead, 0, -down], atol=1e-9)
        assert sole.known and len(sole.balls_K4) == 4 and (sole.balls_K4[:, 3] == 0).all()


def test_an_entry_overrides_and_origins_are_the_last_resort(tmp_path: Path) -> None:
    told = find_soles(walker(tmp_path, left_foot={**ENTRY, "sole": [0.01, 0.2, 0.09]}))[0]
    np.testing.assert_allclose([told.rear_3, told.front_3], [[-0.01, 0, -0.09], [0.2, 0, -0.09]], atol=1e-9)
    (tmp_path / "walker_pelvis.urdf").unlink()
    body_map = walker(tmp_path)
    text = body_map.robot.urdf.read_text()
    bare = text[: text.index("<collision>")] + text[text.index("</collision>") + len("</collision>") :]
    body_map.robot.urdf.write_text(bare)
    again = BodyMap.of(type(body_map.robot)(body_map.robot.urdf, body_map.robot.joint_names, body_map.keypoints.links),
                       body_map.keypoints)  # fmt: skip
    left, right = find_soles(again)
    assert not left.known and right.known
    np.testing.assert_allclose(left.balls_K4, [[0, 0, 0, 0]])
    with pytest.warns(InputWarning, match=r"left_foot: no shape of 'l_foot' tells .* sole: \[0.05, 0.12, 0.035\]"):
        Legs(again)


@pytest.mark.parametrize("name", ["nao", "coman"])
def test_shipped_soles_mirror_and_lie_under_the_ankle(root: Path, name: str) -> None:
    body_map = build_body_map(load_config(root / "conf" / f"{name}-whole-body.yaml").robot)
    left, right = find_soles(body_map)
    down = {"nao": 0.0451, "coman": 0.09}[name]
    for one, other in ((left.rear_3, right.rear_3), (left.front_3, right.front_3)):
        np.testing.assert_allclose(one * [1, -1, 1], other, atol=2e-3)
        assert one[2] == pytest.approx(-down, abs=1e-4)
    assert left.rear_3[0] < 0 < left.front_3[0] and left.front_3[0] > -left.rear_3[0]


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"sole": [0.1, 0.1]}, r"left_foot.*three numbers"),
        ({"sole": [-0.1, 0.1, 0]}, r"left_foot.sole: is how far the sole reaches .* found \[-0.1, 0.1, 0.0\]"),
        ({"sole": [50, 120, 35]}, r"left_foot.sole: .* in metres"),
    ],
)
def test_a_wrong_sole_is_named(entry: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        read_keypoints({**entries(), "left_foot": {**ENTRY, **entry}})


def test_only_feet_have_soles() -> None:
    with pytest.raises(UserError, match="robot.keypoints.chest: has no 'sole'"):
        read_keypoints({**entries(), "chest": {"link": "chest", "sole": [0.1, 0.1, 0.1]}})
    one, other = ({**entries(), "left_foot": {**ENTRY, "sole": [0.1, 0.1, z]}} for z in (0.03, 0.04))
    assert read_keypoints(one).differences(read_keypoints(other)) == ["left_foot"]
