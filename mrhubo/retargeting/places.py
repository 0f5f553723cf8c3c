"""Which files are retargeted, and where the answers go."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from mrhubo.errors import UserError
from mrhubo.files.regular import refuse_input
from mrhubo.motion import motion_files
from mrhubo.robot_motion import FORMATS, find_format
from mrhubo.robot_motion.lerobot import check_lerobot_folder

_DEFAULT = "npz"


def find_files(given: Sequence[Path]) -> list[Path]:
    """Files, and those of folders, in the order in which they are given, each once.

    Raises:
        UserError: a folder holds no motion.
    """
    found: dict[Path, None] = {}
    for path in given:
        found |= dict.fromkeys(motion_files(path) if path.is_dir() else [path])
    return list(found)


@dataclass
class Places:
    """Where robot motions are written."""

    out: Path
    format: str
    """A key of `FORMATS`."""
    is_folder: bool
    """Whether `out` is a folder with a file a motion."""
    inputs: Sequence[Path | str | None] = ()
    """What is read, and so not written over."""
    used: set[str] = field(default_factory=set)

    @property
    def is_dataset(self) -> bool:
        """Whether `out` is a folder that holds all motions together."""
        return not FORMATS[self.format].ending

    def path(self, name: str) -> Path:
        """Where the motion of a name goes; one whose name is taken gets a number.

        Raises:
            UserError: there is what is read.
        """
        if not self.is_folder or self.is_dataset:
            return self.out
        found, number = name, 1
        while found in self.used:
            number += 1
            found = f"{name}_{number}"
        self.used.add(found)
        path = self.out / f"{found}{FORMATS[self.format].ending}"
        refuse_input("--out", path, self.inputs)
        return path


def plan_places(
    out: str, format: str | None, inputs: Sequence[Path], others: Sequence[Path | str | None] = ()
) -> Places:
    """Where the answers to some motions go.

    Args:
        out: a file, or a folder: what is one, ends in a slash, or has no ending; with several motions always.
        format: a key of `FORMATS`; default: by the ending of a file, else .npz.
        inputs: the motions' files.
        others: what else is read.

    Raises:
        UserError: there is no such format, several motions would go into one file, or one over what is read.
    """
    path = Path(out)
    known = None if format is None else find_format(path, format)
    if known is not None and not FORMATS[known].ending:
        check_lerobot_folder(path)
        return _usable(Places(path, known, is_folder=True))
    is_folder = path.is_dir() or out.endswith((os.sep, "/")) or not path.suffix
    if len(inputs) > 1 and not is_folder:
        raise UserError(f"--out {out}: {len(inputs)} motions do not go into one file; name a folder, for instance "
                        f"{path.with_suffix('')}/")  # fmt: skip
    if is_folder and path.is_file():
        raise UserError(f"--out {out}: is a file; name a folder, or a file with an ending")
    places = Places(path, known or (_DEFAULT if is_folder else find_format(path)), is_folder, (*inputs, *others))
    for likely in (path / f"{file.stem}{FORMATS[places.format].ending}" if is_folder else path for file in inputs):
        refuse_input("--out", likely, places.inputs)
    return _usable(places)


def _usable(places: Places) -> Places:
    """Themselves, if what writes their format is installed."""
    if (library := FORMATS[places.format].library) is not None:
        library()
    return places
