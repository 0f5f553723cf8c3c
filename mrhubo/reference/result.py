"""What the optimiser answers when it is called like a retargeter, and how that is saved."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from torch import Tensor

from mrhubo.files.joint_angles import write_joint_angles


@dataclass(frozen=True, eq=False)
class OptimizationResult:
    """Joint angles and how near they bring the robot to the human; the names are those of `RetargetResult`, which has a
    confidence besides. T stands for the leading axes of the human poses, none for a single pose.

    N robot joints, D directions (limbs, hands, head).
    """

    q: Tensor
    """Joint angles (T, N) [rad], inside the limits."""
    joint_names: tuple[str, ...]
    """The N joints, by their names in the URDF."""
    direction_error_deg: Tensor
    """Angle (T, D) [deg] between the robot's and the human's limb, hand and head directions."""
    collision: Tensor
    """Whether the robot touches itself (T,), by its URDF's collision shapes."""
    frame_rate: float | None = None
    """Frames per second; None: every frame has been solved on its own."""

    def save(self, path: Path | str) -> None:
        """Writes an .npz or a .csv file, by the path's ending; see `write_joint_angles` for what is in it.

        Raises:
            UserError: the ending is another, the result is no single motion and the ending .csv, or the disk refuses.
        """
        more = {name: getattr(self, name).cpu().numpy() for name in ("direction_error_deg", "collision")}
        write_joint_angles(path, self.q.cpu().numpy(), self.joint_names, self.frame_rate, more)
