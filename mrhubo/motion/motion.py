"""A human motion in memory, whatever file it came from.

World frame of the root: x to the left, y up, z forward (SMPL's), metres, whatever the file had.

Legend: T frames, J = 21: SMPL's joints 1..21, in SMPL's order.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import xxhash
from torch import Tensor

from mrhubo.body.rest_directions import is_ours, to_family
from mrhubo.body.skeleton import Skeleton
from mrhubo.rotation import matrix_to_sixd


@dataclass(frozen=True)
class Motion:
    """A human motion: how the joints turn, and where the root, the pelvis, goes, as far as the file tells."""

    name: str
    """File name without its ending, and without AMASS's `_poses` or `_stageii`."""
    local_TJ33: Tensor
    """Rotations (T, 21, 3, 3) of SMPL's joints 1..21, each relative to its parent, float32; they refer to the rest pose
    of our own skeleton, whatever the file's did."""
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
    family: str = ""
    """The family of body models (a key of `mrhubo.body.rest_directions.FAMILIES`) to whose rest pose the file's
    rotations referred; empty where that was our own."""
    confidence_TJ: Tensor | None = None
    """How sure the source is of each joint (T, 21), 0..1; None where it does not say."""

    def for_skeleton(self, skeleton: Skeleton) -> Motion:
        """The motion with rotations for a skeleton: itself for our own, or one with our rest pose.

        A body model's skeleton has its own rest pose. The rotations are then as the file has them: exact where the file
        is of that model, and of that person where the model is given the file's `betas` and gender.
        """
        if not self.family or is_ours(skeleton):
            return self
        source = f"{self.source.split('; rotations')[0]}; rotations refer to the rest pose of the given body model"
        return replace(self, local_TJ33=to_family(self.local_TJ33, self.family), family="", source=source)

    def __len__(self) -> int:
        return len(self.local_TJ33)

    @property
    def checksum(self) -> str:
        """xxh3 of local rotations and frame rate, 16 hex digits: the same motion, whatever its file is called."""
        pose_TJ6 = matrix_to_sixd(self.local_TJ33)
        digest = xxhash.xxh3_64(f"{tuple(pose_TJ6.shape)} {self.frame_rate!r}".encode())
        digest.update(pose_TJ6.contiguous().numpy().data)
        return digest.hexdigest()
