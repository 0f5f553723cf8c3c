"""Human motions from Acclaim's files: an .amc file with the motion, and the .asf file with its skeleton beside it.

Legend: T frames.
"""

from __future__ import annotations

import re
from pathlib import Path

from mrhubo.errors import UserError, listed
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.asf_file import read_amc, read_asf
from mrhubo.motion.readers.content import Content
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import asked_rate
from mrhubo.motion.readers.tree.convert import Given, tree_motion
from mrhubo.motion.readers.tree.given import read_map


def is_amc(content: Content) -> bool:
    """Whether a file looks like an .amc file: comments and colon words, a frame's number, then the root."""
    return content.text is not None and bool(
        re.match(
            r"\s*+(?:[#:][^\n]*+\n\s*+)*+\d++[ \t\r]*+\n\s*+root(?:\s++-?[\d.]++(?:e[-+]?\d++)?){6}",
            content.text,
            re.IGNORECASE,
        )
    )


def read_acclaim(path: Path, options: ReadOptions) -> Motion:
    """Reads an .amc file and the .asf file beside it: that whose name is the longest beginning of the motion's, up to a
    `_` (`02.asf` for `02_01.amc`, `HDM_bd.asf` for `HDM_bd_01-01_01_120.amc`), or the only one.

    The files cannot say their frame rate: it is asked for.

    Raises:
        UserError: a file is missing, damaged or too large, no human is found in them, or the frame rate is not known.
    """
    skeleton = read_asf(_find_skeleton(path))
    rate = asked_rate(path, options, "an .amc file does not tell its frame rate (most of CMU's and HDM05's have 120)")
    tree, notes = read_amc(path, skeleton)
    notes = [*options.of_one(), *notes]
    given = read_map(options.bvh_map, tree, path) if options.bvh_map else Given()
    kind = f"ASF/AMC files, skeleton {skeleton.path.name}:"
    return tree_motion(tree, motion_name(path), str(path), rate, kind, given, tuple(notes))


def _find_skeleton(path: Path) -> Path:
    try:
        found = sorted(file for file in path.parent.iterdir() if file.suffix.lower() == ".asf")
    except OSError as error:
        raise UserError(f"{path.parent}: cannot be read: {error.strerror or error}") from error
    if named := [file for file in found if f"{path.stem}_".startswith(f"{file.stem}_")]:
        return max(named, key=lambda file: len(file.stem))
    if len(found) == 1:
        return found[0]
    beside = f"beside it are {listed(file.name for file in found)}" if found else "there is none beside it"
    raise UserError(
        f"{path}: needs the .asf file with its skeleton, whose name begins as the motion's, up to a '_' (02.asf for"
        f" 02_01.amc); {beside}; put it into the same folder"
    )
