"""What a retargeter answers, and how that is saved."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from mrhubo.files.joint_angles import write_joint_angles


@dataclass(frozen=True, eq=False)
class RetargetResult:
    """Joint angles and how far to trust them; T stands for the leading axes of the human poses, none for a single pose.

    N robot joints, D directions (limbs, hands, head), C branches.
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
    collision: Tensor
    """Whether the robot touches itself (T,), by its URDF's collision shapes; the networks do not avoid it."""
    branch_confidence: Tensor
    """(T, C), 0..1: the probability that the limbs of each branch of the robot, an arm or the head, point where the
    person's did, to 15 degrees; see `mrhubo.retargeter.confidence`."""
    branch_names: tuple[str, ...]
    """The C branches: `left_arm` and so on."""
    frame_rate: float | None = None
    """Frames per second, where the motion told it."""

    def with_leading(self, shape: tuple[int, ...], frame_rate: float | None) -> RetargetResult:
        """The same with other leading axes, for as many frames, and a frame rate."""
        tensors = {
            name: getattr(self, name).unflatten(0, shape) if shape else getattr(self, name)[0] for name in _TENSORS
        }
        return dataclasses.replace(self, **tensors, frame_rate=frame_rate)

    def save(self, path: Path | str) -> None:
        """Writes an .npz or a .csv file, by the path's ending; see `write_joint_angles` for what is in it.

        Raises:
            UserError: the ending is another, the result is no single motion and the ending .csv, or the disk refuses.
        """
        names = ("confidence", "direction_error_deg", "phi", "collision")
        more = {name: getattr(self, name).cpu().numpy() for name in names}
        for number, branch in enumerate(self.branch_names):
            more[f"confidence_{branch}"] = self.branch_confidence[..., number].cpu().numpy()
        write_joint_angles(path, self.q.cpu().numpy(), self.joint_names, self.frame_rate, more)


_TENSORS = ("q", "confidence", "direction_error_deg", "phi", "collision", "branch_confidence")


def join_results(parts: Sequence[RetargetResult]) -> RetargetResult:
    """One result of those of a motion's parts, one after the other; without a frame rate."""
    tensors = {name: torch.cat([getattr(part, name) for part in parts]) for name in _TENSORS}
    return dataclasses.replace(parts[0], **tensors, frame_rate=None)
