"""What a URDF's limits mean: soft ones, degrees, none at all, those of joints that mimic others, and speeds."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from mrhubo.config import RobotConfig
from mrhubo.errors import InputWarning, UserError
from mrhubo.robot import Robot, build_body_map
from mrhubo.robot.joint import Joint, Mimic, drive
from mrhubo.robot.limits import narrow_to_mimics
from mrhubo.robot.urdf import describe
from tests.robot.two_arms import joint_of

Pair = Callable[..., RobotConfig]
NOWHERE = torch.zeros(0).numpy()


def within(joint: str, old: str, new: str) -> tuple[str, str]:
    element = joint_of(joint)
    assert old in element
    return element, element.replace(old, new)


def limits_of(config: RobotConfig, joint: str = "l_yaw") -> tuple[float, float]:
    robot = build_body_map(config).robot
    row = robot.joint_names.index(joint)
    return round(float(robot.lower_N[row]), 6), round(float(robot.upper_N[row]), 6)


YAW = 'lower="-1.5" upper="1.5"'


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ('lower="-90" upper="90"', r"'l_yaw' has limits -90 .. 90, which is 29 turns from end to end: are these degrees\? .*robot.ranges"),
        ('lower="170" upper="175"', r"'l_yaw' has limits 170 .. 175, .*are these degrees"),
        ('lower="-1e16" upper="1e16"', r"'l_yaw' has no limits: -1e\+16 .. 1e\+16 mean none; give it a range in robot.ranges"),
        ('lower="-inf" upper="inf"', r"'l_yaw' has no limits: -inf .. inf mean none"),
        ('lower="-1.5" upper="3.4e38"', r"'l_yaw' has no limits: -1.5 .. 3.4e\+38 mean none"),
        ('upper="1.5"', r"'l_yaw' has no limits; give it a range in robot.ranges"),
        ('lower="1.5" upper="1.5"', r"'l_yaw' has the impossible limits 1.5 .. 1.5"),
    ],
)  # fmt: skip
def test_limits_that_cannot_be_meant_ask_for_a_range(pair: Pair, limits: str, message: str) -> None:
    with pytest.raises(UserError, match=message):
        build_body_map(pair(within("l_yaw", YAW, limits)))
    if "impossible" not in message:
        assert limits_of(pair(within("l_yaw", YAW, limits), ranges={"l_yaw": [-1.0, 1.25]})) == (-1.0, 1.25)


def test_limits_the_wrong_way_round_are_read_the_other_way_and_told(pair: Pair) -> None:
    """As InMoov's head and left fingers have them, mirrored by hand."""
    with pytest.warns(InputWarning, match=r"line \d+: joint 'l_yaw' has the limits 1.5 .. -0.5, .*taken: -0.5 .. 1.5"):
        assert limits_of(pair(within("l_yaw", YAW, 'lower="1.5" upper="-0.5"'))) == (-0.5, 1.5)


def test_a_joint_whose_limits_are_in_degrees_is_held_at_zero(pair: Pair) -> None:
    limits = 'lower="-1.5" upper="1.5"'
    assert build_body_map(pair(within("neck", limits, 'lower="5" upper="120"'))).robot.held["neck"] == 0.0
    assert build_body_map(pair(within("neck", limits, 'lower="0.5" upper="1.2"'))).robot.held["neck"] == 0.5


def test_where_all_limits_are_degrees_a_joint_is_held_at_the_nearest_of_its_own(pair: Pair) -> None:
    limits = 'lower="-1.5" upper="1.5"'
    config = pair(within("neck", limits, 'lower="0.5" upper="1.2"'))
    ranges = {name: [float(low), float(high)] for robot in [build_body_map(config).robot]
              for name, low, high in zip(robot.joint_names, robot.lower_N, robot.upper_N, strict=True)}  # fmt: skip
    text = config.urdf.read_text()
    config.urdf.write_text(re.sub(r'(lower|upper)="([^"]+)"', lambda m: f'{m[1]}="{math.degrees(float(m[2]))}"', text))
    held = build_body_map(dataclasses.replace(config, ranges=ranges)).robot.held["neck"]
    assert held == pytest.approx(0.5)
    with pytest.raises(UserError, match=r"robot.hold.neck: 0.2 leaves"):
        build_body_map(dataclasses.replace(config, ranges=ranges, hold={"neck": 0.2}))


