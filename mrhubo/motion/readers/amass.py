"""Human motions from .npz files with the keys of AMASS, SMPL-X or SMPL-H.

Such files come from strangers: nothing in them is unpickled, sizes are checked against their headers before anything is
read, and whatever is wrong with what is needed becomes a UserError that names the file, the key and the frame. What is
not needed (the root, the body's shape, the description) is left out where it cannot be used, with a note.

Legend: T frames, 63 = 21 joints x 3 axis-angle numbers [rad] of SMPL's joints 1..21.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from mrhubo.body.arm_axes import elbow_tilt, untilt_arms
from mrhubo.body.rest_directions import from_family
from mrhubo.errors import UserError, shortened
from mrhubo.files.npz import NpzFile, open_npz
from mrhubo.motion.motion import Motion
from mrhubo.motion.poses import MAX_TURN, Turns
from mrhubo.motion.readers.family import find_family
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.options import RATES, ReadOptions
from mrhubo.rotation import axis_angle_to_matrix

MAX_FRAMES = 2_000_000
"""Longest motion that is read (four and a half hours at 120 frames a second, 1.5 GB as matrices)."""
_LEVEL = math.radians(1.0)
"""Tilts of elbows' axes up to this stay: an angle that says nothing."""
_BLOCK = 65_536
"""Frames that are read and converted at a time."""
_MAX_SMALL = 1_000_000
"""Bytes of an array that holds a number, some, or a text."""
_MAX_ROOT_TURN = 8 * math.pi
"""No root's axis-angle number is that large [rad]: a person may turn round some times; degrees are larger."""
_RATE_KEYS = ("mocap_frame_rate", "mocap_framerate")
_POSES_WIDTHS = {66: "body", 72: "SMPL", 156: "SMPL-H", 165: "SMPL-X"}
_LARGEST_BETA = 1e6
_FARTHEST_M = 1e5
"""No root is that far from the origin [m]."""
_Y_UP_FROM_Z_UP = torch.tensor([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Turns a world whose z axis is up so that y is: a quarter turn about x."""


@np.errstate(all="ignore")  # what overflows is found out below
def read_amass(path: Path, options: ReadOptions) -> Motion:
    """Reads `pose_body` (T, 63), or `poses` (T, 66 or more) with the root's three numbers first.

    The root is read from `root_orient` or from `poses`, and from `trans`. AMASS's world has its z axis up, other files
    of this kind y; the one that the body's own up axis follows is taken, and turned to y.

    Rotations refer to the rest pose of the body model that the file says it is of; they are told in our skeleton's.

    Raises:
        UserError: the file is missing, damaged, hostile, too large, or not a motion.
    """
    notes: list[str] = []
    with open_npz(path) as file:
        key, local_TJ33 = _read_pose(file)
        frame_rate = _read_frame_rate(file, options, notes)
        description = _read_description(file, notes)
        root_rotation_T33, root_position_T3, up = _read_root(file, key, len(local_TJ33), notes)
        betas = _read_betas(file, notes)
        family, rest = find_family(file, betas)
    for part in local_TJ33.split(_BLOCK) if family else ():
        part.copy_(from_family(part, family))
    # Elbows of a body that was fitted are no hinges; those of a converted skeleton are, about whatever axis it has.
    tilt = None if family else elbow_tilt(local_TJ33)
    if tilt is not None and abs(tilt) > _LEVEL:
        local_TJ33 = untilt_arms(local_TJ33, tilt)
        notes.append(f"the elbows' axes are tilted by {math.degrees(tilt):.0f} degrees from SMPL's: taken out")
    name = motion_name(path)
    return Motion(
        name=name,
        local_TJ33=local_TJ33,
        frame_rate=frame_rate,
        description=description or name,
        root_rotation_T33=root_rotation_T33,
        root_position_T3=root_position_T3,
        betas=betas,
        source=f"SMPL-family .npz with '{key}'{up}; {rest}",
        family=family,
        notes=tuple(notes),
    )


def _matrices(axis_angle_TX: np.ndarray) -> Tensor:
    """Axis-angle numbers (T, 3 K) [rad] as rotations (T, K, 3, 3), float32."""
    return axis_angle_to_matrix(torch.from_numpy(axis_angle_TX).unflatten(-1, (-1, 3))).float()


def _read_pose(file: NpzFile) -> tuple[str, Tensor]:
    """The key that holds the pose, and local rotations (T, 21, 3, 3), float32."""
    path, keys = file.path, file.keys
    key = next((key for key in ("pose_body", "poses") if key in keys), None)
    if key is None:
        found = ", ".join(map(shortened, sorted(keys)[:12])) or "nothing"
        raise UserError(f"{path}: holds neither 'pose_body' nor 'poses', so it is no human motion; it holds: {found}")
    shape = file.shape(key, max_rows=MAX_FRAMES)
    widths = {63: "body without root"} if key == "pose_body" else _POSES_WIDTHS
    if len(shape) != 2 or shape[1] not in widths:
        expected = " or ".join(f"(frames, {width}) ({what})" for width, what in widths.items())
        raise UserError(f"{path}: '{key}' has shape {shape}; expected {expected}")
    first = 0 if key == "pose_body" else 3
    local_TJ33 = torch.empty(shape[0], 21, 3, 3)
    turns = Turns()
    for start, pose_T63 in _blocks(file, key, first, first + 63):
        turn_TJ = np.linalg.norm(pose_T63.reshape(-1, 21, 3), axis=-1)
        bad_N2 = np.argwhere(~(turn_TJ <= MAX_TURN))
        if len(bad_N2):
            frame, joint = bad_N2[0].tolist()
            numbers = np.abs(pose_T63[frame, 3 * joint : 3 * joint + 3])
            column = 3 * joint + int(np.argmax(np.where(np.isnan(numbers), np.inf, numbers)))
            value = float(pose_T63[frame, column])
            why = "is not finite" if not math.isfinite(value) else "is no axis-angle number in radians (degrees?)"
            raise UserError(f"{path}: '{key}' {why} in frame {start + frame}, number {first + column}: {value:g}")
        turns.add(torch.from_numpy(turn_TJ))
        local_TJ33[start : start + len(pose_T63)] = _matrices(pose_T63)
    if turns.are_degrees:
        raise UserError(
            f"{path}: '{key}' is no axis-angle in radians (degrees?): {turns.described}; multiply it by pi / 180"
        )
    return key, local_TJ33


def _blocks(file: NpzFile, key: str, first: int, end: int) -> Iterator[tuple[int, np.ndarray]]:
    """Some columns of an array (T, ...), float64, block by block, each with the number of its first frame."""
    start = 0
    for block in file.blocks(key, _BLOCK, MAX_FRAMES):
        yield start, block[:, first:end].astype(np.float64)
        start += len(block)


def _read_root(file: NpzFile, pose_key: str, frames: int, notes: list[str]) -> tuple[Tensor | None, Tensor | None, str]:
    """Rotations (T, 3, 3) and places (T, 3) of the root in a world whose y axis is up, and how the file has it."""
    key = "root_orient" if "root_orient" in file.keys else pose_key if pose_key == "poses" else None
    root_T3 = None if key is None else _read_rows(file, key, frames, _MAX_ROOT_TURN, notes)
    if root_T3 is None:
        if "trans" in file.keys:
            notes.append("'trans' is left out: without the root's rotation its up axis is not known")
        return None, None, ""
    rotation_T33 = torch.cat([_matrices(root_T3[start : start + _BLOCK])[:, 0] for start in range(0, frames, _BLOCK)])
    # The body's own up axis (y, in the pelvis) in the world: people stand and walk more than they lie.
    _, along_y, along_z = rotation_T33[:, :, 1].mean(dim=0).tolist()
    to_world_33 = torch.eye(3) if along_y >= along_z else _Y_UP_FROM_Z_UP
    position_T3 = _read_rows(file, "trans", frames, _FARTHEST_M, notes) if "trans" in file.keys else None
    return (
        to_world_33 @ rotation_T33,
        None if position_T3 is None else torch.from_numpy(position_T3).float() @ to_world_33.T,
        ", y up" if along_y >= along_z else ", z up",
    )


def _read_rows(file: NpzFile, key: str, frames: int, largest: float, notes: list[str]) -> np.ndarray | None:
    """The first three numbers (T, 3), float64, of an array that a motion can do without; None, and a note, where it
    cannot be used.
    """
    try:
        shape = file.shape(key, max_rows=MAX_FRAMES)
        if len(shape) != 2 or shape[0] != frames or shape[1] < 3:
            notes.append(f"'{key}' is left out: its shape is {shape}; expected ({frames}, 3)")
            return None
        rows_T3 = np.concatenate([rows for _, rows in _blocks(file, key, 0, 3)])
    except UserError as error:
        notes.append(f"'{key}' is left out: {error}")
        return None
    if not (np.abs(rows_T3) <= largest).all():
        notes.append(f"'{key}' is left out: it holds NaN, infinite numbers, or some beyond {largest:g}")
        return None
    return rows_T3


def _read_betas(file: NpzFile, notes: list[str]) -> tuple[float, ...] | None:
    """The body's shape, if the file has one."""
    if "betas" not in file.keys:
        return None
    try:
        array = file.read("betas", max_bytes=_MAX_SMALL)
    except UserError as error:
        notes.append(f"'betas' is left out: {error}")
        return None
    if array.ndim != 1 or len(array) > 400 or not (np.abs(array) < _LARGEST_BETA).all():
        notes.append(f"'betas' is left out: expected up to 400 finite numbers, found the shape {array.shape}")
        return None
    return tuple(float(number) for number in array.astype(np.float64))


def _read_frame_rate(file: NpzFile, options: ReadOptions, notes: list[str]) -> float:
    path = file.path
    key = next((key for key in _RATE_KEYS if key in file.keys), None)
    if key is None:
        if options.rate is not None:
            return float(options.rate)
        raise UserError(
            f"{path}: holds no frame rate (the key '{_RATE_KEYS[0]}' or '{_RATE_KEYS[1]}'); say what it is: --rate 30"
            " on the command line, ReadOptions(rate=30) in Python"
        )
    array = file.read(key, max_bytes=_MAX_SMALL)
    if array.size != 1:
        raise UserError(f"{path}: '{key}' has shape {array.shape}; expected one number")
    rate = float(array.reshape(()))
    low, high = RATES
    if not low <= rate <= high:
        raise UserError(f"{path}: '{key}' is {rate:g} frames per second; expected {low:g} to {high:g}")
    if options.rate is not None and options.rate != rate:
        notes.append(f"the rate of {options.rate:g} that was given is left out: the file says {rate:g}")
    return rate


def _read_description(file: NpzFile, notes: list[str]) -> str:
    """The description, or nothing where the file has none that is text."""
    if "description" not in file.keys:
        return ""
    try:
        array = file.read("description", kinds="U", max_bytes=_MAX_SMALL)
    except UserError as error:
        notes.append(f"'description' is left out: {error}")
        return ""
    text = str(array.reshape(())) if array.size == 1 else ""
    return " ".join("".join(c for c in text[:1000] if c.isprintable() or c.isspace()).split())
