"""A robot's joint angles over time as a file that other programs read: .npz for NumPy, .csv for everything else."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.atomic import atomic_path


def write_joint_angles(
    path: Path | str,
    q: np.ndarray,
    joint_names: Sequence[str],
    frame_rate: float | None,
    more: Mapping[str, np.ndarray],
) -> None:
    """Writes joint angles, atomically; the path's ending says how.

    An .npz file holds `q` [rad], `joint_names`, `unit` ("rad"), `frame_rate` [1/s] where it is known, and every array
    of `more`; it needs no pickle. A .csv file has a header and a row a frame: `time [s]` where the frame rate is known,
    else `frame`, a column `NAME [rad]` a joint, and those of `more` that have one number a frame.

    Args:
        path: where to; folders are made.
        q: joint angles (..., N) [rad]. A .csv file takes one motion (T, N) or one pose (N,).
        joint_names: the N names.
        frame_rate: frames per second, if known.
        more: other arrays by name, whose leading axes are those of `q`.

    Raises:
        UserError: the ending is another, `q` has too many axes for a table, or the disk refuses.
    """
    path = Path(path)
    if path.suffix == ".npz":
        content = _npz(q, joint_names, frame_rate, more)
    elif path.suffix == ".csv":
        if q.ndim > 2:
            raise UserError(f"{path}: a .csv file holds one motion, found joint angles of shape {q.shape}; use .npz")
        content = _csv(q, joint_names, frame_rate, more)
    else:
        raise UserError(f"{path}: the name must end in .npz or .csv")
    with atomic_path(path) as temporary:
        temporary.write_bytes(content)


def _npz(q: np.ndarray, joint_names: Sequence[str], frame_rate: float | None, more: Mapping[str, np.ndarray]) -> bytes:
    arrays: dict[str, Any] = {"q": q, "joint_names": np.array(joint_names, np.str_), "unit": np.array("rad"), **more}
    if frame_rate is not None:
        arrays["frame_rate"] = np.array(frame_rate, np.float64)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


def _csv(q: np.ndarray, joint_names: Sequence[str], frame_rate: float | None, more: Mapping[str, np.ndarray]) -> bytes:
    rows = q.reshape(-1, len(joint_names))
    columns = {name: array.reshape(-1) for name, array in more.items() if array.shape == q.shape[:-1]}
    buffer = io.StringIO(newline="")
    table = csv.writer(buffer, lineterminator="\n")
    clock = "frame" if frame_rate is None else "time [s]"
    table.writerow([clock, *(f"{name} [rad]" for name in joint_names), *columns])
    for frame, angles in enumerate(rows):
        when = frame if frame_rate is None else frame / frame_rate
        table.writerow([when, *map(_text, angles), *(_text(column[frame]) for column in columns.values())])
    return buffer.getvalue().encode()


def _text(value: np.generic) -> str:
    return str(int(value)) if value.dtype == np.bool_ else str(value)
