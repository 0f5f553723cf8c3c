"""Feet and facing of robots whose legs do not stand at the zero pose."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from mrhubo.robot.discovery import Discovery
from tests.robot.discovery.made import SIDES, Made, X, Y, Z, about

SOLE = "<collision><origin xyz='0.04 0 -0.05'/><geometry><box size='0.2 0.1 0.04'/></geometry></collision>"


BALLS = "".join(
    f"<collision><origin xyz='{x} {y} -0.045'/><geometry><sphere radius='0.025'/></geometry></collision>"
    for x in (-0.05, 0.13)
    for y in (-0.03, 0.03)
)


def found_of(
    folder: Path, ankle: float = 0.0, toes_out: float = 0.0, hip: float = 0.0, spread: float = 0.0, sole: str = SOLE
) -> Discovery:
    """A robot whose joints are called 0 where ankles hang by an angle, hips are turned outwards, or legs swung or spread
    [rad].
    """
    made = Made()
    for side, sign in SIDES.items():
        made.wrist(side, made.forearm(side, made.arm(side)))
        turn, out = sign * toes_out, (-0.5 - toes_out, 0.5 - toes_out)
        out = out if sign > 0 else (-out[1], -out[0])
        link = made.join(f"{side}_hip_yaw", "chest", (0, 0.1 * sign, -0.1), Z, out, rpy=(0, 0, turn))
        aside = (-0.5 - sign * spread, 0.5 - sign * spread)
        link = made.join(f"{side}_hip_roll", link, (0, 0, 0), X, aside, rpy=(sign * spread, 0, 0))
        link = made.join(f"{side}_hip_pitch", link, (0, 0, 0), Y, (-1.5 - hip, 0.8 - hip), rpy=(0, hip, 0))
        link = made.join(f"{side}_knee", link, (0, 0, -0.4), Y, (0.0, 2.2))
        limits = (-0.7 - ankle, 0.5 - ankle)
        link = made.join(f"{side}_ankle", link, (0, 0, -0.35), Y, limits, rpy=(0, ankle, 0))
        made.join(f"{side}_ankle_roll", link, (0, 0, 0), X, (-0.4, 0.4), shape=sole)
    return made.found(folder)


def axis(found: Discovery, end: str, word: str) -> list[float]:
    """A direction of a part in its link's frame, which stands as the chest's does where the leg is straight."""
    return list(found.ends[end].axes[word])


@pytest.mark.parametrize("hangs", [-1.5, -0.3, 0.0, 0.3, 1.5])
def test_a_foot_that_hangs_at_zero_has_its_sole_where_the_ankle_can_stand_on_it(hangs: float, tmp_path: Path) -> None:
    """Which side of its box is up was told by the zero pose: of a foot that hangs by a right angle it was the toes'."""
    found = found_of(tmp_path, ankle=hangs)
    for side in SIDES:
        assert axis(found, f"{side}_foot", "up") == pytest.approx([0, 0, 1], abs=1e-6)
        assert axis(found, f"{side}_foot", "forward") == pytest.approx([1, 0, 0], abs=1e-6)


@pytest.mark.parametrize("sole", [SOLE, BALLS], ids=["box", "balls"])
@pytest.mark.parametrize("spread", [0.0, 0.15, 0.3, 0.4])
def test_the_feet_of_spread_legs_are_flat_on_what_is_lowest_of_them(spread: float, sole: str, tmp_path: Path) -> None:
    """Balls, as capsules and meshes are, have no side that is flat: such a foot stood on the outermost of them."""
    found = found_of(tmp_path, spread=spread, sole=sole)
    for side in SIDES:
        assert axis(found, f"{side}_foot", "forward") == pytest.approx([1, 0, 0], abs=1e-6)
        turned = 0.15 < spread or sole == SOLE
        assert not turned or axis(found, f"{side}_foot", "up") == pytest.approx([0, 0, 1], abs=1e-6)
        assert (f"{side}_foot" in about(found)) == (sole == BALLS and spread > 0.2)


def test_the_soles_of_spread_legs_are_tilted_as_their_shapes_lie(tmp_path: Path) -> None:
    """Two capsules along a foot that points downwards by 10 degrees at zero: it stood on their ends."""
    rods = "".join(
        f"<collision><origin xyz='0.04 {y} -0.045' rpy='0 {math.pi / 2 + math.radians(10)} 0'/><geometry>"
        "<capsule radius='0.025' length='0.2'/></geometry></collision>"
        for y in (-0.03, 0.03)
    )
    found = found_of(tmp_path, spread=0.35, sole=rods)
    for side in SIDES:
        tilt = math.radians(10)
        assert axis(found, f"{side}_foot", "up") == pytest.approx([math.sin(tilt), 0, math.cos(tilt)], abs=0.05)


@pytest.mark.parametrize("out", [0.0, 0.4, 1.0])
def test_a_foot_looks_across_its_ankle_however_far_the_leg_is_turned(out: float, tmp_path: Path) -> None:
    found = found_of(tmp_path, toes_out=out)
    assert axis(found, "left_foot", "forward") == pytest.approx([1, 0, 0], abs=1e-6)
    assert axis(found, "chest", "forward") == pytest.approx([1, 0, 0], abs=1e-6)


@pytest.mark.parametrize("lean", [0.0, 0.3, 0.8, 1.2])
def test_the_trunk_tells_up_where_the_legs_lean(lean: float, tmp_path: Path) -> None:
    found = found_of(tmp_path, hip=-lean)
    assert axis(found, "chest", "up") == pytest.approx([0, 0, 1], abs=1e-6)
    assert ("up" in about(found)) == (lean > math.acos(0.8))
