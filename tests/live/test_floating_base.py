"""Planted soles stay where they are, whatever joints are sent; and what a stopped robot's base does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo.fast import FastRetargeter
from mrhubo.fast.plain.ground import Base, Stance
from mrhubo.fast.plain.robot import place
from mrhubo.fast.plain.soles import turned_points
from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.live.floating_base import FASTEST_TURN, LEVEL_SPEED, SINK_SPEED, FloatingBase
from tests.live.walkers import make_legged
from tests.reference.walkers import ROOTS

PERIOD, BRAKE = 1 / 60, 5 / 60
ALL, LEFT, NONE = np.ones(4), np.array([1.0, 1.0, 0.0, 0.0]), np.zeros(4)


@pytest.fixture(scope="module", params=ROOTS)
def legged(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> FastRetargeter:
    return make_legged(tmp_path_factory.mktemp("legged"), request.param)


def home(legged: FastRetargeter) -> np.ndarray:
    cost = legged.description.cost
    return np.clip(np.zeros(len(cost.lower_N)), cost.lower_N, cost.upper_N).astype(np.float64)


def soles(legged: FastRetargeter, q_N: np.ndarray, base: Base) -> tuple[np.ndarray, np.ndarray, float]:
    """Ends of soles (H, 3) [m] and turns of feet (R, 3, 3) in the world, and the height of the lowest sole [m]."""
    legs = legged.description.legs
    assert legs is not None
    placed = place(legged.description.kinematics, q_N[None])
    point_H3, ball_J3 = (
        turned_points(placed, *of)[0] @ base.turn_33.T + base.place_3
        for of in ((legs.body_H, legs.point_H3), (legs.ball_body_J, legs.ball_J3))
    )
    turn_R33 = base.turn_33 @ placed.rotation_BL33[0, legs.body_H[::2]]
    return point_H3, turn_R33, float((ball_J3[:, 2] - legs.radius_J).min())


def wander(generator: np.random.Generator, q_N: np.ndarray, legged: FastRetargeter) -> np.ndarray:
    cost = legged.description.cost
    return np.clip(q_N + generator.normal(0.0, 0.01, len(q_N)), cost.lower_N, cost.upper_N)


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10_000), stopped=st.booleans())
def test_a_planted_foot_stays_whatever_joints_and_stream_do(legged: FastRetargeter, seed: int, stopped: bool) -> None:
    generator, q_N = np.random.default_rng(seed), home(legged)
    base = FloatingBase(legged.description, q_N, PERIOD, BRAKE)
    still = Stance(base.base, LEFT, q_N)
    for _ in range(20):  # the right foot is lifted
        for joint, angle in (("r_hip_pitch", -0.03), ("r_knee", 0.06), ("r_ankle", -0.03)):
            q_N[legged.joint_names.index(joint)] += angle
        base.step(q_N, q_N, still, 1.0)
    assert base.planted_R.tolist() == [True, False]
    before_H3, before_R33, _ = soles(legged, q_N, base.base)
    moved, turned = np.zeros(3), np.zeros(3)
    for step in range(20):
        q_N = wander(generator, q_N, legged)
        moved, turned = moved + generator.normal(0, 0.01, 3), turned + generator.normal(0, 0.01, 3)
        theirs = Base(still.base.place_3 + moved, axis_angle_to_matrix(turned) @ still.base.turn_33)
        base.step(q_N, q_N, Stance(theirs, LEFT, still.q_N), 0.0 if stopped else step / 200)
        after_H3, after_R33, lowest = soles(legged, q_N, base.base)
        assert lowest > -1e-9
        # While it follows, the stream may turn the foot, about its middle.
        middles = [point_H3[:2, :2].mean(axis=0) for point_H3 in (before_H3, after_H3)]
        np.testing.assert_allclose(*middles, atol=1e-9)
        if stopped:
            np.testing.assert_allclose(after_H3[:2, :2], before_H3[:2, :2], atol=1e-9)
            np.testing.assert_allclose(after_R33[0], before_R33[0], atol=1e-9)


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_of_two_planted_feet_the_middle_stays(legged: FastRetargeter, seed: int) -> None:
    generator, q_N = np.random.default_rng(seed), home(legged)
    base = FloatingBase(legged.description, q_N, PERIOD, BRAKE)
    before_H3, *_ = soles(legged, q_N, base.base)
    for _ in range(20):
        q_N = wander(generator, q_N, legged)
        base.step(q_N, q_N, None, 0.0)
        after_H3, _, lowest = soles(legged, q_N, base.base)
        np.testing.assert_allclose(after_H3[:, :2].mean(axis=0), before_H3[:, :2].mean(axis=0), atol=1e-9)
        assert abs(lowest) < 1e-9 or lowest > 0


@pytest.mark.parametrize("weight_H", [ALL, NONE])
def test_with_the_streams_own_joints_the_base_is_the_streams(legged: FastRetargeter, weight_H: np.ndarray) -> None:
    """In the air it moves as the stream's; on the floor the stream's base is carried by the same feet."""
    q_N = home(legged)
    base = FloatingBase(legged.description, q_N, PERIOD, BRAKE)
    begin, q_N = base.base, q_N.copy()
    elsewhere_33, away_3 = axis_angle_to_matrix(np.array([0.0, 0.0, 2.0])), np.array([3.0, -1.0, 0.0])
    for step in range(40):
        other = FloatingBase(legged.description, q_N, PERIOD, BRAKE).base  # upright on both feet
        turn_33 = axis_angle_to_matrix(np.array([0.0, 0.01 * step, 0.0])) @ begin.turn_33 if weight_H is NONE else other.turn_33  # fmt: skip
        height = np.array([0.0, 0.0, max(0.0, 0.01 * step) if weight_H is NONE else 0.0])
        at_3 = other.place_3 + height + ([0.005 * step, 0.0, 0.0] if weight_H is NONE else 0.0)
        base.step(q_N, q_N, Stance(Base(elsewhere_33 @ at_3 + away_3, elsewhere_33 @ turn_33), weight_H, q_N), 1.0)
        if step > 12 or weight_H is ALL:
            np.testing.assert_allclose(base.base.turn_33, turn_33, atol=0.02 if weight_H is NONE else 1e-6)
            np.testing.assert_allclose(base.base.place_3[2], at_3[2], atol=0.03 if weight_H is NONE else 1e-6)
    if weight_H is NONE:  # the contacts of the beginning have faded by then
        assert base.base.place_3[0] > 0.1 and abs(base.base.place_3[1]) < 1e-9


def test_who_is_stopped_in_the_air_comes_down_and_rests(legged: FastRetargeter) -> None:
    q_N = home(legged)
    base = FloatingBase(legged.description, q_N, PERIOD, BRAKE)
    start = base.base
    for step in range(30):
        base.step(q_N, q_N, Stance(Base(start.place_3 + [0.02 * step, 0, 0.01 * step], start.turn_33), NONE, q_N), 1.0)
    assert not base.planted_R.any() and base.base.place_3[2] > start.place_3[2] + 0.1
    places, told = [base.base.place_3], base.standstill()
    while not base.still:
        base.step(q_N, q_N, None, 0.0)
        places.append(base.base.place_3)
        assert len(places) < 120
    way_T3 = np.diff(places, axis=0) / PERIOD
    assert np.abs(np.diff(way_T3[:, 0])).max() < 0.4, "it brakes, and does not stop at once"
    assert np.abs(way_T3[6:, :2]).max() < 1e-9, "it rests within the time for braking"
    assert way_T3[:, 2].min() >= -1.5 * SINK_SPEED and abs(soles(legged, q_N, base.base)[2]) < 2e-3
    np.testing.assert_allclose(told.place_3[:2], places[-1][:2], atol=1e-9)


def test_another_place_of_the_streams_world_is_not_gone_to(legged: FastRetargeter) -> None:
    q_N = home(legged)
    base = FloatingBase(legged.description, q_N, PERIOD, BRAKE)
    start = base.base
    for step in range(30):
        far = np.array([100.0, -50.0, 0.0]) if step % 10 > 5 else np.zeros(3)
        turned_33 = axis_angle_to_matrix(np.array([0.0, 0.0, 2.5 if step % 10 > 5 else 0.0]))
        theirs = Base(start.place_3 + far, turned_33 @ start.turn_33)
        base.step(q_N, q_N, Stance(theirs, NONE if step % 3 else ALL, q_N), 1.0)
        np.testing.assert_allclose(base.base.place_3, start.place_3, atol=1e-6)
        np.testing.assert_allclose(base.base.turn_33, start.turn_33, atol=1e-6)


@pytest.mark.parametrize("frames_every", [1, 3])
def test_what_the_stream_has_gone_and_turned_in_a_gap_takes_as_long_again(
    legged: FastRetargeter, frames_every: int
) -> None:
    """No more than people's fastest, whenever frames come, in the air and on a foot that the stream has turned."""
    for weight_H in (NONE, LEFT):
        q_N = home(legged)
        base = FloatingBase(legged.description, q_N, PERIOD, BRAKE)
        start = last = base.base
        stance = Stance(start, weight_H, q_N)
        for step in range(60):
            if step % frames_every == 0 and not 20 <= step < 32:  # a fifth of a second without a frame
                gone = float(step >= 32)
                turn_33 = axis_angle_to_matrix(np.array([0.0, 0.0, 2.5 * gone])) @ start.turn_33
                stance = Stance(Base(start.place_3 + [1.0 * gone, 0, 0.1], turn_33), weight_H, q_N)
            base.step(q_N, q_N, stance, 1.0)
            turned = np.arccos(np.clip((np.sum(base.base.turn_33 * last.turn_33) - 1) / 2, -1, 1))
            assert turned <= (FASTEST_TURN + LEVEL_SPEED) * PERIOD + 1e-6
            if weight_H is NONE:
                assert np.linalg.norm(base.base.place_3 - last.place_3) < 1.5 * 1.0 / 12
            last = base.base
        if weight_H is NONE:
            np.testing.assert_allclose(last.turn_33, turn_33, atol=1e-6)
            np.testing.assert_allclose(last.place_3[:2], start.place_3[:2] + [1.0, 0.0], atol=1e-6)
