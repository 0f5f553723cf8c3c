"""What the optimiser answers when it is called like a retargeter, and how that is saved."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from torch import Tensor

from mrhubo.robot_motion import JointOrder, RobotFacts, RobotMotion, write_robot_motion


@dataclass(frozen=True, eq=False)
class Answer:
    """What any answer in PyTorch's tensors can do. Each of its fields is a field of `RobotMotion`."""

    @property
    def robot_motion(self) -> RobotMotion:
        """The same without PyTorch, which any program can read from a file (`mrhubo.robot_motion`)."""
        return RobotMotion(**{f.name: _without_torch(getattr(self, f.name)) for f in fields(self)})

    def save(
        self, path: Path | str, format: str | None = None, joint_order: JointOrder | None = None
    ) -> tuple[str, ...]:
        """Writes a file, by the path's ending or as a format of `mrhubo.robot_motion.FORMATS`; arguments, what is
        returned and raised as for `write_robot_motion`.
        """
        return write_robot_motion(self.robot_motion, path, format, joint_order)


@dataclass(frozen=True, eq=False)
class OptimizationResult(Answer):
    """Joint angles and how near they bring the robot to the human; the names are those of `RetargetResult`, which has a
    confidence besides. T stands for the leading axes of the human poses, none for a single pose.

    N robot joints, D directions (limbs, hands, head), F feet.
    """

    q: Tensor
    """Joint angles (T, N) [rad], inside the limits."""
    joint_names: tuple[str, ...]
    """The N joints, by their names in the URDF."""
    direction_error_deg: Tensor
    """Angle (T, D) [deg] between the robot's and the human's limb, hand and head directions."""
    collision: Tensor | None
    """Whether the robot touches itself (T,), by its URDF's collision shapes; None: shapes of what moves are missing."""
    direction_names: tuple[str, ...] = ()
    """The D directions."""
    frame_rate: float | None = None
    """Frames per second; None: every frame has been solved on its own."""
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


def _without_torch(value: Any) -> Any:
    return value.cpu().numpy() if isinstance(value, Tensor) else value
