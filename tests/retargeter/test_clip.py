"""Answers that were found frame by frame become one motion: slow enough, without jumps, as smooth as the human."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch
from torch import Tensor

from mrhubo.body import BodyPrior
from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.motion import Motion, read_motion
from mrhubo.reference import OptimizationRetargeter, count_jumps, direction_error, direction_jerk
from mrhubo.retargeter import Retargeter, build_network
from mrhubo.retargeter.clip import calmness, join_frames
from mrhubo.robot import BodyMap, build_body_map


@pytest.fixture(scope="module")
def optimizer(root: Path) -> OptimizationRetargeter:
    return OptimizationRetargeter(build_body_map(load_config(root / "conf" / "nao.yaml").robot))


@pytest.fixture(scope="module")
def made(optimizer: OptimizationRetargeter, root: Path) -> Retargeter:
    config, body_map = load_config(root / "conf" / "nao.yaml", ["model.hidden=16"]), optimizer.body_map
    torch.manual_seed(0)
    return Retargeter(build_network(config, body_map), body_map, BodyPrior.open(), config, phi_threshold=0.01)


def part_of(path: Path, first: int, last: int) -> Motion:
    motion = read_motion(path)
    return Motion(motion.name, motion.local_TJ33[first:last], motion.frame_rate)


def jerk(body_map: BodyMap, directions_TD3: Tensor, rate: float) -> float:
    return float(direction_jerk(directions_TD3[:, body_map.measured], rate).mean())


@pytest.mark.parametrize(
    ("name", "first", "last", "most_deg"),
    [("pointing", 380, 520, 1.0), ("wave", 60, 200, 0.2), ("straight_arms/hanging_noise", 0, 140, 0.3)],
)
def test_a_motion_without_jumps(
    optimizer: OptimizationRetargeter, root: Path, name: str, first: int, last: int, most_deg: float
) -> None:
    """Where frame by frame the joints run faster than they can, and jump."""
    motion = part_of(root / "data" / "motions" / f"{name}.npz", first, last)
    body_map, rate = optimizer.body_map, motion.frame_rate
    robot, target_TD3 = body_map.robot, body_map.human_directions(motion.local_TJ33)
    frames_TN, _ = optimizer.solve_frames(motion.local_TJ33)
    q_TN = join_frames(optimizer.problem, frames_TN, target_TD3, rate)
    if name != "wave":
        assert count_jumps(optimizer.problem, frames_TN, target_TD3, rate) > 0
        assert bool((frames_TN.diff(dim=0).abs() * rate > robot.velocity_N).any())
    assert count_jumps(optimizer.problem, q_TN, target_TD3, rate) == 0
    assert bool((q_TN.diff(dim=0).abs() * rate <= robot.velocity_N).all())
    assert bool(((q_TN >= robot.lower_N) & (q_TN <= robot.upper_N)).all())
    before, after = (direction_error(body_map, q, motion.local_TJ33).mean() for q in (frames_TN, q_TN))
    assert float(after - before) < most_deg
    robot_jerk = jerk(body_map, body_map.robot_directions(robot.forward(q_TN)), rate)
    if name == "wave":
        assert robot_jerk < 1.5 * jerk(body_map, target_TD3, rate)
        assert robot_jerk < jerk(body_map, body_map.robot_directions(robot.forward(frames_TN)), rate)


def test_a_jerky_human_is_followed(optimizer: OptimizationRetargeter) -> None:
    """The weight is the less, the more the directions jerk that a joint turns; and none over fewer than four frames."""
    problem, body_map = optimizer.problem, optimizer.body_map
    q_TN = problem.robot.home().repeat(40, 1)
    arm = [n for n, name in enumerate(problem.robot.joint_names) if name.startswith("L")]
    q_TN[:, arm] += 0.1 * torch.randn(40, 1, generator=torch.Generator().manual_seed(0))
    calm_YC = calmness(problem, body_map.robot_directions(problem.robot.forward(q_TN)), 30.0)
    assert calm_YC.shape == (37, 2)
    left = int(problem.blocks.block_N[arm[0]])
    assert float(calm_YC[:, left].max()) < 0.1 * float(calm_YC[:, 1 - left].min())
    few_TD3 = body_map.robot_directions(problem.robot.forward(q_TN[:3]))
    assert calmness(problem, few_TD3, 30.0).shape == (0, 2)
    for frames in (0, 1, 2, 3, 4):
        target_TD3 = body_map.robot_directions(problem.robot.forward(q_TN[:frames])) if frames else few_TD3[:0]
        assert join_frames(problem, q_TN[:frames], target_TD3, 30.0).shape == (frames, 8)


def test_motions_are_answered_together_and_poses_alone(made: Retargeter, root: Path) -> None:
    motion = part_of(root / "data" / "motions" / "wave.npz", 60, 72)
    pose, rate = motion.local_TJ33, motion.frame_rate
    alone, together = made(pose), made(motion)
    assert not torch.equal(alone.q, together.q)
    for same in (made(pose, frame_rate=rate), made(pose, frame_rate=rate, together=True), made.retarget(motion)):
        assert torch.equal(same.q, together.q)
    assert torch.equal(made.predict(pose, 10, rate), together.q)
    assert torch.equal(made(motion, together=False).q, alone.q) and made(motion, together=False).frame_rate == rate
    two = made(pose.unflatten(0, (2, 6)), frame_rate=rate)
    for found, part in zip(two.q, pose.split(6), strict=True):  # motions of their own
        torch.testing.assert_close(found, made(part, frame_rate=rate).q)
    assert made(pose[0], frame_rate=rate).q.shape == (8,)
    assert made(pose[:0], frame_rate=rate).q.shape == (0, 8)
    with pytest.raises(UserError, match="together=True needs the frame rate"):
        made(pose, together=True)
