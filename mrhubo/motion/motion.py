"""A human motion in memory, whatever file it came from.

Legend: T frames, J6 = (21, 6): SMPL's joints 1..21 in 6D.
"""

from __future__ import annotations

from dataclasses import dataclass

import xxhash
from torch import Tensor


@dataclass(frozen=True)
class Motion:
    """A human motion: the body's joint rotations over time. Where the root goes is left out; no robot here walks."""

    name: str
    """File name without its ending, and without AMASS's `_poses` or `_stageii`."""
    pose_TJ6: Tensor
    """Local rotations (T, 21, 6) of SMPL's joints 1..21, 6D, float32."""
    frame_rate: float
    """Frames per second."""
    description: str
    """What is done, in words; the name where the file does not say."""

    @property
    def checksum(self) -> str:
        """xxh3 of poses and frame rate, 16 hex digits: the same motion, whatever its file is called."""
        digest = xxhash.xxh3_64(f"{tuple(self.pose_TJ6.shape)} {self.frame_rate!r}".encode())
        digest.update(self.pose_TJ6.contiguous().numpy().data)
        return digest.hexdigest()

    @property
    def duration(self) -> float:
        """Length [s]."""
        return len(self.pose_TJ6) / self.frame_rate
