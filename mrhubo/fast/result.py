"""What a retargeter without PyTorch answers: `mrhubo.retargeter.RetargetResult` in NumPy's arrays."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrhubo.files.joint_angles import write_joint_angles


@dataclass(frozen=True, eq=False)
class FastResult:
    """Joint angles and how far to trust them, float32; T stands for the leading axes of the human poses.

    N robot joints, M measured directions (limbs, hands, head), X branches.
    """

    q: np.ndarray
    """Joint angles (T, N) [rad], inside the limits."""
    joint_names: tuple[str, ...]
    """The N joints, by their names in the URDF."""
    confidence: np.ndarray
    """(T,), 0..1: that of the least certain branch."""
    direction_error_deg: np.ndarray
    """Angle (T, M) [deg] between the robot's and the human's limb, hand and head directions."""
    phi: np.ndarray
    """Reconstruction error (T,) of what the robot reads of the human pose, of the branch where it is largest."""
    collision: np.ndarray
    """Whether the robot touches itself (T,), by its URDF's collision shapes."""
    branch_confidence: np.ndarray
    """(T, X), 0..1: the probability that the limbs of a branch point where the person's did, to 15 degrees."""
    branch_names: tuple[str, ...]
    """The X branches: `left_arm` and so on."""
    frame_rate: float | None = None
    """Frames per second, where the motion told it."""

    def save(self, path: Path | str) -> None:
        """Writes an .npz or a .csv file, as `RetargetResult.save` does.

        Raises:
            UserError: the ending is another, the result is no single motion and the ending .csv, or the disk refuses.
        """
        more = {name: getattr(self, name) for name in ("confidence", "direction_error_deg", "phi", "collision")}
        for number, branch in enumerate(self.branch_names):
            more[f"confidence_{branch}"] = self.branch_confidence[..., number]
        write_joint_angles(path, self.q, self.joint_names, self.frame_rate, more)
