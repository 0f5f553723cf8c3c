"""Robot motions as .json files: all that .npz files hold, for programs that have no NumPy.

JSON: https://www.rfc-editor.org/rfc/rfc8259
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.atomic import atomic_path
from mrhubo.robot_motion.motion import PER_FRAME, RobotMotion
from mrhubo.robot_motion.plain import blocks, build, facts_of, frames_of, short
from mrhubo.robot_motion.tables import read_text


def write_json(motion: RobotMotion, path: Path) -> None:
    """Writes one object with a key a field, atomically."""
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8") as file:
        file.write(json.dumps(facts_of(motion), ensure_ascii=False).removesuffix("}"))
        for name, array in frames_of(motion).items():
            file.write(f', "{name}": ')
            file.writelines(_text(array))
        file.write("}\n")


def _text(array: np.ndarray) -> Iterator[str]:
    """An array as JSON, part by part."""
    if not array.size or not array.ndim:
        yield json.dumps(short(array))
        return
    for block in blocks(len(array), array.size // len(array)):
        yield (", " if block.start else "[") + json.dumps(short(array[block]))[1:-1]
    yield "]"


def read_json(path: Path) -> RobotMotion:
    """A motion from a .json file as `write_json` writes it.

    Raises:
        UserError: the file is missing, damaged, too large, or holds no robot motion.
    """
    try:
        told = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path}: is no JSON: {type(error).__name__}") from error
    if not isinstance(told, dict):
        raise UserError(f"{path}: is no JSON object, as a robot motion is")
    return build(told, {name: _array(path, name, told[name]) for name in PER_FRAME if name in told}, path)


def _array(path: Path, name: str, value: Any) -> np.ndarray:
    try:
        array = np.array(value)
    except Exception:  # lists of different lengths
        array = np.array(None)
    if array.dtype.kind not in "fiub":
        raise UserError(f"{path}: '{name}' holds no array of numbers")
    return array
