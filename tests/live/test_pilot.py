"""Whatever is sent, and whenever: joints stay inside all limits, and stand still in time when nobody holds the button."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.live.governor import Governor
from mrhubo.live.pilot import Pilot
from mrhubo.robot_motion import RobotFacts
from tests.live.messages import beat, message
from tests.live.robots import AT_ONCE, LOWER, SPEED, UPPER, make_robot, random_robot

PERIOD = 1 / 60
CONFIGS = st.builds(
    LiveConfig,
    acceleration=st.sampled_from([5.0, 60.0, 900.0]),
    ramp_time=st.sampled_from([0.0, 0.1]),
    doubt=st.sampled_from(["hold", "slow", "relax"]),
    relax_after=st.just(0.05),
    speed=st.sampled_from([0.3, 1.0]),
)
PACKETS = st.lists(
    st.tuples(
        st.sampled_from(
            ["frame", "frame", "frame", "beat", "beat", "release", "nobody", "garbage", "silence", "doubt"]
        ),
        st.integers(0, 3),  # how many periods pass before it
        st.integers(-2, 3),  # by how much its number is ahead of the one before
    ),
    max_size=60,
)


def follow(pilot: Pilot, steps: int, now: float, feed: Any = None) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Angles and velocities of some steps, and states."""
    outputs = []
    for step in range(steps):
        if feed is not None:
            feed(step, now + step * PERIOD)
        outputs.append(pilot.tick(now + step * PERIOD))
    return (
        np.array([output.q_N for output in outputs]),
        np.array([output.velocity_N for output in outputs]),
        [output.state for output in outputs],
    )


def assert_inside(q_TN: np.ndarray, config: LiveConfig, start_N: np.ndarray) -> None:
    """Positions, speeds and accelerations of what was sent, from standing on, by its differences alone."""
    q_TN = np.concatenate([start_N[None], start_N[None], q_TN])
    velocity_TN = np.diff(q_TN, axis=0) * config.rate
    acceleration_TN = np.diff(velocity_TN, axis=0) * config.rate
    assert (q_TN >= LOWER).all() and (q_TN <= UPPER).all()
    assert (np.abs(velocity_TN) <= SPEED * config.speed + 1e-9).all()
    assert (np.abs(acceleration_TN) <= config.acceleration * (1 + 1e-9) + 1e-6).all()


@settings(max_examples=60, deadline=None)
@given(CONFIGS, PACKETS, st.integers(0, 1000), st.booleans())
def test_no_limit_is_exceeded_whatever_comes(config: LiveConfig, packets: Any, seed: int, frames: bool) -> None:
    robot = random_robot(seed)
    pilot, now, number, sent = Pilot(robot, config, frames), 0.0, 0, []
    for kind, passed, ahead in packets:
        number = max(0, number + ahead)
        data = {
            "frame": message(number, time=now),
            "doubt": message(number, time=now, confidence=[0.2] * 21),
            "beat": beat(number, now),
            "release": beat(number, now, held=False),
            "nobody": message(number, "nobody", now),
            "garbage": bytes([number % 256]) * 9,
            "silence": None,
        }[kind]
        for _ in range(passed):
            sent.append(pilot.tick(now).q_N)
            now += PERIOD
        if data is not None:
            pilot.inbox.offer(data, "a", now)
    for _ in range(15):
        sent.append(pilot.tick(now).q_N)
        now += PERIOD
    assert_inside(np.array(sent), config, robot.home_N)
    assert np.abs(sent[-1] - sent[-2]).max() < 1e-9, "all is silent, and the robot still moves"


