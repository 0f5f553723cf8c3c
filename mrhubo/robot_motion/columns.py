"""A robot motion as a table: a row a frame, columns with a name and a unit. For .csv and .parquet."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mrhubo.errors import UserError
from mrhubo.robot_motion.clock import find_rate, seconds
from mrhubo.robot_motion.motion import RobotMotion

TIME, FRAME = "time [s]", "frame"
_RAD, _DEG = " [rad]", " [deg]"
_ROOT = {
    "root_position": ("root_x [m]", "root_y [m]", "root_z [m]"),
    "root_quaternion_wxyz": ("root_qw", "root_qx", "root_qy", "root_qz"),
}
_SINGLE = ("confidence", "phi", "collision")
_BRANCH, _ERROR, _CONTACT = "confidence_", "error_", "contact_"
"""What the names of columns of a branch's confidence, of a direction's error and of a foot's contact begin with."""


def to_columns(motion: RobotMotion) -> dict[str, np.ndarray]:
    """Columns (T,) by name; a single pose is one row.

    Raises:
        UserError: the motion has several leading axes, so it is more than one.
    """
    single = motion.single()
    frame_T = np.arange(single.frames)
    clock = {FRAME: frame_T} if single.frame_rate is None else {TIME: seconds(frame_T, single.frame_rate)}
    columns: dict[str, np.ndarray] = {**clock, **_split(single.q, [f"{name}{_RAD}" for name in single.joint_names])}
    for field, names in _ROOT.items():
        columns |= _split(getattr(single, field), names)
    for field in _SINGLE:
        if (array := getattr(single, field)) is not None:
            columns[field] = array
    columns |= _split(single.contact, [f"{_CONTACT}{name}" for name in single.contact_names])
    columns |= _split(single.branch_confidence, [f"{_BRANCH}{name}" for name in single.branch_names])
    return columns | _split(single.direction_error_deg, [f"{_ERROR}{name}{_DEG}" for name in single.direction_names])


def from_columns(columns: Mapping[str, np.ndarray]) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Facts and arrays a frame (`mrhubo.robot_motion.plain.build`) that columns (T,) of numbers tell; unknown columns
    are passed over.

    Raises:
        UserError: no column holds a joint's angles, or the times are uneven.
    """
    joints = [name for name in columns if name.endswith(_RAD)]
    branches = [name for name in columns if name.startswith(_BRANCH)]
    errors = [name for name in columns if name.startswith(_ERROR) and name.endswith(_DEG)]
    contacts = [name for name in columns if name.startswith(_CONTACT)]
    if not joints:
        raise UserError("no column is named 'JOINT [rad]'; the header names every joint and its unit")
    facts: dict[str, Any] = {
        "joint_names": [name.removesuffix(_RAD) for name in joints],
        "branch_names": [name.removeprefix(_BRANCH) for name in branches],
        "direction_names": [name.removeprefix(_ERROR).removesuffix(_DEG) for name in errors],
        "contact_names": [name.removeprefix(_CONTACT) for name in contacts],
    }
    if TIME in columns and (rate := find_rate(columns[TIME], seconds)) is not None:
        facts["frame_rate"] = rate
    frames = {"q": _join(columns, joints)}
    if branches:
        frames["branch_confidence"] = _join(columns, branches)
    if errors:
        frames["direction_error_deg"] = _join(columns, errors)
    if contacts:
        frames["contact"] = _join(columns, contacts)
    for field, names in _ROOT.items():
        if all(name in columns for name in names):
            frames[field] = _join(columns, names)
    return facts, {**frames, **{field: columns[field] for field in _SINGLE if field in columns}}


def _split(array_TX: np.ndarray | None, names: Any) -> dict[str, np.ndarray]:
    return {} if array_TX is None else dict(zip(names, array_TX.T, strict=True))


def _join(columns: Mapping[str, np.ndarray], names: Any) -> np.ndarray:
    return np.stack([columns[name] for name in names], axis=-1)
