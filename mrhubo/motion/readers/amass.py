"""Human motions from .npz files with the keys of AMASS, SMPL-X or SMPL-H.

Such files come from strangers: nothing in them is unpickled, sizes are checked against their headers before anything is
read, and whatever is wrong with one becomes a UserError that names the file, the key and the frame.

Legend: T frames, 63 = 21 joints x 3 axis-angle numbers [rad] of SMPL's joints 1..21, J6 = (21, 6) the same in 6D.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import torch

from mrhubo.errors import UserError
from mrhubo.files.npz import NpzFile, open_npz
from mrhubo.motion.motion import Motion
from mrhubo.motion.poses import MAX_TURN
from mrhubo.rotation import axis_angle_to_matrix, matrix_to_sixd

MAX_FRAMES = 5_000_000
"""Longest motion that is read (eleven hours at 120 frames a second)."""
_FRAME_RATES = (1.0, 1000.0)
_RATE_KEYS = ("mocap_frame_rate", "mocap_framerate")
_POSES_WIDTHS = {66: "body", 72: "SMPL", 156: "SMPL-H", 165: "SMPL-X"}
_NAME_ENDINGS = ("_stageii", "_poses")


def read_amass(path: Path) -> Motion:
    """Reads `pose_body` (T, 63), or `poses` (T, 66 or more) with the root's three numbers first.

    Raises:
        UserError: the file is missing, damaged, hostile, too large, or not a motion.
    """
    with open_npz(path) as file:
        pose_T63 = _read_pose(file)
        frame_rate = _read_frame_rate(file)
        description = _read_description(file)
    pose_TJ3 = torch.from_numpy(pose_T63).unflatten(-1, (21, 3))
    chunks = (matrix_to_sixd(axis_angle_to_matrix(chunk)).float() for chunk in pose_TJ3.split(65_536))
    pose_TJ6 = torch.cat(list(chunks))
    name = motion_name(path)
    return Motion(name=name, pose_TJ6=pose_TJ6, frame_rate=frame_rate, description=description or name)


def motion_name(path: Path) -> str:
    """A file's name without its ending, and without AMASS's `_poses` or `_stageii`."""
    name = path.stem
    for ending in _NAME_ENDINGS:
        name = name.removesuffix(ending)
    return name or path.stem


def _read_pose(file: NpzFile) -> np.ndarray:
    """Axis-angle (T, 63) [rad], finite, float64."""
    path, keys = file.path, file.keys
    key = next((key for key in ("pose_body", "poses") if key in keys), None)
    if key is None:
        found = ", ".join(sorted(keys)[:12]) or "nothing"
        raise UserError(f"{path}: holds neither 'pose_body' nor 'poses', so it is no human motion; it holds: {found}")
    array = file.read(key, max_rows=MAX_FRAMES)
    widths = {63: "body without root"} if key == "pose_body" else _POSES_WIDTHS
    if array.ndim != 2 or array.shape[1] not in widths:
        expected = " or ".join(f"(frames, {width}) ({what})" for width, what in widths.items())
        raise UserError(f"{path}: '{key}' has shape {array.shape}; expected {expected}")
    start = 0 if key == "pose_body" else 3
    with np.errstate(over="ignore"):
        pose_T63 = array[:, start : start + 63].astype(np.float64)
    bad_N2 = np.argwhere(~(np.abs(pose_T63) <= MAX_TURN))
    if len(bad_N2):
        frame, column = bad_N2[0].tolist()
        value = float(pose_T63[frame, column])
        why = "is not finite" if not math.isfinite(value) else "is no axis-angle number in radians (degrees?)"
        raise UserError(f"{path}: '{key}' {why} in frame {frame}, number {start + column}: {value:g}")
    return pose_T63


def _read_frame_rate(file: NpzFile) -> float:
    path = file.path
    key = next((key for key in _RATE_KEYS if key in file.keys), None)
    if key is None:
        raise UserError(f"{path}: holds no frame rate; expected the key '{_RATE_KEYS[0]}' or '{_RATE_KEYS[1]}'")
    array = file.read(key)
    if array.size != 1:
        raise UserError(f"{path}: '{key}' has shape {array.shape}; expected one number")
    rate = float(array.reshape(()))
    low, high = _FRAME_RATES
    if not low <= rate <= high:
        raise UserError(f"{path}: '{key}' is {rate:g} frames per second; expected {low:g} to {high:g}")
    return rate


def _read_description(file: NpzFile) -> str:
    """The description, or nothing where the file has none that is text."""
    if "description" not in file.keys:
        return ""
    array = file.read("description", kinds="U")
    text = str(array.reshape(())) if array.size == 1 else ""
    return " ".join("".join(c for c in text[:1000] if c.isprintable() or c.isspace()).split())
