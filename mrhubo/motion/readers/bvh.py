"""Human motions from BVH files of any maker.

Legend: T frames.
"""

from __future__ import annotations

from pathlib import Path

from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.bvh_file import read_bvh_file
from mrhubo.motion.readers.content import Content
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.options import RATES, NoRate, ReadOptions
from mrhubo.motion.readers.rate import asked_rate
from mrhubo.motion.readers.tree.convert import Given, tree_motion
from mrhubo.motion.readers.tree.given import read_map
from mrhubo.motion.readers.tree.people import of_person


def is_bvh(content: Content) -> bool:
    """Whether a file begins as a BVH file does."""
    return content.start.lstrip(b"\xef\xbb\xbf \t\r\n")[:9].upper() == b"HIERARCHY"


def read_bvh(path: Path, options: ReadOptions) -> Motion:
    """Reads a BVH file; which joint is which is found out (`mrhubo.motion.readers.tree.anatomy`).

    Raises:
        UserError: the file is missing, damaged or too large, or no human is found in it.
    """
    tree, rates, notes = read_bvh_file(path)
    rate = options.rate
    told = next(
        (rate for rate in rates if options.rate and abs(rate / options.rate - 1) < 1e-3), next(iter(rates), None)
    )
    low, high = RATES
    if told is not None and not low <= told <= high:
        said = f"'Frame Time' makes {told:.3g} frames per second"
        if rate is None:
            raise NoRate(path, f"{said}; expected {low:g} to {high:g}")
        notes.append(f"{said}; {rate:g} are taken, as given")
    elif told is not None:
        if rate is None and len(rates) > 1:
            others = " or ".join(f"{other:.4g}" for other in rates[1:])
            notes.append(
                f"'Frame Time' is rounded to a single digit: {told:.4g} frames per second are taken, and it may be"
                f" {others}; --rate says otherwise"
            )
        if rate is not None and abs(rate / told - 1) > 1e-3:
            notes.append(f"the file says {told:.6g} frames per second, which is believed, and not {rate:g}")
        rate = told
    if rate is None:
        rate = asked_rate(path, options)
    tree = of_person(path, tree, options, notes)
    given = read_map(options.bvh_map, tree, path) if options.bvh_map else Given()
    return tree_motion(tree, motion_name(path), str(path), rate, "BVH file:", given, tuple(notes))
