"""The training poses of the body prior: reading, finding defects, drawing batches.

Legend: F frames, J = 21 joints.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import Dataset, Sampler

from mrhubo import rotation
from mrhubo.body import anatomy
from mrhubo.body.arm_axes import CMU_TILT, untilt_arms
from mrhubo.body.level_feet import Feet, own_up, standing_up, turn_feet, usual_up
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.errors import UserError
from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.files.npz import open_npz


def load_training_poses(path: Path) -> tuple[Tensor, list[slice], list[str]]:
    """Poses (F, 21, 6) float32, arms turned as SMPL's are and standing feet level, the frames of each clip, and the
    clips' names. What stands in a name before its last underscore is the performer's; feet are alike in all its clips.

    Raises:
        UserError: the file is missing, damaged, or holds other arrays than expected.
    """
    with open_npz(path) as file:
        poses, starts, names = file.read("poses"), file.read("clip_starts"), file.read("clip_ids", kinds="U")
    shaped = poses.ndim == 2 and poses.shape[1] == 66 and starts.ndim == names.ndim == 1
    starts = starts.astype(np.int64)
    if not shaped or len(starts) != len(names) + 1 or starts[-1] != len(poses) or (np.diff(starts) < 0).any():
        raise UserError(f"data: {path}: expected poses (F, 66) and clip_starts up to F, found poses {poses.shape}")
    if not np.isfinite(poses).all():
        raise UserError(f"data: {path}: poses holds NaN or infinite numbers")
    clips = [slice(int(a), int(b)) for a, b in zip(starts[:-1], starts[1:], strict=True)]
    sixd = torch.empty(len(poses), len(POSED_JOINT_NAMES), 6)
    for clip, up in zip(clips, _ups(poses, clips, names.tolist()), strict=True):
        local_FJ33 = untilt_arms(turn_feet(_rotations(poses[clip])[:, 1:], up), CMU_TILT)
        sixd[clip] = rotation.matrix_to_sixd(torch.from_numpy(local_FJ33))
    return sixd, clips, names.tolist()


def _ups(poses: np.ndarray, clips: list[slice], names: list[str]) -> list[Feet]:
    """What is up for each foot where it stands, of each clip: that of the performer."""
    performers = [name.rpartition("_")[0] or name for name in names]
    standing: dict[str, list[Feet]] = {performer: [] for performer in performers}
    for clip, performer in zip(clips, performers, strict=True):
        turned_FJ33 = _rotations(poses[clip])
        standing[performer].append(standing_up(turned_FJ33[:, 0], turned_FJ33[:, 1:]))
    usual_3 = usual_up([feet for own in standing.values() for feet in own])
    ups = {}
    for performer, own in standing.items():
        left, right = (np.concatenate(side) for side in zip(*own, strict=True))
        ups[performer] = own_up((left, right), usual_3)
    return [ups[performer] for performer in performers]


def _rotations(poses: np.ndarray) -> np.ndarray:
    """Of root and joints (F, 22, 3, 3), of axis-angle numbers (F, 66)."""
    return axis_angle_to_matrix(poses.astype(np.float32).reshape(len(poses), -1, 3))


def plausible_frames(pose_FJ6: Tensor, max_excess_deg: float) -> Tensor:
    """Which frames (F,) have no joint further outside its anatomical range: the others are defects of a recording."""
    chunks = (anatomy.excess(rotation.sixd_to_matrix(chunk)) for chunk in pose_FJ6.split(32_768))
    return torch.cat([(chunk <= math.radians(max_excess_deg)).flatten(1).all(dim=1) for chunk in chunks])


class PoseDataset(Dataset[Tensor]):
    """Poses (F, 21, 6), indexed by whole batches of frame numbers."""

    def __init__(self, pose_FJ6: Tensor) -> None:
        self.pose_FJ6 = pose_FJ6

    def __getitem__(self, index: Tensor) -> Tensor:
        return self.pose_FJ6[index]

    def __len__(self) -> int:
        return len(self.pose_FJ6)


class RandomBatches(Sampler[Tensor]):
    """Batches of random rows; each epoch of the given length draws anew from (seed, epoch)."""

    def __init__(self, rows: int, batch_size: int, length: int, seed: int) -> None:
        self.rows, self.batch_size, self.length, self.seed, self.epoch = rows, batch_size, length, seed, 0

    def set_epoch(self, epoch: int) -> None:
        """Called by Lightning before each epoch."""
        self.epoch = epoch

    def __len__(self) -> int:
        return self.length

    def __iter__(self) -> Iterator[Tensor]:
        generator = torch.Generator().manual_seed(self.seed * 1_000_003 + self.epoch)
        for _ in range(self.length):
            yield torch.randint(self.rows, (self.batch_size,), generator=generator)