@pytest.mark.parametrize("end", ["silence", "release", "gone", "end"])
@pytest.mark.parametrize("rate", [60.0, 200.0])
def test_it_stands_in_time(end: str, rate: float) -> None:
    config = LiveConfig(rate=rate, ramp_time=0.0, acceleration=80.0)
    pilot, moved = Pilot(random_robot(1), config, False), []
    last_beat = 1.0
    for step in range(round(1.5 * rate)):
        now = step / rate
        if now <= last_beat:
            pilot.inbox.offer(beat(step, now), "a", now)
        pilot.inbox.offer(message(step, time=now), "a", now)
        if end != "silence" and last_beat < now <= last_beat + 1 / rate:
            if end == "release":
                pilot.inbox.offer(beat(10_000, now, held=False), "a", now)
            elif end == "gone":
                pilot.inbox.gone("a")
            else:
                pilot.end()
        moved.append(np.abs(pilot.tick(now).velocity_N).max())
    speed = np.array(moved)
    assert speed[: round(last_beat * rate)].max() > 3, "it never moved"
    assert speed[round((last_beat + config.stop_time) * rate) :].max() < 1e-9
    if end != "silence":
        assert speed[round((last_beat + config.stop_time - config.heartbeat_timeout + 2 / rate) * rate) :].max() < 1e-9


def test_nothing_moves_before_the_button_is_held() -> None:
    pilot = Pilot(random_robot(2), AT_ONCE, False)
    q_TN, _, states = follow(pilot, 30, 0.0, lambda step, now: pilot.inbox.offer(message(step, time=now), "a", now))
    assert (q_TN == pilot.robot.home_N).all() and set(states) == {"stopped"}
    pilot.inbox.offer(beat(0, 0.5), "b", 0.5)
    q_TN, _, states = follow(pilot, 3, 0.5)
    assert states == ["following"] * 3 and (q_TN[-1] != q_TN[0]).any()


def test_speed_rises_with_the_ramp_after_every_stop() -> None:
    config = LiveConfig(ramp_time=1.0, acceleration=1000.0)
    goal = UPPER - 0.01
    pilot = Pilot(make_robot(lambda pose, time: goal if int(time * 4) % 2 else LOWER + 0.01), config, True)

    def feed(step: int, now: float) -> None:
        pilot.inbox.offer(message(round(now * 1000), time=now), "a", now)

    for begin in (0.0, 5.0):
        _, velocity_TN, _ = follow(pilot, 90, begin, feed)
        allowed_T = np.minimum(1.0, np.arange(90) * PERIOD / config.ramp_time)
        assert (np.abs(velocity_TN) <= allowed_T[:, None] * SPEED + 1e-9).all()
        assert np.abs(velocity_TN[70:, 0]).max() > 0.95 * SPEED[0]


def test_after_a_pause_of_the_process_it_goes_on_from_where_the_robot_stopped() -> None:
    pilot = Pilot(make_robot(lambda pose, time: UPPER), LiveConfig(ramp_time=0.5), True)
    follow(pilot, 30, 0.0, lambda step, now: pilot.inbox.offer(message(step, time=now), "a", now))
    before = pilot.tick(0.51)
    assert np.abs(before.velocity_N).max() > 1
    pilot.inbox.offer(message(99, time=9.0), "a", 9.0)
    after = pilot.tick(9.0)
    assert np.array_equal(after.q_N, before.stop_N) and not after.velocity_N.any()


def test_a_pose_that_the_retargeter_refuses_is_counted() -> None:
    def refuse(pose: Any, time: float) -> np.ndarray:
        raise UserError("no")

    pilot = Pilot(make_robot(refuse), LiveConfig(), True)
    pilot.inbox.offer(message(0), "a", 0.0)
    assert pilot.tick(0.0).state == "waiting" and pilot.inbox.counts["malformed"] == 1


def sure(**joints: float) -> list[float]:
    from mrhubo.body.joints import POSED_JOINT_NAMES

    return [joints.get(name, 1.0) for name in POSED_JOINT_NAMES]


