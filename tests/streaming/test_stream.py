"""A stream: no jump, no limit exceeded, the best answer where the human stands still."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

import mrhubo
from mrhubo import rotation
from mrhubo.errors import UserError
from mrhubo.motion import Motion, read_motion
from mrhubo.reference import OptimizationRetargeter, count_jumps
from mrhubo.retargeter import Retargeter
from mrhubo.streaming import Stream, StreamSettings
from tests.poses import prior_poses

Hanging = Callable[..., Motion]


@pytest.fixture(scope="module")
def wave(root: Path) -> Tensor:
    """A fifth of a second of a motion."""
    return read_motion(root / "data" / "motions" / "wave.npz").local_TJ33[100:112]


def inside(retargeter: Retargeter, q: Tensor) -> bool:
    robot = retargeter.body_map.robot
    return bool(((q >= robot.lower_N) & (q <= robot.upper_N)).all())


def test_no_limit_is_exceeded_whatever_comes_in(retargeter: Retargeter, wave: Tensor) -> None:
    generator, robot = torch.Generator().manual_seed(0), retargeter.body_map.robot
    stream, time, last, last_time = Stream(retargeter), 0.0, None, 0.0
    for frame in range(36):
        kind = frame % 6
        pose: Tensor | None = wave[frame % 12]
        if kind == 1:
            pose = rotation.axis_angle_to_matrix(3 * torch.randn(21, 3, generator=generator))
        elif kind == 2:
            pose = None
        elif kind == 3:
            assert pose is not None
            pose = pose.clone()
            pose[3, 1, 1] = torch.nan if frame % 2 else -torch.inf
        time += float(10 ** (-3 * torch.rand(1, generator=generator)))
        answer = stream(pose, time)
        assert answer.q.shape == (8,) and inside(retargeter, answer.q)
        assert 0 <= float(answer.confidence) <= 1 and (kind not in (2, 3) or float(answer.confidence) == 0)
        assert bool(answer.direction_error_deg.isfinite().all()) and bool(answer.phi.isfinite())
        if last is not None:
            moved = (answer.q.double() - last.double()).abs() / (time - last_time)
            assert bool((moved <= robot.velocity_N).all()), frame
        last, last_time = answer.q, time


def test_who_stands_still_gets_the_frames_own_optimum_and_the_robot_stays_there(retargeter: Retargeter) -> None:
    pose = prior_poses(8, 1)
    best, _ = OptimizationRetargeter(retargeter.body_map).solve_frames(pose)
    optimum = retargeter.judge(best, pose).direction_error_deg.mean(dim=1)
    stream = Stream(retargeter, people=8, settings=StreamSettings(avoid_collisions=False))
    stream.reset(retargeter.body_map.robot.home().expand(8, -1))
    for _ in range(49):
        stream.joints(pose)
    answer = stream(pose)
    assert float((answer.direction_error_deg.mean(dim=1) - optimum).max()) < 0.5
    assert float((stream.joints(pose) - answer.q).abs().max()) < 2e-3


def test_a_straight_arm_seen_with_noise_hangs_still(retargeter: Retargeter, hanging: Hanging) -> None:
    motion = hanging(2.0, 80)
    target = retargeter.body_map.human_directions(motion.local_TJ33)
    alone, stream = retargeter.predict(motion, 10), Stream(retargeter).retarget(motion).q
    jumps = [count_jumps(retargeter.directions, q, target, 60.0) for q in (alone, stream)]
    assert jumps[0] > 3 and jumps[1] == 0
    fastest = [float(q.diff(dim=0).abs().max()) * 60 for q in (alone, stream)]
    assert fastest[1] <= float(retargeter.body_map.robot.velocity_N.max()) < 0.1 * fastest[0]


def test_a_motion_is_its_frames_one_after_the_other(retargeter: Retargeter, wave: Tensor) -> None:
    stream = Stream(retargeter, rate=60)
    frames = torch.stack([stream(pose).q for pose in wave])
    motion = Motion("wave", wave, 60.0)
    found = stream.retarget(motion)
    assert torch.equal(found.q, stream.retarget(motion).q), "the same again"
    torch.testing.assert_close(found.q, frames, atol=1e-3, rtol=0)
    assert found.frame_rate == 60.0 and found.confidence.shape == (12,)
    turns = rotation.matrix_to_axis_angle(wave).flatten(1).numpy()
    stream.reset()
    again = torch.stack([stream.joints(turn, time=5 + i / 60) for i, turn in enumerate(turns)])
    torch.testing.assert_close(again, frames, atol=1e-3, rtol=0)


def test_several_people_and_motions_know_nothing_of_each_other(retargeter: Retargeter, wave: Tensor) -> None:
    motions = [
        Motion("a", wave, 60.0),
        Motion("b", wave[:6].flip(0), 60.0),
        Motion("c", wave[:7], 24.0),
        Motion("d", wave[:0], 60.0),
    ]
    stream = Stream(retargeter)
    together = stream.retarget_all(motions)
    for motion, found in zip(motions, together, strict=True):
        assert found.frame_rate == motion.frame_rate
        torch.testing.assert_close(found.q, stream.retarget(motion).q, atol=1e-3, rtol=0)
    pair = Stream(retargeter, people=2)
    late = wave[:2].clone()
    late[1, 0] = torch.nan  # the second one comes later
    assert pair(late).confidence[1] == 0
    both = torch.stack([pair(torch.stack((pose, pose))).q for pose in wave[1:]])
    torch.testing.assert_close(both[:, 0], together[0].q[1:], atol=1e-3, rtol=0)
    assert float((both[:, 0] - both[:, 1]).abs().max()) < 0.1 or inside(retargeter, both[:, 1])


def test_the_robot_goes_from_where_it_stands(retargeter: Retargeter, wave: Tensor) -> None:
    robot, stream = retargeter.body_map.robot, Stream(retargeter)
    free = stream.joints(wave[0])
    stream.reset(robot.upper_N.numpy())
    first = stream.joints(wave[0], time=77.0)
    assert bool(((first - robot.upper_N).abs() <= robot.velocity_N / 60).all()) and not torch.equal(first, free)
    for _ in range(50):
        last = stream.joints(wave[0])
    torch.testing.assert_close(
        retargeter.judge(last[None], wave[:1]).direction_error_deg,
        retargeter.judge(free[None], wave[:1]).direction_error_deg,
        atol=0.5, rtol=0,
    )  # fmt: skip
    stream.reset()
    assert torch.equal(stream.joints(wave[0]), free)
    stream.reset()
    assert torch.equal(stream.joints(None), robot.home())
    assert bool(((stream.joints(wave[0]) - robot.home()).abs() <= robot.velocity_N / 60).all())


def test_a_gap_is_no_leap(retargeter: Retargeter, wave: Tensor) -> None:
    robot, stream = retargeter.body_map.robot, Stream(retargeter)
    before = stream.joints(wave[0], 0.0)
    after = stream.joints(wave[0].flip(0), 60.0)
    assert bool(((after - before).abs() <= robot.velocity_N * stream.settings.longest_gap + 1e-6).all())
    for frame in range(30):
        held = stream.joints(None, 60.0 + (frame + 1) / 60)
    assert float((stream.joints(None) - held).abs().max()) < 1e-6


def test_times(retargeter: Retargeter, wave: Tensor) -> None:
    stream = Stream(retargeter, rate=30)
    stream.joints(wave[0], 1.0)
    answer = stream.joints(wave[3], np.float64(1.02))
    assert torch.equal(stream.joints(wave[9], 1.02), answer), "a time that has been answered"
    for time in (1.01, math.nan, math.inf, "1", True):
        with pytest.raises(UserError, match="stream: (time goes back|the time of a frame)"):
            stream.joints(wave[3], time)  # type: ignore[arg-type]
    stream.joints(wave[3])
    with pytest.raises(UserError, match="goes back"):
        stream.joints(wave[3], 1.04)


@pytest.mark.parametrize("shape", [(2, 21, 3, 3), (63, 1), (5,), (20, 3, 3), ()])
def test_what_is_no_pose_is_refused_and_changes_nothing(retargeter: Retargeter, wave: Tensor, shape: tuple) -> None:
    one, other = Stream(retargeter), Stream(retargeter)
    one.joints(wave[0])
    with pytest.raises(UserError):
        one.joints(torch.zeros(shape))
    with pytest.raises(UserError, match="no rotation"):
        one.joints(1.5 * wave[1])
    other.joints(wave[0])
    assert torch.equal(one.joints(wave[1]), other.joints(wave[1]))


def test_what_a_stream_cannot_be(retargeter: Retargeter) -> None:
    assert mrhubo.Stream is Stream
    wrongs: tuple[dict[str, Any], ...] = (
        {"rate": 0},
        {"rate": math.nan},
        {"people": 0},
        {"people": 1.5},
        {"people": True},
    )
    for wrong in wrongs:
        with pytest.raises(UserError):
            Stream(retargeter, **wrong)
    stream = Stream(retargeter, settings=StreamSettings(worse_deg=0, worse_time=0, smoothness=0, rest_time=0))
    for q in (torch.zeros(7), torch.full((8,), 9.0), torch.full((8,), torch.nan)):
        with pytest.raises(UserError, match="stream: q"):
            stream.reset(q)