def test_two_turns_are_a_range(pair: Pair) -> None:
    assert limits_of(pair(within("l_yaw", YAW, 'lower="-6.2832" upper="6.2832"'))) == (-6.2832, 6.2832)


def test_degrees_in_the_config_are_refused(pair: Pair) -> None:
    free = within("l_yaw", 'type="revolute"', 'type="continuous"')
    with pytest.raises(UserError, match=r"robot.ranges.l_yaw: -180 .. 180, which is 57 turns .*; give radians"):
        build_body_map(pair(free, ranges={"l_yaw": [-180.0, 180.0]}))
    with pytest.raises(UserError, match=r"robot.hold.neck: 30 rad is more than two turns; give radians"):
        build_body_map(pair(within("neck", 'type="revolute"', 'type="continuous"'), hold={"neck": 30.0}))


@pytest.mark.parametrize(
    ("soft", "expected"),
    [
        ('soft_lower_limit="-0.5" soft_upper_limit="0.25"', (-0.5, 0.25)),
        ('soft_lower_limit="-9" soft_upper_limit="0.25"', (-1.5, 0.25)),
        ('soft_upper_limit="0.25"', (-1.5, 0.25)),
        ("", (-1.5, 1.5)),
        ('soft_lower_limit="0" soft_upper_limit="0"', (-1.5, 1.5)),
        ('soft_lower_limit="2" soft_upper_limit="3"', (-1.5, 1.5)),
    ],
)
def test_the_narrower_of_hard_and_soft_limits_counts(pair: Pair, soft: str, expected: tuple[float, float]) -> None:
    edit = within("l_yaw", "<axis", f'<safety_controller {soft} k_velocity="1"/><axis')
    assert limits_of(pair(edit)) == expected


def test_a_range_beyond_soft_limits_is_told_so(pair: Pair) -> None:
    edit = within("l_yaw", "<axis", '<safety_controller soft_lower_limit="-0.5" soft_upper_limit="0.5"/><axis')
    with pytest.raises(UserError, match=r"robot.ranges.l_yaw: \[-1.0, 0.0\] leaves the URDF's soft limits -0.5 .. 0.5"):
        build_body_map(pair(edit, ranges={"l_yaw": [-1.0, 0.0]}))


def mimicking(multiplier: float, offset: float = 0.0) -> tuple[str, str]:
    """The right elbow follows the left one."""
    return within("r_elbow", "<axis", f'<mimic joint="l_elbow" multiplier="{multiplier}" offset="{offset}"/><axis')


JOINTS = [f"{s}_{j}" for s in "lr" for j in ("pitch", "roll", "yaw")] + ["l_elbow"]


def test_a_range_ends_where_a_mimicking_joint_would_leave_its_limits(pair: Pair) -> None:
    config = pair(mimicking(2.0), joints=JOINTS)
    with pytest.warns(
        InputWarning, match=r"'l_elbow' \(-2.3 .. 0\) is kept to -1.15 .. 0 rad, because 'r_elbow', which"
    ):
        robot = build_body_map(config).robot
    assert float(robot.lower_N[-1]) == pytest.approx(-1.15) and float(robot.upper_N[-1]) == 0.0
    assert robot.description.kinematics != describe(config.urdf).kinematics  # pairs of the wider range are not reused


def test_a_range_that_suits_both_is_silent(pair: Pair, recwarn: pytest.WarningsRecorder) -> None:
    assert limits_of(pair(mimicking(2.0), joints=JOINTS, ranges={"l_elbow": [-1.0, -0.1]}), "l_elbow") == (-1.0, -0.1)
    assert limits_of(pair(mimicking(1.0), joints=JOINTS), "l_elbow") == (-2.3, 0.0)
    assert not recwarn.list
    with pytest.raises(UserError, match=r"\[-2.0, -0.1\] leaves the range that keeps 'r_elbow', .* -1.15 .. 0"):
        build_body_map(pair(mimicking(2.0), joints=JOINTS, ranges={"l_elbow": [-2.0, -0.1]}))


def test_no_range_is_left(pair: Pair) -> None:
    with pytest.raises(
        UserError, match=r"'r_elbow' mimics 'l_elbow' \(times -3, plus 0\) and would leave its own limits"
    ):
        build_body_map(pair(mimicking(-3.0), joints=JOINTS))