@pytest.mark.parametrize("doubt", ["hold", "slow", "relax"])
def test_parts_that_are_hardly_seen(doubt: str) -> None:
    config = LiveConfig(doubt=doubt, ramp_time=0.0, relax_after=0.2, relax_speed=1.0)
    seen = {"goal": np.array([0.5, 0.1, 0.5, 0.5, 0.5])}
    robot = make_robot(lambda pose, time: seen["goal"])
    pilot, count = Pilot(robot, config, True), 0

    def run(steps: int, weights: list[float]) -> np.ndarray:
        nonlocal count
        found = []
        for _ in range(steps):
            count += 1
            pilot.inbox.offer(message(count, time=count * PERIOD, confidence=weights), "a", count * PERIOD)
            found.append(pilot.tick(count * PERIOD).velocity_N)
        return np.abs(found).max(axis=0)

    run(120, sure())
    assert np.allclose(pilot.governor.q_N, seen["goal"], atol=1e-6)
    seen["goal"] = -seen["goal"]
    fastest_N = run(12, sure(left_elbow=0.25))
    left, right = pilot.governor.q_N[:2], pilot.governor.q_N[2]
    assert right < 0.3, "the arm that is seen does not follow"
    if doubt == "slow":
        assert (fastest_N[:2] <= SPEED[:2] / 2 + 1e-9).all() and left[0] < 0.5
    else:
        assert np.allclose(left, [0.5, 0.1], atol=1e-6)
    fastest_N = run(200, sure(left_elbow=0.0))
    if doubt == "relax":
        assert np.allclose(pilot.governor.q_N[:2], robot.home_N[:2], atol=1e-6) and fastest_N[0] <= 1 + 1e-9
    elif doubt == "hold":
        assert np.allclose(pilot.governor.q_N[:2], [0.5, 0.1], atol=1e-6)
    run(120, sure())
    assert np.allclose(pilot.governor.q_N, np.clip(seen["goal"], LOWER, UPPER), atol=1e-6)


def test_nobody_is_doubt_of_all_parts() -> None:
    pilot = Pilot(random_robot(3), LiveConfig(), False)
    pilot.inbox.offer(message(0), "a", 0.0)
    pilot.inbox.offer(beat(0), "b", 0.0)
    assert pilot.tick(0.0).state == "following"
    pilot.inbox.offer(message(1, "nobody", 0.02), "a", 0.02)
    output = pilot.tick(0.02)
    assert output.state == "doubtful" and output.confidence == {"left": 0.0, "right": 0.0}


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 30))
def test_the_standstill_that_is_told_is_where_it_stands(seed: int, steps: int) -> None:
    generator = np.random.default_rng(seed)
    config = LiveConfig(acceleration=float(generator.uniform(5, 300)))
    governor = Governor(
        RobotFacts("toy", lower=LOWER, upper=UPPER, velocity=SPEED), config, generator.uniform(-3, 3, 5)
    )
    for _ in range(steps):
        governor.go(generator.uniform(-4, 4, 5), generator.uniform(0, 20, 5))
    stop_N, stop_in = governor.standstill()
    assert stop_in <= config.stop_time - config.heartbeat_timeout
    count = 0
    while not governor.still:
        governor.brake()
        count += 1
    assert np.allclose(stop_N, governor.q_N, atol=1e-9) and count * governor.period <= stop_in + 1e-9


def test_duplicates_and_reordering_change_nothing() -> None:
    def outputs(extra: bool) -> list[Any]:
        generator = np.random.default_rng(5)
        pilot, found = Pilot(random_robot(4), AT_ONCE, False), []
        for step in range(60):
            now = step * PERIOD
            rotations = generator.normal(size=(21, 3)).tolist()
            pilot.inbox.offer(message(step, time=now, rotations=rotations), "a", now)
            pilot.inbox.offer(beat(step, now), "b", now)
            if extra:
                for number in (step, step - 1, step - 5):
                    pilot.inbox.offer(message(max(0, number), time=now), "a", now)
                    pilot.inbox.offer(beat(max(0, number), now, held=False), "b", now)
                pilot.inbox.offer(message(step + 9, time=now), "stranger", now)
                pilot.inbox.offer(b"{", "a", now)
            found.append(dataclasses.replace(pilot.tick(now), session=""))
        return found

    for plain, disturbed in zip(outputs(False), outputs(True), strict=True):
        assert plain.message() == disturbed.message()


@pytest.mark.parametrize(("key", "changes"), [("stop_time", {"stop_time": 0.12}), ("stop_time", {"rate": 15.0})])
def test_no_time_to_brake_is_refused(key: str, changes: dict[str, Any]) -> None:
    with pytest.raises(UserError, match=key):
        Pilot(make_robot(), LiveConfig(**changes), True)


def test_unknown_limits_are_refused() -> None:
    robot = dataclasses.replace(make_robot(), facts=RobotFacts("toy"))
    with pytest.raises(UserError, match="limits"):
        Pilot(robot, LiveConfig(), True)
