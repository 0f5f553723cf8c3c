"""A robot motion as what files hold: facts, which are plain text and numbers, and an array for each field that has a
value a frame. One layout for .npz, .json and the header of .parquet.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, encodable, shortened
from mrhubo.robot_motion.motion import PER_FRAME, FollowingJoint, RobotFacts, RobotMotion

FORMAT = "mrhubo.robot_motion/1"
UNIT = "rad"
_BLOCK = 2**16
"""Numbers."""
TEXTS = ("format", "unit", "name", "source", "robot", "made_by", "checksum")
NAME_LISTS = ("joint_names", "branch_names", "direction_names", "contact_names", "other_names", "other_follows")
NUMBERS = ("frame_rate",)
NUMBER_LISTS = ("lower_rad", "upper_rad", "velocity_rad_s", "other_multiplier", "other_offset_rad")
FACTS = (*TEXTS, *NAME_LISTS, *NUMBERS, *NUMBER_LISTS)
"""Names of all facts; `q` and `joint_names` alone are needed."""


def facts_of(motion: RobotMotion) -> dict[str, Any]:
    """The facts that are known, as text, numbers and lists of them."""
    robot, others = motion.robot, motion.robot.others
    found: dict[str, Any] = {
        "format": FORMAT,
        "unit": UNIT,
        "joint_names": list(motion.joint_names),
        "frame_rate": motion.frame_rate,
        "name": motion.name,
        "source": motion.source,
        "robot": robot.name,
        "made_by": robot.made_by,
        "checksum": robot.checksum,
        "branch_names": list(motion.branch_names),
        "direction_names": list(motion.direction_names),
        "contact_names": list(motion.contact_names),
        "lower_rad": None if robot.lower is None else short(robot.lower),
        "upper_rad": None if robot.upper is None else short(robot.upper),
        "velocity_rad_s": None if robot.velocity is None else short(robot.velocity),
        "other_names": [other.name for other in others],
        "other_follows": [other.joint for other in others],
        "other_multiplier": [other.multiplier for other in others],
        "other_offset_rad": [other.offset for other in others],
    }
    found |= {key: encodable(found[key]) for key in TEXTS}
    return {key: value for key, value in found.items() if value is not None and value != [] and value != ""}


def frames_of(motion: RobotMotion) -> dict[str, np.ndarray]:
    """The arrays with a value a frame that are known, by name."""
    return {name: getattr(motion, name) for name in PER_FRAME if getattr(motion, name) is not None}


def build(facts: Mapping[str, Any], frames: Mapping[str, np.ndarray], path: Path) -> RobotMotion:
    """The motion that a file tells.

    Args:
        facts: as `facts_of` gives them; unknown ones are passed over.
        frames: as `frames_of`.
        path: the file, for messages.

    Raises:
        UserError: something is missing, of another type, or does not fit to the rest.
    """
    try:
        if "q" not in frames or "joint_names" not in facts:
            missing = "q" if "q" not in frames else "joint_names"
            raise UserError(f"'{missing}' is missing; a robot motion has 'q' [rad] and 'joint_names' at least")
        told = {key: _checked(key, facts[key]) for key in FACTS if key in facts}
        if told.get("unit", UNIT) != UNIT:
            raise UserError(f"its unit is '{shortened(told['unit'])}'; expected joint angles in 'rad'")
        robot = RobotFacts(
            name=told.get("robot", ""),
            made_by=told.get("made_by", ""),
            checksum=told.get("checksum", ""),
            lower=told.get("lower_rad"),
            upper=told.get("upper_rad"),
            velocity=told.get("velocity_rad_s"),
            others=_others(told),
        )
        return RobotMotion(
            joint_names=told["joint_names"],
            frame_rate=told.get("frame_rate"),
            name=told.get("name", ""),
            source=told.get("source", ""),
            robot=robot,
            branch_names=told.get("branch_names", ()),
            direction_names=told.get("direction_names", ()),
            contact_names=told.get("contact_names", ()),
            **{name: frames[name] for name in PER_FRAME if name in frames},
        )
    except UserError as error:
        raise UserError(f"{path}: {error}") from error


def short(array: np.ndarray) -> Any:
    """Float32 numbers as lists of the shortest decimals that tell them apart; flags as they are. Of many, block by
    block (`blocks`).
    """
    is_text = array.size and array.dtype != np.bool_
    return (array.astype(np.str_).astype(np.float64) if is_text else array).tolist()


def blocks(rows: int, width: int) -> Iterator[slice]:
    """Slices of a table's rows, to be made text one after the other: a number takes 130 bytes as text in an array."""
    step = max(1, _BLOCK // max(1, width))
    return (slice(first, first + step) for first in range(0, rows, step))


def _checked(key: str, value: Any) -> Any:
    if key in TEXTS:
        good = isinstance(value, str)
    elif key in NUMBERS:
        good = isinstance(value, int | float) and not isinstance(value, bool)
    elif key in NAME_LISTS:
        good = isinstance(value, list) and all(isinstance(item, str) for item in value)
    else:
        good = isinstance(value, list) and all(type(item) in (int, float) for item in value)
    if not good:
        raise UserError(f"'{key}' holds {shortened(value)}, which is not what belongs there")
    return value


def _others(told: Mapping[str, Any]) -> tuple[FollowingJoint, ...]:
    columns = [told.get(key, ()) for key in ("other_names", "other_follows", "other_multiplier", "other_offset_rad")]
    if len({len(column) for column in columns}) != 1:
        raise UserError("'other_names' and what is told of these joints have different lengths")
    return tuple(FollowingJoint(*row) for row in zip(*columns, strict=True))
