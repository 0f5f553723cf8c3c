"""A robot that cannot go the human's way goes its own way evenly, no faster than it can."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch
from torch import Tensor

from mrhubo.fast import FastRetargeter
from mrhubo.motion import Motion, read_motion, resample, trim
from mrhubo.reference import direction_jerk, trajectory
from mrhubo.retargeter import Retargeter, without_training
from mrhubo.retargeter.clip import join_frames
from mrhubo.retargeter.confidence import STANDARD
from mrhubo.robot import Robot
from tests.fast.exact import double, in_double

RATE = 30.0


@pytest.fixture(scope="module")
def reachy(root: Path) -> Retargeter:
    """Without its confidence, which takes seconds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(without_training, "calibrated", lambda _: STANDARD)
        return without_training.untrained(Robot.from_config(root / "conf" / "reachy.yaml"))


@pytest.fixture(scope="module")
def sweep(root: Path) -> Motion:
    """Arms go past Reachy's shoulders, so that they have to come to their other side."""
    return resample(trim(read_motion(root / "data" / "motions" / "straight_arms" / "arm_sweep.npz"), 1.2, 2.6), RATE)


def jerk(retargeter: Retargeter, q_TN: Tensor) -> float:
    body_map = retargeter.body_map
    directions_TD3 = body_map.robot_directions(body_map.robot.forward(q_TN))
    return float(direction_jerk(directions_TD3[:, body_map.measured], RATE).mean())


def test_it_is_smooth_in_every_form(reachy: Retargeter, sweep: Motion, monkeypatch: pytest.MonkeyPatch) -> None:
    body_map, robot = reachy.body_map, reachy.body_map.robot
    fast, exact = FastRetargeter(reachy.describe(), "numpy"), in_double(reachy)
    start_TN = torch.from_numpy(fast.predict(sweep, 10, avoid_collisions=False))
    with double():
        target_TD3 = exact.body_map.human_directions(sweep.local_TJ33.double())
        exact_TN = join_frames(exact.directions, start_TN.double(), target_TD3, RATE)
    fast_TN = torch.from_numpy(fast(sweep, avoid_collisions=False).q)
    torch.testing.assert_close(fast_TN, exact_TN.float(), atol=1e-4, rtol=0)

    target_TD3 = body_map.human_directions(sweep.local_TJ33)
    smooth_TN = join_frames(reachy.directions, start_TN, target_TD3, RATE)
    assert bool((smooth_TN.diff(dim=0).abs() * RATE <= robot.velocity_N).all())
    assert bool(((smooth_TN >= robot.lower_N) & (smooth_TN <= robot.upper_N)).all())
    monkeypatch.setattr(trajectory, "smooth_detours", lambda _, q_TN, __, smoothness, *___: (q_TN, smoothness))
    rough_TN = join_frames(reachy.directions, start_TN, target_TD3, RATE)
    human = float(direction_jerk(target_TD3[:, body_map.measured], RATE).mean())
    assert jerk(reachy, rough_TN) > 2 * human and jerk(reachy, smooth_TN) < 0.7 * jerk(reachy, rough_TN)
