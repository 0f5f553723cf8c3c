"""The five human poses in which a robot is shown: each tells another mistake of a robot's config. Where a config has a
whole body, legs and back take part.

Legend: P poses, J = 21 human joints. Human frame: x to the body's left, y up, z forward; at rest a T-pose, palms down.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.body.skeleton import POSED_JOINT_NAMES, mirror_rotations
from mrhubo.rotation import axis_angle_to_matrix

_QUARTER = torch.pi / 2
POSES: dict[str, dict[str, tuple[float, float, float]]] = {
    "T": {},
    "arms down": {"left_shoulder": (0.0, 0.0, -_QUARTER)},
    "forward": {"left_shoulder": (0.0, -_QUARTER, 0.0)},
    "elbows at right angles": {"left_shoulder": (0.0, 0.0, -_QUARTER), "left_elbow": (0.0, -_QUARTER, 0.0)},
    "hands up": {"left_shoulder": (-_QUARTER, 0.0, 0.0), "left_elbow": (0.0, -_QUARTER, 0.0)},
}
"""By name, the turns (axis-angle [rad]) of joints on the left; the right is their mirror image."""

_SQUAT = 0.8
LOWER_BODY: dict[str, tuple[str, dict[str, tuple[float, float, float]]]] = {
    "T": ("legs apart", {"left_hip": (0.0, 0.0, 0.35)}),
    "arms down": ("standing", {}),
    "forward": ("back bent", {f"spine{number}": (0.12, 0.0, 0.0) for number in (1, 2, 3)}),
    "elbows at right angles": (
        "squatting",
        {"left_hip": (-_SQUAT, 0.0, 0.0), "left_knee": (2 * _SQUAT, 0.0, 0.0), "left_ankle": (-_SQUAT, 0.0, 0.0)},
    ),
    "hands up": ("feet out", {"left_hip": (0.0, 0.5, 0.0)}),
}
"""What legs and back do meanwhile, in words and turns. A joint in the middle is its own mirror image, and turns twice
as far.
"""


def pose_names(whole_body: bool = False) -> list[str]:
    """What the poses are called, in their order."""
    return [f"{name}, {LOWER_BODY[name][0]}" if whole_body else name for name in POSES]


def human_poses(whole_body: bool = False) -> Tensor:
    """Local rotations (P, 21, 3, 3) of `POSES`, with those of `LOWER_BODY` where the whole body is shown."""
    left_PJ33 = torch.eye(3).repeat(len(POSES), len(POSED_JOINT_NAMES), 1, 1)
    for row, (pose, arms) in enumerate(POSES.items()):
        for name, turn in (arms | LOWER_BODY[pose][1] if whole_body else arms).items():
            left_PJ33[row, POSED_JOINT_NAMES.index(name)] = axis_angle_to_matrix(torch.tensor(turn))
    return left_PJ33 @ mirror_rotations(left_PJ33)
