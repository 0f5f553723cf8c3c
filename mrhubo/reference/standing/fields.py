"""What an answer tells of a robot on its floor.

Legend: T frames, S feet.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.reference.standing.legs import Legs


def standing_fields(position_T3: Tensor, rotation_T33: Tensor, planted_TS: np.ndarray, legs: Legs) -> dict[str, Any]:
    """What an answer tells of a robot on its floor, by the names of `RobotMotion`.

    Args:
        position_T3: place of the base in the robot's world [m].
        rotation_T33: its rotation there.
        planted_TS: whether each foot is planted.
        legs: the robot's.
    """
    return {
        "root_position": position_T3,
        "root_quaternion_wxyz": continuous(rotation.matrix_to_quaternion(rotation_T33)[:, [3, 0, 1, 2]]),
        "contact": torch.from_numpy(planted_TS).to(position_T3.device),
        "contact_names": tuple(sole.part.name for sole in legs.soles),
    }


def continuous(quaternion_T4: Tensor) -> Tensor:
    """Unit quaternions that go on from one another without a change of sign."""
    turns_T = (quaternion_T4[1:] * quaternion_T4[:-1]).sum(-1) < 0
    sign_T = torch.nn.functional.pad(1.0 - 2.0 * turns_T.to(quaternion_T4), (1, 0), value=1.0).cumprod(0)
    return quaternion_T4 * sign_T[:, None]
