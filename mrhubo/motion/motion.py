"""A human motion in memory, whatever file it came from.

World frame of the root: x to the left, y up, z forward (SMPL's), metres, whatever the file had.

Legend: T frames, J = 21: SMPL's joints 1..21, in SMPL's order.
"""

from __future__ import annotations

from dataclasses import dataclass

import xxhash
from torch import Tensor

from mrhubo.rotation import matrix_to_sixd


@dataclass(frozen=True)
class Motion:
    """A human motion: how the joints turn, and where the root, the pelvis, goes, as far as the file tells."""

    name: str
    """File name without its ending, and without AMASS's `_poses` or `_stageii`."""
    local_TJ33: Tensor
    """Rotations (T, 21, 3, 3) of SMPL's joints 1..21, each relative to its parent, float32."""
    frame_rate: float
    """Frames per second."""
    description: str = ""
    """What is done, in words; the name where the file does not say."""
    root_rotation_T33: Tensor | None = None
    """Rotation (T, 3, 3) of the pelvis in the world, float32; None where the file has none."""
    root_position_T3: Tensor | None = None
    """Place (T, 3) of the root in the world [m], float32; None where the file has none. Files of SMPL's family give
    their model's translation, which lies some centimetres off the pelvis."""
    betas: tuple[float, ...] | None = None
    """Shape coefficients of the person's body model; None where the file has none."""
    source: str = ""
    """What the reader took the file for, in words."""
    notes: tuple[str, ...] = ()
    """What the reader left out, a sentence each."""
    confidence_TJ: Tensor | None = None
    """How sure the source is of each joint (T, 21), 0..1; None where it does not say."""

    def __len__(self) -> int:
        return len(self.local_TJ33)

    @property
    def checksum(self) -> str:
        """xxh3 of local rotations and frame rate, 16 hex digits: the same motion, whatever its file is called."""
        pose_TJ6 = matrix_to_sixd(self.local_TJ33)
        digest = xxhash.xxh3_64(f"{tuple(pose_TJ6.shape)} {self.frame_rate!r}".encode())
        digest.update(pose_TJ6.contiguous().numpy().data)
        return digest.hexdigest()
