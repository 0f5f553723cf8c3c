"""All frames of a motion together: PyTorch's numbers, in every form."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.fast import FastRetargeter
from mrhubo.fast.answers import Engine
from mrhubo.fast.engines import FORMS
from mrhubo.fast.together import motion as together
from mrhubo.fast.together.banded import Banded, halve
from mrhubo.motion import Motion, resample
from mrhubo.reference import trajectory
from mrhubo.retargeter import Retargeter
from mrhubo.retargeter.clip import join_frames
from mrhubo.robot_motion import RobotMotion
from tests.fast.exact import double, in_double

RATE = 40.0
SAME_RAD = 1e-5
"""Where PyTorch works in float64. Either ends its steps where they have become small, which rounding decides."""


@pytest.fixture(scope="module", autouse=True)
def _one_thread(one_thread: None) -> None:
    """Small batches."""


@pytest.fixture(scope="module")
def motion(poses: Tensor) -> Motion:
    """From one pose to the next in a fifth of a second: faster than robots are, and out of their reach in part."""
    return resample(Motion("some", poses[20:23], 5.0, source="nowhere"), RATE)


@pytest.fixture(scope="module", params=FORMS)
def fast(retargeter: Retargeter, request: pytest.FixtureRequest) -> FastRetargeter:
    if request.param == "compiled":
        pytest.importorskip("numba")
    return FastRetargeter(retargeter.describe(), request.param)


@pytest.fixture(scope="module")
def answered(fast: FastRetargeter, motion: Motion) -> RobotMotion:
    """What a form makes of the motion."""
    return fast(motion)


def wanted(retargeter: Retargeter, fast: FastRetargeter, motion: Motion) -> np.ndarray:
    """What PyTorch makes of the same answers, in float64."""
    exact, start_TN = in_double(retargeter), fast.predict(motion, 10, avoid_collisions=False)
    with double():
        target_TD3 = exact.body_map.human_directions(motion.local_TJ33.double())
        start_TN = torch.from_numpy(start_TN).double()
        return join_frames(exact.directions, start_TN, target_TD3, motion.frame_rate, exact.avoidance).numpy()


def test_a_motion_is_pytorchs(
    fast: FastRetargeter, answered: RobotMotion, retargeter: Retargeter, motion: Motion
) -> None:
    cost, found = fast.description.cost, answered
    assert np.abs(found.q - wanted(retargeter, fast, motion)).max() < SAME_RAD
    assert (np.abs(np.diff(found.q, axis=0)) * RATE <= cost.velocity_N).all()
    assert ((found.q >= cost.lower_N) & (found.q <= cost.upper_N)).all()
    assert (found.name, found.source, found.frame_rate) == ("some", "nowhere", RATE)


def test_the_motion_is_one_that_bounds_hold(make: Callable[[str], Retargeter], motion: Motion) -> None:
    fast = FastRetargeter(make("nao").describe(), "numpy")
    cost, alone_TN, found_TN = fast.description.cost, fast.predict(motion, 10), fast(motion).q
    step_TN = np.abs(np.diff(alone_TN, axis=0))
    assert np.abs(fast(motion, avoid_collisions=False).q - found_TN).max() > 0.01
    assert (step_TN > together.JUMP).any() and (step_TN * RATE > cost.velocity_N).any()
    assert (np.abs(np.diff(found_TN, axis=0)) * RATE > 0.99 * cost.velocity_N).any()
    assert ((found_TN <= cost.lower_N + 1e-6) | (found_TN >= cost.upper_N - 1e-6)).any()


def test_what_is_told_is_of_the_smooth_motion(answered: RobotMotion, retargeter: Retargeter, motion: Motion) -> None:
    found = answered
    told = retargeter.judge(torch.from_numpy(found.q), motion.local_TJ33, RATE)
    for name, most in (("confidence", 1e-4), ("direction_error_deg", 2e-3), ("phi", 1e-4), ("collision", 0)):
        assert np.abs(getattr(found, name).astype(float) - getattr(told, name).double().numpy()).max() <= most, name


def test_each_frame_on_its_own(fast: FastRetargeter, answered: RobotMotion, motion: Motion) -> None:
    alone = fast(motion, together=False)
    assert alone.q is not None and np.abs(alone.q - fast.predict(motion, 10)).max() < 2e-6
    assert np.abs(alone.q - answered.q).max() > 0.1
    with pytest.raises(UserError, match="needs the frame rate"):
        fast(motion.local_TJ33.numpy(), together=True)


def test_motions_side_by_side_are_motions_of_their_own(make: Callable[[str], Retargeter], motion: Motion) -> None:
    fast = FastRetargeter(make("nao").describe(), "numpy")
    several = motion.local_TJ33[:16].numpy().reshape(2, 8, 21, 3, 3)
    found = fast(several, frame_rate=RATE).q
    for one, q_TN in zip(several, found, strict=True):
        np.testing.assert_allclose(fast(one, frame_rate=RATE).q, q_TN, atol=SAME_RAD)


@pytest.mark.parametrize("frames", [0, 1, 2, 3, 4, 5])
def test_short_motions(make: Callable[[str], Retargeter], motion: Motion, frames: int) -> None:
    nao = make("nao")
    fast, short = FastRetargeter(nao.describe(), "numpy"), Motion("", motion.local_TJ33[10 : 10 + frames], RATE)
    assert np.abs(fast(short).q - wanted(nao, fast, short)).max(initial=0.0) < SAME_RAD


def test_windows(make: Callable[[str], Retargeter], motion: Motion, monkeypatch: pytest.MonkeyPatch) -> None:
    nao = make("nao")
    fast, whole = FastRetargeter(nao.describe(), "numpy"), FastRetargeter(nao.describe(), "numpy")(motion).q
    for module in (trajectory, together):
        monkeypatch.setattr(module, "WINDOW", 12)
        monkeypatch.setattr(module, "AHEAD", 4)
    found = fast(motion).q
    assert np.abs(found - wanted(nao, fast, motion)).max() < SAME_RAD
    assert np.abs(found - whole).max() > 0


@pytest.fixture(scope="module")
def factors(make: Callable[[str], Retargeter]) -> list[Callable]:
    pytest.importorskip("numba")
    engine: Engine = FastRetargeter(make("nao").describe(), "compiled").engine
    found = [halve, engine.problem.factor]
    for factor in found:  # is compiled by now
        factor(Banded(np.zeros((2, 1, 1)), np.ones((2, 1)), [np.zeros((1, 1, 1))]))(np.ones((2, 1)))
    return found


@given(st.integers(2, 23), st.integers(1, 5), st.integers(0, 1000))
def test_banded_systems(factors: list[Callable], frames: int, joints: int, seed: int) -> None:
    """Against the whole matrix."""
    generator = np.random.default_rng(seed)
    reach = min(3, frames - 1)
    within_TMM = generator.normal(size=(frames, joints, joints))
    couplings = [generator.normal(size=(frames - lag, joints, joints)) for lag in range(1, reach + 1)]
    dense = np.zeros((frames, joints, frames, joints))
    for t in range(frames):
        dense[t, :, t] = np.tril(within_TMM[t], -1)
        for lag, coupling in enumerate(couplings[: frames - 1 - t], start=1):
            dense[t + lag, :, t] = coupling[t]
    dense = dense.reshape(frames * joints, -1)
    dense += dense.T
    diagonal = np.abs(dense).sum(axis=1) + 0.1
    system = Banded(within_TMM, diagonal.reshape(frames, joints), couplings)
    right = generator.normal(size=(frames, joints))
    found = np.linalg.solve(dense + np.diag(diagonal), right.ravel()).reshape(right.shape)
    for factor in factors:
        np.testing.assert_allclose(factor(system)(right), found, atol=1e-9)
    np.testing.assert_allclose(system.times(found), right, atol=1e-9)
