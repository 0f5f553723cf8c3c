"""A robot moves the same, however its file is written: names, order, signs of axes, where it lies, and its size."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import load_config
from mrhubo.describing.yaml_file import keypoint_entries
from mrhubo.reference import OptimizationRetargeter
from mrhubo.robot import Robot
from mrhubo.robot.discovery import discover
from mrhubo.robot.generator.variants import variant
from mrhubo.robot.urdf import Description, describe
from mrhubo.runtime.locations import project_root

FORMS = {
    "renamed": {"rename": True},
    "reordered": {"reorder": True},
    "axes negated": {"negate": True},
    "y up": {"turn": (math.pi / 2, 0.0, 0.0)},
    "turned": {"turn": (0.4, 2.0, -1.0)},
    "scaled": {"scale": 3.0},
}  # fmt: skip
SAME = 1e-3
"""Radians."""


def motion_of(description: Description, poses_TJ33: Tensor, whole_body: bool = False) -> dict[str, np.ndarray]:
    """Angles (T,) of each joint, of the mapping that is detected."""
    found = discover(description, whole_body)
    ranges = {joint: [limits.lower, limits.upper] for joint, limits in found.ranges.items()}
    robot = Robot.from_urdf(description, found.joints, keypoint_entries(found), found.key_links, ranges)
    q_TN = OptimizationRetargeter(robot).retarget(poses_TJ33, 24.0).q_TN
    return dict(zip(robot.joint_names, q_TN.T.numpy(), strict=True))


def make_pose(**axis_angles: Tensor) -> Tensor:
    """Local rotations (T, 21, 3, 3) from axis-angles (T, 3) [rad] by joint name; the other joints at rest."""
    whole = torch.zeros(len(next(iter(axis_angles.values()))), len(POSED_JOINT_NAMES), 3)
    for name, value in axis_angles.items():
        whole[:, POSED_JOINT_NAMES.index(name)] = value
    return rotation.axis_angle_to_matrix(whole)


ALL = {"all at once": {"rename": True, "reorder": True, "negate": True, "turn": (0.4, 2.0, -1.0), "scale": 3.0}}


@pytest.mark.parametrize(
    ("robot", "forms"), [("nao", FORMS), ("coman", ALL), ("reachy", ALL)], ids=["nao", "coman", "reachy"]
)
def test_same_motion_however_the_file_is_written(
    robot: str, forms: Mapping[str, Mapping[str, Any]], tmp_path: Path
) -> None:
    bend_T = torch.linspace(0.3, 1.2, 4)
    zero_T = torch.zeros(4)
    poses_TJ33 = make_pose(
        left_shoulder=torch.stack((zero_T, 0.2 * bend_T, bend_T - 1.4), 1),
        left_elbow=torch.stack((zero_T, -bend_T, zero_T), 1),
        right_shoulder=torch.stack((zero_T, -0.4 * bend_T, 1.2 - bend_T), 1),
        right_elbow=torch.stack((zero_T, 0.8 * bend_T, zero_T), 1),
    )
    check_forms(robot, forms, poses_TJ33, tmp_path)


@pytest.mark.parametrize("robot", ["nao", "coman", "g1"])
def test_same_whole_body_however_the_file_is_written(robot: str, tmp_path: Path) -> None:
    bend_T, zero_T = torch.linspace(0.2, 0.6, 3), torch.zeros(3)
    poses_TJ33 = make_pose(
        left_hip=torch.stack((-bend_T, zero_T, 0.2 * bend_T), 1),
        left_knee=torch.stack((1.5 * bend_T, zero_T, zero_T), 1),
        right_hip=torch.stack((0.3 * bend_T, 0.2 * bend_T, zero_T), 1),
        right_knee=torch.stack((0.5 * bend_T, zero_T, zero_T), 1),
        right_ankle=torch.stack((-0.3 * bend_T, zero_T, zero_T), 1),
        spine2=torch.stack((0.5 * bend_T, 0.3 * bend_T, zero_T), 1),
        left_shoulder=torch.stack((zero_T, 0.2 * bend_T, bend_T - 1.4), 1),
        left_elbow=torch.stack((zero_T, -0.6 - bend_T, zero_T), 1),
        right_shoulder=torch.stack((zero_T, -0.4 * bend_T, 1.2 - bend_T), 1),
        right_elbow=torch.stack((zero_T, 0.6 + bend_T, zero_T), 1),
    )
    check_forms(f"{robot}-whole-body", ALL, poses_TJ33, tmp_path, whole_body=True)


def check_forms(
    config: str, forms: Mapping[str, Mapping[str, Any]], poses_TJ33: Tensor, folder: Path, whole_body: bool = False
) -> None:
    urdf = load_config(project_root() / f"conf/{config}.yaml").robot.urdf
    if not urdf.exists():
        pytest.skip("the further robots are not in this checkout")
    original = describe(urdf)
    expected = motion_of(original, poses_TJ33, whole_body)
    for form, changes in forms.items():
        file = folder / "robot.urdf"
        text, names = variant(original.path, seed=1, **changes)
        file.write_text(text)
        description = describe(file)
        moved = motion_of(description, poses_TJ33, whole_body)
        assert {names.get(joint, joint) for joint in expected} == set(moved), form
        for joint, angle_T in expected.items():
            new = names.get(joint, joint)
            sign = float(np.sign(original.joints[joint].axis_3 @ description.joints[new].axis_3))
            assert np.abs(sign * moved[new] - angle_T).max() < SAME, f"{form}: '{joint}'"
