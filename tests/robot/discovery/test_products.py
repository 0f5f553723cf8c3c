"""Arms that are one product, bought twice or four times: no mirror images, and neither are their zero poses."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from mrhubo.errors import UserError
from tests.robot.discovery.made import SIDES, Made, X, Y, Z, about


def test_arms_that_are_turned_and_not_mirrored_do_not_turn_the_chest(tmp_path: Path) -> None:
    """Each arm leans by 4 degrees towards its own front, so the left one forward and the right one back."""
    made = Made()
    for side, sign in SIDES.items():
        mount = made.join(
            f"{side}_base", "chest", (0, 0.2 * sign, 0.4), X, (-3.1, 3.1), rpy=(0.07, 0, sign * math.pi / 2)
        )
        link = made.join(f"{side}_swing", mount, (0, 0, 0), Y)
        link = made.join(f"{side}_twist", link, (0, 0, -0.1), Z)
        link = made.join(f"{side}_elbow", link, (0, 0, -0.2), X, (-2.4, 0.0))
        made.wrist(side, made.join(f"{side}_forearm", link, (0, 0, -0.1), Z))
    found = made.found(tmp_path)
    assert abs(found.forward.root_3[1]) < 1e-3


def table_arm(made: Made, name: str, at: tuple[float, float, float]) -> None:
    """An arm of six joints that stands on a table and reaches forward, as ViperX does; no twist of its upper arm."""
    link = made.join(f"{name}_waist", "chest", at, Z, (-3.1, 3.1))
    link = made.join(f"{name}_shoulder", link, (0, 0, 0.05), Y, (-1.8, 1.2))
    link = made.join(f"{name}_elbow", link, (0.06, 0, 0.3), Y, (-1.7, 1.6))
    link = made.join(f"{name}_roll", link, (0.2, 0, 0), X, (-3.1, 3.1))
    link = made.join(f"{name}_bend", link, (0.1, 0, 0), Y, (-1.8, 2.2))
    made.join(f"{name}_rotate", link, (0.07, 0, 0), X, (-3.1, 3.1))


def test_of_two_pairs_of_arms_on_a_table_the_front_one_is_taken_and_asked_about(tmp_path: Path) -> None:
    """As of Mobile ALOHA, whose rear pair somebody leads by hand."""
    made = Made()
    for side, sign in SIDES.items():
        table_arm(made, f"rear_{side}", (-0.5, 0.3 * sign, 0.4))
        table_arm(made, f"front_{side}", (0.2, 0.3 * sign, 0.4))
        made.join(f"{side}_wheel", "chest", (0, 0.2 * sign, -0.4), Y, None, "continuous")
    found = made.found(tmp_path)
    assert found.chains["left_arm"][0] == "front_left_waist_joint"
    assert (found.up.root_3, found.forward.root_3) == ((0, 0, 1), (1, 0, 0))
    assert "chest" in about(found) and "pelvis" not in about(found)


def test_a_robot_with_four_legs_is_refused(tmp_path: Path) -> None:
    made = Made()
    for side, sign in SIDES.items():
        for end, ahead in (("front", 0.3), ("rear", -0.3)):
            link = made.join(f"{end}_{side}_roll", "chest", (ahead, 0.1 * sign, 0), X)
            link = made.join(f"{end}_{side}_pitch", link, (0, 0.05 * sign, 0), Y)
            link = made.join(f"{end}_{side}_knee", link, (0, 0, -0.3), Y, (-2.0, -0.5))
            made.join(f"{end}_{side}_foot", link, (0, 0, -0.3), Z, None, "fixed")
    with pytest.raises(UserError, match="four-legged"):
        made.found(tmp_path)
