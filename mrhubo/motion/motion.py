"""A human motion in memory, whatever file it came from.

Readers make it of NumPy's arrays, and without PyTorch; who asks for `motion.local_TJ33` gets a tensor, which shares the
numbers of `motion.arrays.local_TJ33`.

World frame of the root: x to the left, y up, z forward (SMPL's), metres, whatever the file had.

Legend: T frames, J = 21: SMPL's joints 1..21, in SMPL's order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xxhash

from mrhubo.body.rest_directions import is_ours, to_family

if TYPE_CHECKING:
    from torch import Tensor

    from mrhubo.body.skeleton import Skeleton


@dataclass(frozen=True)
class MotionArrays:
    """The arrays of a motion in NumPy, as `Motion` has them in PyTorch."""

    local_TJ33: np.ndarray
    root_rotation_T33: np.ndarray | None
    root_position_T3: np.ndarray | None
    confidence_TJ: np.ndarray | None
    contact_T4: np.ndarray | None


SOLE_POINTS = ("left_heel", "left_toe", "right_heel", "right_toe")
"""Keypoints of soles, of which a motion may tell when they are planted."""


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
    contact_T4: Tensor | None = None
    """Whether each of `SOLE_POINTS` is planted on the floor (T, 4), bool; None where the file does not say: then it is
    found (`mrhubo.motion.contacts`)."""

    @classmethod
    def of(cls, **parts: Any) -> Motion:
        """A motion of its fields, whose arrays may be NumPy's."""
        return cls(**parts)

    def changed(self, **parts: Any) -> Motion:
        """The same motion but for some fields, whose arrays may be NumPy's."""
        return Motion(**{**vars(self), **parts})

    @property
    def arrays(self) -> MotionArrays:
        """The arrays in NumPy, on the CPU."""
        return MotionArrays(*(_to_array(vars(self)[name]) for name in MotionArrays.__dataclass_fields__))

    def for_skeleton(self, skeleton: Skeleton) -> Motion:
        """The motion with rotations for a skeleton: itself for our own, or one with our rest pose.

        A body model's skeleton has its own rest pose. The rotations are then as the file has them: exact where the file
        is of that model, and of that person where the model is given the file's `betas` and gender.
        """
        if not self.family or is_ours(skeleton):
            return self
        source = f"{self.source.split('; rotations')[0]}; rotations refer to the rest pose of the given body model"
        return self.changed(local_TJ33=to_family(self.arrays.local_TJ33, self.family), family="", source=source)

    def __len__(self) -> int:
        return len(vars(self)["local_TJ33"])

    @property
    def checksum(self) -> str:
        """xxh3 of local rotations and frame rate, 16 hex digits: the same motion, whatever its file is called."""
        local_TJ33 = self.arrays.local_TJ33
        columns_TJ23 = np.ascontiguousarray(local_TJ33[..., :2].swapaxes(-1, -2))
        digest = xxhash.xxh3_64(f"{(*local_TJ33.shape[:2], 6)} {self.frame_rate!r}".encode())
        digest.update(columns_TJ23.data)
        return digest.hexdigest()


class _Stored:
    """A field whose array is NumPy's until a tensor is asked for."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __get__(self, motion: Motion | None, owner: type[Motion]) -> Any:
        if motion is None:
            return self
        value = vars(motion)[self.name]
        if isinstance(value, np.ndarray):
            import torch

            vars(motion)[self.name] = value = torch.from_numpy(value)
        return value

    def __set__(self, motion: Motion, value: Any) -> None:
        vars(motion)[self.name] = value


for _name in MotionArrays.__dataclass_fields__:
    setattr(Motion, _name, _Stored(_name))


def _to_array(value: Any) -> Any:
    return value if value is None or isinstance(value, np.ndarray) else value.detach().cpu().numpy()