numbers = st.floats(-3, 3)


@given(numbers, numbers, st.lists(st.tuples(numbers, numbers, numbers, numbers), min_size=1, max_size=3), st.randoms())
def test_no_mimicking_joint_leaves_its_limits(low: float, high: float, followers: list, random: object) -> None:
    def joint(name: str, lower: float, upper: float, mimic: Mimic | None) -> Joint:
        return Joint(name, "revolute", "a", name, NOWHERE, NOWHERE, min(lower, upper), max(lower, upper), mimic)

    joints = {"source": joint("source", low, high, None)}
    for i, (lower, upper, multiplier, offset) in enumerate(followers):
        before = "source" if i == 0 else f"f{i - 1}"  # each mimics the one before
        joints[f"f{i}"] = joint(f"f{i}", lower, upper, Mimic(before, multiplier, offset))
    try:
        found = narrow_to_mimics(NOWHERE, joints, ["source"])  # pyright: ignore[reportArgumentType] (for messages)
    except UserError:
        return
    source = found["source"].joint if "source" in found else joints["source"]
    assert joints["source"].lower <= source.lower <= source.upper <= joints["source"].upper
    for name, follower in joints.items():
        driven = drive(joints, name)
        for end in (source.lower, source.upper):
            angle = driven.multiplier * end + driven.offset
            usable = follower.lower < follower.upper and abs(driven.multiplier) >= 1e-9
            assert not usable or follower.lower - 2e-4 <= angle <= follower.upper + 2e-4


def test_what_mimics_a_joint_that_is_not_sampled_changes_nothing(pair: Pair, recwarn: pytest.WarningsRecorder) -> None:
    arms = [name for name in JOINTS if name != "l_elbow"]
    robot = Robot(pair(mimicking(-3.0)).urdf, arms, ["l_hand", "r_hand"])
    assert robot.held["l_elbow"] == 0.0 and not recwarn.list and math.isfinite(robot.held["neck"])


def speed_of(config: RobotConfig, name: str = "l_roll") -> float:
    return float(build_body_map(config).robot.velocity_N[config.joints.index(name)])


@pytest.mark.parametrize(
    ("told", "speed"),
    [("3", 3.0), ("0", 12.0), ("-1", 12.0), ("1e9", 12.0), ("inf", 12.0), ("180", 12.0), ("fast", 12.0), (None, 12.0)],
)
def test_a_speed_is_the_urdfs_where_it_tells_one(pair: Pair, told: str | None, speed: float) -> None:
    attribute = "" if told is None else f'velocity="{told}"'
    config = pair(within("l_roll", 'velocity="1"', attribute))
    if told == "fast":  # a number that nothing needs
        with pytest.warns(InputWarning, match='velocity="fast"> is no number'):
            assert speed_of(config) == speed
    else:
        assert speed_of(config) == speed


def test_the_narrower_of_the_urdfs_speed_and_the_settings_counts(pair: Pair) -> None:
    assert speed_of(pair(max_speed=0.5)) == 0.5 and speed_of(pair(max_speed=100.0)) == 1.0
    config = pair()
    assert float(Robot(config.urdf, config.joints, max_speed=0.5).velocity_N.max()) == 0.5
    for speed in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(UserError, match="robot.max_speed: must be a positive number of rad/s"):
            Robot(config.urdf, config.joints, max_speed=speed)


def test_a_joint_is_as_slow_as_what_mimics_it(pair: Pair) -> None:
    """Nothing of a mimicking joint counts but its speed; it may be turned by twice the angle, or a half of it."""
    for multiplier, speed in ((0.9, 1.0), (2.0, 0.5), (-2.0, 0.5)):
        joints = [name for name in JOINTS if name != "l_elbow"]
        ranges = {"l_yaw": [-0.4, 0.4]}
        config = pair(
            within("r_elbow", "<axis", f'<mimic joint="l_yaw" multiplier="{multiplier}" offset="-1"/><axis'),
            joints=joints, ranges=ranges,
        )  # fmt: skip
        assert speed_of(config, "l_yaw") == pytest.approx(speed)


def test_a_speed_changes_no_pair(pair: Pair) -> None:
    robots = [build_body_map(pair(within("l_roll", 'velocity="1"', f'velocity="{v}"'))).robot for v in (3, 1)]
    assert robots[0].description.kinematics == robots[1].description.kinematics
