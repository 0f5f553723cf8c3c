"""Robot motions as MuJoCo's qpos: an .npz file whose `qpos` (T, nq) can be set frame by frame.

    for qpos in np.load("motion.npz")["qpos"]: data.qpos[:] = qpos; mujoco.mj_forward(model, data)

qpos: https://mujoco.readthedocs.io/en/stable/computation/index.html, "Joint positions"; with a free joint, its place
and its quaternion, w first, are the first seven numbers.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.npz import open_npz
from mrhubo.robot_motion.base import base_of
from mrhubo.robot_motion.motion import RobotMotion
from mrhubo.robot_motion.npz import write_arrays
from mrhubo.robot_motion.order import JointOrder, left_out
from mrhubo.robot_motion.plain import build

QPOS = "qpos"
_QUATERNION_ORDER = "wxyz"
_ROOT = 7
"""Numbers of a free joint."""


def write_mujoco(motion: RobotMotion, path: Path, order: JointOrder | None) -> tuple[str, ...]:
    """Writes `qpos`, and by name what its columns are; returns what had to be assumed, a sentence each.

    A free joint is written where the order's model has one, or the motion has a base that moves.
    """
    motion, notes = motion.single(), ()
    arrays: dict[str, Any] = {QPOS: motion.q, "joint_names": np.array(motion.joint_names, np.str_)}
    free = order.free_joint if order is not None else None
    if free is not None or motion.root_position is not None:
        place, turn, notes = base_of(motion, order)
        arrays[QPOS] = np.concatenate([place, turn, motion.q], axis=1)
        arrays |= {"free_joint": np.array(free or ""), "quaternion_order": np.array(_QUATERNION_ORDER)}
    if motion.frame_rate is not None:
        arrays["frame_rate"] = np.array(motion.frame_rate)
    write_arrays(path, {**arrays, "unit": np.array("rad")})
    return notes + left_out(motion, order)


def read_mujoco(path: Path) -> RobotMotion:
    """A motion from what `write_mujoco` writes.

    Raises:
        UserError: the file is missing, damaged, or another one.
    """
    with open_npz(path) as file:
        if missing := {QPOS, "joint_names"} - file.keys:
            raise UserError(f"{path}: '{sorted(missing)[0]}' is missing; expected 'qpos' and 'joint_names'")
        names = file.read("joint_names", "U")
        qpos = file.read(QPOS)
        facts: dict[str, Any] = {"joint_names": np.atleast_1d(names).tolist()}
        if "frame_rate" in file.keys:
            facts["frame_rate"] = float(file.read("frame_rate").reshape(-1)[0])
        order = str(file.read("quaternion_order", "U")) if "free_joint" in file.keys else None
    root = 0 if order is None else _ROOT
    if order not in (None, _QUATERNION_ORDER) or qpos.ndim != 2 or qpos.shape[1] != root + len(facts["joint_names"]):
        raise UserError(f"{path}: 'qpos' of shape {qpos.shape} does not fit to {len(facts['joint_names'])} joints"
                        f"{' and a free joint, its quaternion w first' if root else ''}")  # fmt: skip
    frames = {"q": qpos[:, root:]}
    if root:
        frames |= {"root_position": qpos[:, :3], "root_quaternion_wxyz": qpos[:, 3:root]}
    return build(facts, frames, path)
