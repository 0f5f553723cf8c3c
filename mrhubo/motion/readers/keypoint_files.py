"""Files of keypoints: arrays in .npy and .npz.

Legend: T frames, K keypoints.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.tree import read_tree
from mrhubo.motion.readers.content import Content
from mrhubo.motion.readers.key_words import usual_name
from mrhubo.motion.readers.keypoint_arrays import Keypoints, in_array, point_key
from mrhubo.motion.readers.keypoint_dictionaries import in_npz
from mrhubo.motion.readers.options import ReadOptions

POSE_KEYS = {
    "poses", "pose_body", "body_pose", "pose", "smpl_poses", "pose_world", "fullpose", "thetas", "pose_aa",
    "pred_rotmat", "smpl_thetas", "poses_body", "local_rot_mats", "rotations", "pred_keypoints_3d", "bodyPose",
}  # fmt: skip
"""What files call rotations, beside which points say nothing new."""


def holds_points(content: Content) -> bool:
    """Whether an .npz file has points and no rotations, by the names of its arrays. Does not raise."""
    names = content.arrays | {usual_name(name) for name in content.arrays}
    return point_key(content.arrays) is not None and not names & POSE_KEYS


def read_keypoints_file(path: Path, options: ReadOptions) -> Keypoints:
    """Reads points from an .npy or .npz file, of one of the people in it.

    Raises:
        UserError: the file is damaged, or holds no points of frames; says what it holds.
    """
    content = Content.open(path)
    if content.is_npy:
        return checked(path, in_array(path, read_tree(path), options))
    return checked(path, in_npz(read_tree(path), options))


def checked(path: Path, found: Keypoints) -> Keypoints:
    """The same with a confidence (T, K) between 0 and 1.

    Raises:
        UserError: names or confidence do not fit the points.
    """
    shape = found.point_TK3.shape[:2]
    if found.names is not None and len(found.names) != shape[1]:
        raise UserError(f"{path}: has {len(found.names)} names for {shape[1]} points")
    if found.confidence_TK is not None:
        sure = found.confidence_TK
        sure = sure[..., 0] if sure.ndim == 3 and sure.shape[2] == 1 else sure
        if sure.shape == shape[1:]:
            sure = np.broadcast_to(sure, shape)
        if sure.shape != shape:
            raise UserError(f"{path}: confidence has shape {sure.shape}; expected {shape}")
        found.confidence_TK = np.clip(np.nan_to_num(sure, nan=0.0, posinf=0.0, neginf=0.0), 0.0, 1.0)
    return found
