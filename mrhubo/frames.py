"""The axes of the three frames, and the turns from one to another.

* human: x to the body's left, y up, z forward, as SMPL has it;
* base: the frame of the robot's root link, x forward, y left, z up, as REP 103 has it;
* world: what pictures are made in; the same axes as base.

The three are right-handed, and turning from one to another only puts the coordinates in another order.
"""

from __future__ import annotations

from typing import Any, TypeVar

import torch
from torch import Tensor

HUMAN_AXES = ("left", "up", "forward")
"""Where x, y and z of the human frame point."""
BASE_AXES = ("forward", "left", "up")
"""Where x, y and z of the base frame point, and of the world frame."""

_HUMAN_FROM_BASE = [BASE_AXES.index(axis) for axis in HUMAN_AXES]
_BASE_FROM_HUMAN = [HUMAN_AXES.index(axis) for axis in BASE_AXES]

Array = TypeVar("Array", bound=Any)
"""A tensor or an array of numpy."""


def base_to_human(points: Array) -> Array:
    """Points or directions (..., 3) of the base frame, in the human frame."""
    return points[..., _HUMAN_FROM_BASE]


def human_to_world(points: Array) -> Array:
    """Points or directions (..., 3) of the human frame, in the world frame."""
    return points[..., _BASE_FROM_HUMAN]


def human_axes(forward_up_23: Tensor) -> Tensor:
    """Columns (3, 3): the human's left, up and forward, from two orthonormal directions (2, 3) of any frame.

    As a matrix it turns directions of the human frame into those of the frame in which the two are given.
    """
    forward, up = forward_up_23
    return torch.stack((torch.linalg.cross(up, forward), up, forward), dim=-1)
