"""What a user names as a robot: a URDF, a MuJoCo model, or a robot of the package robot_descriptions."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import os
import re
from collections.abc import Iterator
from pathlib import Path

from mrhubo.config.shipped import shipped_configs
from mrhubo.errors import UserError, first_line, nearest, shortened

_DESCRIPTIONS = "robot_descriptions"
_PATHS = ("URDF_PATH", "MJCF_PATH")
_LONGEST_NAME = 40
_SAYS_NOTHING = {"description", "main", "model", "mujoco_model", "robot", "scene", "urdf"}
"""Names that files of many robots have, such as `model.urdf` (Gazebo, icub-models) and `robot.xml` (robosuite)."""
_DECLARED = re.compile(rb"""<(?:robot|mujoco)\b[^<>]*?\s(?:name|model)\s*=\s*["']([^"'<>]+)""")
_BEGINNING = 100_000
"""Bytes in which the first element of a robot's file stands."""


def find_model(word: str) -> Path:
    """The file that a word names: a path, or the name of a robot of robot_descriptions, such as `g1_description`.

    Raises:
        UserError: there is no such file, and no such robot, or the package cannot fetch it.
    """
    path = Path(word)
    if os.path.exists(path) or not re.fullmatch(r"\w+", word):
        if os.path.isdir(path):
            raise UserError(f"{path} is a folder; name the robot's file in it")
        if not os.path.exists(path):
            raise UserError(f"{path} does not exist; name a URDF or a MuJoCo model")
        return path
    if importlib.util.find_spec(_DESCRIPTIONS) is None:
        raise UserError(
            f"{_no_file(word)}; a robot of the package robot_descriptions can be named too, where it is installed: "
            "pip install robot_descriptions"
        )
    return _described(word)


def _described(word: str) -> Path:
    """The file of a robot of robot_descriptions, which fetches it when it is first asked for."""
    names = [word] if word.endswith("_description") else [f"{word}_description", f"{word}_mj_description", word]
    known = [name for name in names if importlib.util.find_spec(f"{_DESCRIPTIONS}.{name}") is not None]
    if not known:
        raise UserError(f"{_no_file(word)}, and no robot of the package robot_descriptions")
    try:
        module = importlib.import_module(f"{_DESCRIPTIONS}.{known[0]}")
    except Exception as error:  # git, the network, the disk: whatever fetching runs into
        raise UserError(
            f"{known[0]}: robot_descriptions cannot fetch it: {shortened(first_line(error), 300)}"
        ) from error
    found = next((path for name in _PATHS if (path := getattr(module, name, None)) is not None), None)
    if found is None:
        raise UserError(f"{known[0]}: robot_descriptions has neither a URDF nor a MuJoCo model of it")
    return Path(found)


def _no_file(word: str) -> str:
    near = nearest(word, shipped_configs())
    return f"'{word}' is no file" + (f" (a config that ships with mrhubo: '{near}')" if near is not None else "")


def model_name(path: Path) -> str:
    """What a robot is called where nobody says it: as its file, or as the file says where the file's own name, such as
    `model.urdf`, says nothing. Letters, digits, `-` and `_`.
    """
    name = _plain(path.name.partition(".")[0])
    if name.lower() in _SAYS_NOTHING:
        declared = _declared_name(path)
        name = name if declared.lower() in _SAYS_NOTHING else declared or name
    return name or "robot"


def _declared_name(path: Path) -> str:
    """What the first element of a file calls it; nothing where it does not, or where the file cannot be read, of which
    its reader tells.
    """
    with contextlib.suppress(OSError), path.open("rb") as file:
        if (found := _DECLARED.search(file.read(_BEGINNING))) is not None:
            return _plain(found[1].decode(errors="replace"))
    return ""


def _plain(name: str) -> str:
    letters = "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in name)
    return letters.strip("_-")[:_LONGEST_NAME]


@contextlib.contextmanager
def model_named(model: Path, urdf: Path) -> Iterator[None]:
    """A `UserError` in here about `robot.urdf`, or about a URDF that was made of the model, is about the file that the
    user has named.
    """
    try:
        yield
    except UserError as error:
        text = str(error).removeprefix("robot.urdf: ").replace("; name a URDF file, relative to the YAML", "")
        error.args = (text.replace(str(urdf), str(model)),)
        raise
