"""Robot motions as GMR's pickles: a dictionary of `fps`, `root_pos` (T, 3) [m], `root_rot` (T, 4), a quaternion with w
last, and `dof_pos` (T, N) [rad], in the order of a MuJoCo model's joints (https://github.com/YanjieZe/GMR,
scripts/smplx_to_robot.py). TWIST learns from them, and MimicKit, ProtoMotions and others convert them.

`local_body_pos` and `link_body_list` are None, as in GMR's own; `joint_names` is beside, which others pass over.
"""

from __future__ import annotations

import io
import pickle
import pickletools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.atomic import atomic_path
from mrhubo.files.tree import read_tree
from mrhubo.robot_motion.base import W_FIRST, W_LAST, base_of
from mrhubo.robot_motion.motion import RobotMotion
from mrhubo.robot_motion.order import JointOrder, left_out
from mrhubo.robot_motion.plain import build

_PROTOCOL = 2
"""In which names of modules are lines of text."""
_NEW, _OLD = "numpy._core.", "numpy.core."
"""What NumPy 2 calls its modules, and what both it and NumPy 1 know, with which simulators still run."""
_KEYS = {"fps", "root_pos", "root_rot", "dof_pos"}


def write_gmr(motion: RobotMotion, path: Path, order: JointOrder | None) -> tuple[str, ...]:
    """Writes the pickle; returns what had to be assumed, and what such a file cannot tell.

    Raises:
        UserError: the motion's frame rate is not known.
    """
    motion = motion.single()
    if motion.frame_rate is None:
        raise UserError("its frame rate is not known, without which GMR's files are none")
    place_T3, turn_T4, notes = base_of(motion, order)
    rate = motion.frame_rate
    value = {
        "fps": int(rate) if rate == int(rate) else rate,
        "root_pos": np.ascontiguousarray(place_T3),
        "root_rot": np.ascontiguousarray(turn_T4[:, W_LAST]),
        "dof_pos": np.ascontiguousarray(motion.q),
        "local_body_pos": None,
        "link_body_list": None,
        "joint_names": list(motion.joint_names),
    }
    with atomic_path(path) as part:
        part.write_bytes(_for_any_numpy(pickle.dumps(value, _PROTOCOL)))
    return (*notes, *left_out(motion, order))


def read_gmr(path: Path, joint_names: Sequence[str] = ()) -> RobotMotion:
    """A motion from such a file; nothing in it is run.

    Args:
        path: the file.
        joint_names: of a file that does not tell them, as GMR's own do not.

    Raises:
        UserError: the file is missing, damaged, hostile or another one, or its joints are not known.
    """
    tree = read_tree(path)
    if missing := sorted(_KEYS - set(tree.keys)):
        raise UserError(f"{path}: is {tree.described}, and no robot motion as GMR writes it: '{missing[0]}' is missing")
    told = tree.get("joint_names", "dof_names")
    names = list(joint_names) or ([] if told is None else told.texts())
    q, place, turn = (tree[key].array() for key in ("dof_pos", "root_pos", "root_rot"))
    if not names:
        asked = "joint_names=[...], or --joint-order FILE"
        raise UserError(f"{path}: does not tell its joints, so they have to be named: {asked}")
    if q.ndim != 2 or (q.shape, place.shape, turn.shape) != ((len(q), len(names)), (len(q), 3), (len(q), 4)):
        raise UserError(
            f"{path}: 'dof_pos', 'root_pos' and 'root_rot' have shapes {q.shape}, {place.shape} and {turn.shape};"
            f" expected (frames, {len(names)}), (frames, 3) and (frames, 4)"
        )
    facts: dict[str, Any] = {"joint_names": names, "frame_rate": tree["fps"].number()}
    frames = {"q": q, "root_position": place, "root_quaternion_wxyz": turn[:, W_FIRST]}
    return build(facts, {name: array.astype(np.float32) for name, array in frames.items()}, path)


def _for_any_numpy(data: bytes) -> bytes:
    """A pickle of protocol 2 with the names of NumPy's modules that all its versions know."""
    found, done = io.BytesIO(), 0
    for opcode, argument, start in pickletools.genops(data):
        if opcode.name == "GLOBAL" and isinstance(argument, str) and argument.startswith(_NEW) and start is not None:
            module, name = argument.split(" ")
            found.write(data[done:start] + f"c{_OLD}{module.removeprefix(_NEW)}\n{name}\n".encode())
            done = start + len(f"c{module}\n{name}\n".encode())
    found.write(data[done:])
    return found.getvalue()
