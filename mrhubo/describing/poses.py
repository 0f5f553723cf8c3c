"""The five human poses in which a robot is shown: each tells another mistake of a robot's config.

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


def human_poses() -> Tensor:
    """Local rotations (P, 21, 3, 3) of `POSES`."""
    left_PJ33 = torch.eye(3).repeat(len(POSES), len(POSED_JOINT_NAMES), 1, 1)
    for row, turns in enumerate(POSES.values()):
        for name, turn in turns.items():
            left_PJ33[row, POSED_JOINT_NAMES.index(name)] = axis_angle_to_matrix(torch.tensor(turn))
    return left_PJ33 @ mirror_rotations(left_PJ33)
