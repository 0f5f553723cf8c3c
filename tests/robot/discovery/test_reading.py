"""What is read of a file before limbs are looked for: springs behind motors, and frames of a room."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrhubo.describing.run import open_robot
from mrhubo.robot import BodyMap
from mrhubo.robot.discovery import Discovery
from tests.robot.discovery.made import SIDES, Made, X, Y, Z, at


def robot(folder: Path, made: Made | None = None) -> Discovery:
    """Two arms with wrists, a neck and legs."""
    made = made or Made()
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
        made.join(f"{side}_ankle", made.leg(side), (0, 0, -0.4), Y, (-0.8, 0.8))
    made.join("head_pitch", made.join("head_yaw", "chest", (0, 0, 0.5), Z), (0, 0, 0.05), Y)
    return made.found(folder)


def with_springs(folder: Path, gives: float) -> Discovery:
    """Each joint of the arms has a spring about its own axis behind it."""
    made = Made()
    for side, sign in SIDES.items():
        link = "chest"
        parts = (
            ("pitch", Y, (0, 0.2 * sign, 0.4), (-2.8, 1.2)), ("roll", X, (0, 0, 0), (-1.5, 1.5)),
            ("yaw", Z, (0, 0, 0), (-1.5, 1.5)), ("elbow", Y, (0, 0, -0.3), (-2.3, 0.0)),
            ("twist", Z, (0, 0, -0.1), (-1.5, 1.5)), ("wrist", Y, (0, 0, -0.15), (-1.5, 1.5)),
        )  # fmt: skip
        for name, axis, place, limits in parts:
            link = made.join(f"{side}_{name}", link, place, axis, limits)
            link = made.join(f"{side}_{name}_spring", link, (0, 0, 0), axis, (-gives, gives))
    return robot_without_arms(made, folder)


def robot_without_arms(made: Made, folder: Path) -> Discovery:
    for side in SIDES:
        made.join(f"{side}_ankle", made.leg(side), (0, 0, -0.4), Y, (-0.8, 0.8))
    return made.found(folder)


@pytest.mark.parametrize("gives", [0.1, 0.3])
def test_a_spring_behind_each_motor_is_held(gives: float, tmp_path: Path) -> None:
    found = with_springs(tmp_path, gives)
    assert found.chains["left_arm"] == tuple(
        f"left_{name}_joint" for name in ("pitch", "roll", "yaw", "elbow", "twist", "wrist")
    )
    assert at(found, "left_elbow") == pytest.approx([0, 0.2, 0.1]) and at(found, "right_wrist")[2] < -0.1
    springs = {name for name in found.held if "spring" in name}
    assert len(springs) == 12 and not springs & set(found.joints)


def test_a_config_need_not_name_springs(tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    with_springs(tmp_path, 0.2)
    BodyMap.of(open_robot(str(tmp_path / "made.urdf"), whole_body=True))
    assert not [str(w.message) for w in recwarn if "spring" in str(w.message)]


def test_two_limbs_on_one_axis_are_no_spring(tmp_path: Path) -> None:
    """Both shoulders of a chest that carries nothing else turn about one axis, one of them by less."""
    made = Made()
    for side in SIDES:
        made.wrist(side, made.forearm(side, made.arm(side)))
    text = "".join(made.parts).replace("lower='-2.8' upper='1.2'", "lower='-0.2' upper='0.2'", 1)
    made.parts = [text]
    assert len(made.found(tmp_path).chains["left_arm"]) == 7


@pytest.mark.parametrize("away", [3.0, 50.0])
def test_a_frame_of_the_room_says_nothing_of_the_robots_size(away: float, tmp_path: Path) -> None:
    plain = robot(tmp_path)
    made = Made()
    made.join("map", "chest", (away, -away, 0), X, None, "fixed")
    found = robot(tmp_path, made)
    assert found.chains == plain.chains and found.forward == plain.forward
    for name, point in plain.points.items():
        assert found.points[name].root_3 == pytest.approx(point.root_3), name
    assert np.linalg.norm(found.forward.root_3) == pytest.approx(1)
