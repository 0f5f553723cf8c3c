"""Parts of a human body that a robot can have: limbs, which have one direction, and oriented ends, which have two."""

from __future__ import annotations

import torch
from torch import Tensor

SIDES = ("left", "right")
LIMBS = (("shoulder", "elbow"), ("elbow", "wrist"))
"""Inner and outer joint of a side's limbs."""
POINTS = tuple(f"{side}_{part}" for side in SIDES for part in ("shoulder", "elbow", "wrist"))
ENDS = {"left_hand": ("fingers", "thumb"), "right_hand": ("fingers", "thumb"), "head": ("forward", "up")}
"""Oriented ends, and what their two directions are called."""
HAND_POINTS = ("thumb", "index", "middle", "pinky")


def limb_of(end: str) -> tuple[str, str]:
    """Names of a limb's two joints from its outer one."""
    side, part = end.split("_")
    return f"{side}_{dict((b, a) for a, b in LIMBS)[part]}", end


def joint_of(end: str) -> str:
    """The human joint that turns an oriented end."""
    return end.replace("hand", "wrist")


def human_axes(end: str) -> Tensor:
    """The two unit directions (2, 3) of an oriented end of the human at rest: fingers and thumb, or forward and up."""
    if end == "head":
        return torch.tensor([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    return torch.tensor([[1.0 if end.startswith("left") else -1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def turn_of(end: str, first: Tensor, second: Tensor) -> Tensor:
    """The rotation (..., 3, 3) that takes an end at rest to two directions (..., 3), unit and orthogonal."""
    return _columns(first, second) @ _columns(*human_axes(end).to(first)).T


def _columns(first: Tensor, second: Tensor) -> Tensor:
    return torch.stack((first, second, torch.linalg.cross(first, second)), dim=-1)
