"""How many frames a second a file has: what it says, or what the user does; it is never guessed."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.motion.readers.options import RATES, NoRate, ReadOptions

RATE_KEYS = ("mocap_frame_rate", "mocap_framerate", "frame_rate", "framerate", "fps")
"""What files call it; the first two are AMASS's."""


def find_rate(
    path: Path, keys: Collection[str], read: Callable[[str], np.ndarray], options: ReadOptions, notes: list[str]
) -> float:
    """Frames per second.

    Args:
        path: the file, for sentences.
        keys: what it holds.
        read: gives the array of a key.
        options: may tell the rate of a file that does not.
        notes: is told if the file and the options disagree.

    Raises:
        UserError: neither says, or what the file says is no rate.
    """
    key = next((key for key in RATE_KEYS if key in keys), None)
    if key is None:
        return asked_rate(path, options)
    array = read(key)
    if array.size != 1:
        raise UserError(f"{path}: '{key}' has shape {array.shape}; expected one number")
    return told_rate(path, f"'{key}' is", float(array.reshape(())), options, notes)


def told_rate(path: Path, said: str, rate: float, options: ReadOptions, notes: list[str]) -> float:
    """The rate that a file tells, which goes before that of the options.

    Args:
        path: the file, for sentences.
        said: how the file tells it, for the beginning of a sentence.
        rate: what it tells.
        options: may tell another.
        notes: is told if they do.

    Raises:
        UserError: it is no rate.
    """
    check_rate(path, said, rate)
    if options.rate is not None and options.rate != rate:
        notes.append(f"the rate of {options.rate:g} that was given is left out: the file says {rate:g}")
    return rate


def check_rate(path: Path, said: str, rate: float) -> None:
    """Refuses what is no rate; arguments as for `told_rate`."""
    low, high = RATES
    if not low <= rate <= high:
        raise UserError(f"{path}: {said} {rate:g} frames per second; expected {low:g} to {high:g}")


def asked_rate(path: Path, options: ReadOptions) -> float:
    """The rate that the options tell.

    Raises:
        NoRate: they do not.
    """
    if options.rate is None:
        raise NoRate(path, "holds no frame rate")
    return float(options.rate)
