"""Robot motions as .npz files: every field an array of its own, no pickle; docs/formats.md has the table."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.atomic import atomic_path
from mrhubo.files.npz import NpzFile, open_npz
from mrhubo.robot_motion.motion import PER_FRAME, RobotMotion
from mrhubo.robot_motion.plain import FACTS, NAME_LISTS, NUMBERS, TEXTS, build, facts_of, frames_of

_MAX_BYTES = 2**31
"""Of an array that is read."""


def write_npz(motion: RobotMotion, path: Path) -> None:
    """Writes all that is known, atomically; the same motion gives the same bytes."""
    facts = {key: np.array(value, np.str_ if key in (*TEXTS, *NAME_LISTS) else np.float64)
             for key, value in facts_of(motion).items()}  # fmt: skip
    write_arrays(path, {**frames_of(motion), **facts})


def write_arrays(path: Path, arrays: dict[str, Any]) -> None:
    """Writes a compressed .npz file, atomically."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    with atomic_path(path) as temporary:
        temporary.write_bytes(buffer.getvalue())


def read_npz(path: Path) -> RobotMotion:
    """A motion from an .npz file with `q` (..., N) [rad], `joint_names` (N,), and what else is told.

    Raises:
        UserError: the file is missing, damaged, hostile, or holds no robot motion.
    """
    with open_npz(path) as file:
        facts = {key: _fact(file, key) for key in FACTS if key in file.keys}
        frames = {key: file.read(key, "fiub", max_bytes=_MAX_BYTES) for key in PER_FRAME if key in file.keys}
    return build(facts, frames, path)


def _fact(file: NpzFile, key: str) -> Any:
    """A text, a number, or a list of them."""
    kinds = "U" if key in (*TEXTS, *NAME_LISTS) else "fiu"
    value = file.read(key, kinds, max_bytes=_MAX_BYTES)
    if value.ndim != (0 if key in (*TEXTS, *NUMBERS) else 1):
        raise UserError(f"{file.path}: '{key}' has shape {value.shape}, which is not what belongs there")
    if kinds == "fiu":
        value = value.astype(np.float64)
    return value.tolist()
