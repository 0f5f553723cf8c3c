"""What a retargeter answers, and how that is saved."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field

import torch
from torch import Tensor

from mrhubo.reference.result import Answer
from mrhubo.robot_motion import RobotFacts


@dataclass(frozen=True, eq=False)
class RetargetResult(Answer):
    """Joint angles and how far to trust them; T stands for the leading axes of the human poses, none for a single pose.

    N robot joints, D directions (limbs, hands, head), C branches, F feet.
    """

    q: Tensor
    """Joint angles (T, N) [rad], inside the limits."""
    joint_names: tuple[str, ...]
    """The N joints, by their names in the URDF."""
    confidence: Tensor
    """(T,), 0..1: that of the least certain branch, see `branch_confidence`."""
    direction_error_deg: Tensor
    """Angle (T, D) [deg] between the robot's and the human's limb, hand and head directions."""
    phi: Tensor
    """Reconstruction error (T,) under the body prior of what the robot reads of the human pose, of the branch where it
    is largest; see `mrhubo.robot.plausibility`."""
    collision: Tensor | None
    """Whether the robot touches itself (T,), by its URDF's collision shapes; the networks do not avoid it, and what
    comes after them does nearly always. None: shapes of what moves are missing, so it is not known."""
    branch_confidence: Tensor
    """(T, C), 0..1: the probability that the limbs of each branch of the robot, an arm or the head, point where the
    person's did, to 15 degrees; see `mrhubo.retargeter.confidence`."""
    branch_names: tuple[str, ...]
    """The C branches: `left_arm` and so on."""
    direction_names: tuple[str, ...] = ()
    """The D directions."""
    frame_rate: float | None = None
    """Frames per second, where the motion told it."""
    name: str = ""
    """The motion's name, where it has one."""
    source: str = ""
    """What the motion was read from, in words."""
    robot: RobotFacts = field(default_factory=RobotFacts)
    """What is known of the robot, and of who answered."""
    root_position: Tensor | None = None
    """Place (T, 3) [m] of the robot's base in the world: x forward, y left, z up, the floor at z = 0; None where the
    robot has no feet, or the motion tells no root."""
    root_quaternion_wxyz: Tensor | None = None
    """Rotation (T, 4) of the base in the world, a unit quaternion, w first; None where there is no place."""
    contact: Tensor | None = None
    """Whether each foot is planted (T, F), bool; None where there is no place of the base."""
    contact_names: tuple[str, ...] = ()
    """The F feet."""

    def with_leading(
        self, shape: tuple[int, ...], frame_rate: float | None, name: str = "", source: str = ""
    ) -> RetargetResult:
        """The same with other leading axes, for as many frames, and what is known of the motion."""
        tensors = {
            field: tensor.unflatten(0, shape) if shape else tensor[0]
            for field in _TENSORS
            if (tensor := getattr(self, field)) is not None
        }
        return dataclasses.replace(self, **tensors, frame_rate=frame_rate, name=name, source=source)


_TENSORS = ("q", "confidence", "direction_error_deg", "phi", "collision", "branch_confidence", "root_position",
            "root_quaternion_wxyz", "contact")  # fmt: skip


def join_results(parts: Sequence[RetargetResult]) -> RetargetResult:
    """One result of those of a motion's parts, one after the other; without a frame rate."""
    known = [name for name in _TENSORS if getattr(parts[0], name) is not None]
    tensors = {name: torch.cat([getattr(part, name) for part in parts]) for name in known}
    return dataclasses.replace(parts[0], **tensors, frame_rate=None)
