"""Arms that are one product, bought twice: they are not mirror images, and neither are their zero poses."""

from __future__ import annotations

import math
from pathlib import Path

from tests.robot.discovery.made import SIDES, Made, X, Y, Z


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
