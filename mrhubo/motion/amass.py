"""Human motions from and to .npz files with the keys of AMASS, SMPL-X or SMPL-H.

Such files come from strangers: nothing in them is unpickled, sizes are checked against their headers before anything is
read, and whatever is wrong with one becomes a UserError that names the file, the key and the frame.

Legend: T frames, 63 = 21 joints x 3 axis-angle numbers [rad] of SMPL's joints 1..21, J6 = (21, 6) the same in 6D.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
import xxhash
from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.npz import NpzFile, open_npz
from mrhubo.rotation import axis_angle_to_matrix, matrix_to_sixd
from mrhubo.storage import atomic_path

MAX_FRAMES = 5_000_000
"""Longest motion that is read (eleven hours at 120 frames a second)."""
_FRAME_RATES = (1.0, 1000.0)
_MAX_TURN = 8 * math.pi
"""No axis-angle number is that large [rad]; degrees are."""
_RATE_KEYS = ("mocap_frame_rate", "mocap_framerate")
_POSES_WIDTHS = {66: "body", 72: "SMPL", 156: "SMPL-H", 165: "SMPL-X"}
_NAME_ENDINGS = ("_stageii", "_poses")
_NO_MOTION = ("shape", "_stagei")


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


def read_motion(path: Path) -> Motion:
    """Reads `pose_body` (T, 63), or `poses` (T, 66 or more) with the root's three numbers first.

    Raises:
        UserError: the file is missing, damaged, hostile, too large, or not a motion.
    """
    path = Path(path)
    with open_npz(path) as file:
        pose_T63 = _read_pose(file)
        frame_rate = _read_frame_rate(file)
        description = _read_description(file)
    pose_TJ3 = torch.from_numpy(pose_T63).unflatten(-1, (21, 3))
    chunks = (matrix_to_sixd(axis_angle_to_matrix(chunk)).float() for chunk in pose_TJ3.split(65_536))
    pose_TJ6 = torch.cat(list(chunks))
    name = _motion_name(path)
    return Motion(name=name, pose_TJ6=pose_TJ6, frame_rate=frame_rate, description=description or name)


def read_folder(folder: Path) -> list[Motion]:
    """Every motion in a folder (not in its subfolders), sorted by name; hidden and AMASS's shape files are passed over.

    Raises:
        UserError: the folder is missing or holds no motion, two files hold a motion of one name, or a file is bad.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise UserError(f"{folder}: there is no such folder")
    files = _motion_files(folder)
    if not files:
        raise UserError(f"{folder}: holds no .npz motion file")
    by_name: dict[str, Path] = {}
    for file in files:
        other = by_name.setdefault(_motion_name(file), file)
        if other is not file:
            raise UserError(f"{folder}: {other.name} and {file.name} are both named '{_motion_name(file)}'; keep one")
    return [read_motion(by_name[name]) for name in sorted(by_name)]


def find_motions(folders: Sequence[Path]) -> Path:
    """The first of some folders that exists and holds a motion file.

    Raises:
        UserError: none does.
    """
    for folder in folders:
        if Path(folder).is_dir() and _motion_files(Path(folder)):
            return Path(folder)
    looked = ", ".join(str(folder) for folder in folders) or "no folder given"
    raise UserError(f"no .npz motion file found; looked in: {looked}")


def write_motion(
    path: Path,
    pose_body_T63: np.ndarray,
    root_orient_T3: np.ndarray,
    trans_T3: np.ndarray,
    frame_rate: float,
    description: str,
) -> None:
    """Writes a motion with AMASS's keys, as float32, atomically; the same numbers give the same bytes.

    ``pose_body_T63`` and ``root_orient_T3``: axis-angle [rad] of joints 1..21 and of the pelvis; ``trans_T3``: place of
    the pelvis [m]; ``frame_rate``: frames per second.
    """
    frames = len(pose_body_T63)
    arrays = {"pose_body": (pose_body_T63, 63), "root_orient": (root_orient_T3, 3), "trans": (trans_T3, 3)}
    for key, (array, width) in arrays.items():
        if np.shape(array) != (frames, width) or frames == 0:
            raise ValueError(f"{key}: expected shape ({frames}, {width}), one frame or more, got {np.shape(array)}")
        if not np.isfinite(array).all():
            raise ValueError(f"{key}: not finite")
    content: dict[str, Any] = {key: np.asarray(array, dtype="<f4") for key, (array, _) in arrays.items()}
    content |= {
        "mocap_frame_rate": np.asarray(frame_rate, dtype="<f8"),
        "betas": np.zeros(16, dtype="<f4"),
        "gender": np.asarray("neutral", dtype="<U7"),
        "surface_model_type": np.asarray("smplx", dtype="<U5"),
        "description": np.asarray(description, dtype=f"<U{max(1, len(description))}"),
    }
    with atomic_path(Path(path)) as temporary, open(temporary, "wb") as handle:
        np.savez(handle, **content)


def _motion_name(path: Path) -> str:
    name = path.stem
    for ending in _NAME_ENDINGS:
        name = name.removesuffix(ending)
    return name or path.stem


def _motion_files(folder: Path) -> list[Path]:
    found = (file for file in folder.iterdir() if file.suffix == ".npz" and not file.name.startswith("."))
    return sorted(file for file in found if not file.stem.endswith(_NO_MOTION) and file.is_file())


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
    bad_N2 = np.argwhere(~(np.abs(pose_T63) <= _MAX_TURN))
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
