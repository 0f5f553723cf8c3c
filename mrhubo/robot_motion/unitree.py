"""Robot motions as the .csv files that Unitree's retargeted LAFAN1 has and BeyondMimic reads: no header, a row a frame.

Base x, y, z [m], quaternion x, y, z, w, then a joint an angle [rad]: "root_joint(XYZQXQYQZQW)" and the joints of the
README of https://huggingface.co/datasets/lvhaidong/LAFAN1_Retargeting_Dataset (30 frames a second);
scripts/csv_to_npz.py of https://github.com/HybridRobotics/whole_body_tracking takes the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.robot_motion.base import W_FIRST, W_LAST, base_of
from mrhubo.robot_motion.clock import in_full
from mrhubo.robot_motion.motion import RobotMotion
from mrhubo.robot_motion.order import JointOrder, left_out
from mrhubo.robot_motion.plain import build
from mrhubo.robot_motion.tables import read_rows, read_text, write_rows

_ROOT = 7


def write_unitree(motion: RobotMotion, path: Path, order: JointOrder | None) -> tuple[str, ...]:
    """Writes rows without a header; returns what had to be assumed, and what such a file cannot tell."""
    motion = motion.single()
    place, turn, notes = base_of(motion, order)
    rows = np.concatenate([place, turn[:, W_LAST], motion.q], axis=1)
    write_rows(path, list(rows.T))
    rate = "unknown" if motion.frame_rate is None else in_full(motion.frame_rate)
    return (
        *notes,
        *left_out(motion, order),
        f"such a file names neither joints nor its frame rate, which is {rate}: tell who reads it",
    )


def read_unitree(path: Path, joint_names: Sequence[str], frame_rate: float | None = None) -> RobotMotion:
    """A motion from such a file, whose joints and frame rate are told beside.

    Raises:
        UserError: the file is missing, no table of numbers, or has another number of columns.
    """
    rows = read_rows(path, read_text(path))
    if rows.shape[1] != _ROOT + len(joint_names):
        raise UserError(
            f"{path}: has {rows.shape[1]} columns; expected {_ROOT} of the base and {len(joint_names)} joints"
        )
    frames = {"q": rows[:, _ROOT:], "root_position": rows[:, :3], "root_quaternion_wxyz": rows[:, 3:_ROOT][:, W_FIRST]}
    facts = {"joint_names": list(joint_names)}
    return build(facts if frame_rate is None else {**facts, "frame_rate": frame_rate}, frames, path)
