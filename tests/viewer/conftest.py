from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo.motion import Motion, read_motion, trim
from mrhubo.robot import Robot
from mrhubo.robot_motion import RobotMotion
from mrhubo.viewer import Stage, arrange, perform, read_person

FRAMES = 7


@pytest.fixture(scope="session")
def nao(root: Path) -> Robot:
    return Robot.from_config(root / "conf" / "nao.yaml")


@pytest.fixture(scope="session")
def boxing(root: Path) -> Motion:
    """7 frames at 60 per second."""
    return trim(read_motion(root / "data" / "motions" / "boxing.npz"), 2.0, 2.1)


def random_motion(robot: Robot, frames: int = FRAMES, seed: int = 0, **more: object) -> RobotMotion:
    """Joint angles inside the limits, which no two frames share."""
    q_TN = robot.sample(frames, torch.Generator().manual_seed(seed)).numpy()
    return RobotMotion(q_TN, robot.joint_names, **{"frame_rate": 60.0, **more})  # pyright: ignore[reportArgumentType]


def walk(robot: Robot, frames: int = FRAMES) -> RobotMotion:
    """The base goes a metre to the left, and looks there."""
    place_T3 = np.column_stack([np.zeros(frames), np.linspace(0, 1, frames), np.full(frames, 0.3)])
    turn_T4 = np.tile([np.sqrt(0.5), 0, 0, np.sqrt(0.5)], (frames, 1))
    return random_motion(robot, frames, root_position=place_T3, root_quaternion_wxyz=turn_T4)


@pytest.fixture(scope="session")
def stage(nao: Robot, boxing: Motion) -> Stage:
    """A person, a robot whose confidence falls, and one that walks."""
    assert len(boxing) == FRAMES
    sure = random_motion(nao, confidence=np.linspace(1, 0, FRAMES))
    robots = [perform("nao", nao, sure), perform("walker", nao, walk(nao))]
    return arrange(read_person(boxing), robots)


@pytest.fixture(scope="session")
def walker(root: Path) -> Robot:
    """A robot whose keypoints tell of its feet."""
    return Robot.from_config(root / "conf" / "nao-whole-body.yaml")


def steps(robot: Robot, frames: int = FRAMES) -> RobotMotion:
    """As `walk`; the left foot is planted in even frames, the right one in the last."""
    told = [[frame % 2 == 0, frame == frames - 1] for frame in range(frames)]
    motion = walk(robot, frames)
    return dataclasses.replace(motion, contact=np.array(told), contact_names=("left_foot", "right_foot"))
