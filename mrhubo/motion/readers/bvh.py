"""Human motions from BVH files of any maker.

Legend: T frames.
"""

from __future__ import annotations

from pathlib import Path

from mrhubo.errors import UserError
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.bvh_file import read_bvh_file
from mrhubo.motion.readers.content import Content
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import check_rate
from mrhubo.motion.readers.tree.convert import Given, tree_motion
from mrhubo.motion.readers.tree.given import read_map


def is_bvh(content: Content) -> bool:
    """Whether a file begins as a BVH file does."""
    text = content.text
    return text is not None and text.lstrip("\ufeff \t\r\n")[:9].upper() == "HIERARCHY"


def read_bvh(path: Path, options: ReadOptions) -> Motion:
    """Reads a BVH file; which joint is which is found out (`mrhubo.motion.readers.tree.anatomy`).

    Raises:
        UserError: the file is missing, damaged or too large, or no human is found in it.
    """
    tree, seconds, notes = read_bvh_file(path)
    rate = options.rate
    if seconds is not None:
        check_rate(path, f"'Frame Time' is {seconds:g} s,", 1 / seconds)
        if rate is not None and abs(rate * seconds - 1) > 1e-3:
            notes.append(f"the file says {1 / seconds:.6g} frames per second, which is believed, and not {rate:g}")
        rate = 1 / seconds
    if rate is None:
        raise UserError(f"{path}: does not say how many frames a second it has; say so with --rate")
    given = read_map(options.bvh_map, tree, path) if options.bvh_map else Given()
    return tree_motion(tree, motion_name(path), str(path), rate, "BVH file:", given, tuple(notes))
