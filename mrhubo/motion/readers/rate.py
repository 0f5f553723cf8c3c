"""How many frames a second a file has: what it says, or what the user does; it is never guessed."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.tree import Tree
from mrhubo.motion.readers.options import RATES, NoRate, ReadOptions
from mrhubo.robot_motion.clock import find_rate as find_even_rate

RATE_KEYS = (
    "mocap_frame_rate", "mocap_framerate", "frame_rate", "framerate", "frameRate", "fps", "FPS", "video_fps",
    "motion_fps", "mocap_fps", "frames_per_second",
)  # fmt: skip
"""What files call it; the first two are AMASS's."""
TIME_KEYS = ("timestamps", "timestamps_s", "timestamps_ms", "timestamps_us", "timestamps_ns", "timestamp", "times",
             "time", "frame_times", "frame_timestamps")  # fmt: skip
"""What files call the times of their frames."""
_SAMPLE_KEYS = ("sample_rate", "sampling_rate", "sampleRate", "samplingRate", "sampling_frequency", "hz", "Hz")
"""What files may call it, if it is one of frames and not of a sound beside them."""
_STEP_KEYS = ("dt", "frame_time", "frametime", "frameTime", "time_step", "timestep")
"""What files call the time from a frame to the next [s]."""
_UNITS = (1.0, 1e-3, 1e-6, 1e-9)
"""Seconds, and what else times are told in: of a usual rate, in each unit steps are of another size."""
_NUMBERS = 8.0
"""Whole steps that are smaller may be between numbers of frames."""


def find_rate(path: Path, nodes: Iterable[Tree], options: ReadOptions, notes: list[str]) -> float:
    """Frames per second.

    Args:
        path: the file, for sentences.
        nodes: dictionaries that may tell it, the likeliest first.
        options: may tell the rate of a file that does not.
        notes: is told if the file and the options disagree, or the file leaves it open.

    Raises:
        UserError: neither says.
    """
    open_ones: list[str] = []
    for node in nodes:
        told = rate_in(node, open_ones)
        if told is not None:
            return told_rate(path, f"'{told[0]}' is", told[1], options, notes)
    rate = asked_rate(path, options, next(iter(open_ones), ""))
    notes += open_ones[:1]
    return rate


def rate_of_all(rate: float, who: str, options: ReadOptions, notes: list[str]) -> float:
    """Frames per second of files that do not tell, whose makers say that all theirs have so many: that, with a note of
    `who` says so, or what the options tell.
    """
    if options.rate is not None:
        return float(options.rate)
    notes.append(f"{rate:g} frames a second, as {who}; --rate says otherwise")
    return rate


def rate_in(node: Tree, notes: list[str]) -> tuple[str, float] | None:
    """The key of a dictionary that tells a rate, and what it tells; None where none does, and a note of each that
    leaves it open.
    """
    keys, open_ones = set(node.keys), []
    for key in RATE_KEYS:
        if key in keys:
            number = number_told(node[key])
            if number is not None:
                return key, number
            open_ones.append(f"'{key}' tells no frame rate{_in_words(node[key])}")
    for key in _SAMPLE_KEYS:
        number = number_told(node[key]) if key in keys else None
        if number is not None and RATES[0] <= number <= RATES[1]:
            return key, number
    for key in TIME_KEYS:
        number = rate_of_times(node[key]) if key in keys else None
        if number is not None:
            return key, number
    for key in _STEP_KEYS:
        step = number_told(node[key]) if key in keys else None
        if step is not None and 1 / RATES[1] <= step <= 1 / RATES[0]:
            return key, 1 / step
    notes += open_ones
    return None


def frames_a_second(node: Tree, notes: list[str]) -> float | None:
    """What `rate_in` finds, whatever the key."""
    told = rate_in(node, notes)
    return None if told is None else told[1]


def rate_of_times(node: Tree) -> float | None:
    """Frames per second of evenly spaced times, in seconds, milli-, micro- or nanoseconds; None of any other."""
    try:
        array = node.array() if node.text() is None else np.zeros(0)
    except UserError:
        return None
    return rate_of_even(array.ravel()) if array.size == max(array.shape, default=0) else None


def rate_of_even(time_T: np.ndarray) -> float | None:
    """The same of an array (T,)."""
    if time_T.dtype.kind not in "fiu" or len(time_T) < 3:
        return None
    step_T = np.diff(time_T - time_T[0] if time_T.dtype.kind == "f" else time_T.astype(np.int64) - int(time_T[0]))
    step = float(np.median(step_T))
    low, high = RATES
    unit = next((unit for unit in _UNITS if 1 / high < step * unit < 1 / low), None)
    if not np.isfinite(step_T).all() or unit is None or (step < _NUMBERS and step == round(step)):
        return None
    try:
        return find_even_rate(unit * np.concatenate([[0.0], np.cumsum(step_T)]), lambda frame_T, rate: frame_T / rate)
    except UserError:  # not evenly spaced
        return None


def rate_of_seconds(time_T: np.ndarray) -> float | None:
    """Frames per second of times in seconds; None where they are in other units, or not evenly spaced. Of no other unit
    are steps as long as those of a frame.
    """
    low, high = RATES
    step_T = np.diff(time_T)
    if not len(step_T) or not np.isfinite(step_T).all() or not 1 / high <= np.median(step_T) <= 1 / low:
        return None
    try:
        return find_even_rate(time_T, lambda frame_T, rate: frame_T / rate)
    except UserError:
        return None


def rate_in_words(word: str) -> float | None:
    """Frames per second that a word tells, perhaps with a decimal comma; None where it is none that is believed."""
    try:
        rate = float(word.replace(",", "."))
    except ValueError:
        return None
    return rate if RATES[0] <= rate <= RATES[1] else None


def number_told(node: Tree) -> float | None:
    """The number above 0 that a node tells, also as a text or as many that are equal; None where it leaves that open,
    as `None`, 0, NaN, an empty text, or whatever else is none.
    """
    try:
        text = node.text()
        if text is not None:
            number = float(text)
        else:
            array = node.array()
            if not array.size or array.dtype.kind == "b" or not (array == array.flat[0]).all():
                return None
            number = float(array.flat[0])
    except (UserError, ValueError):  # no array; no number
        return None
    return number if 0 < number < math.inf else None


def _in_words(node: Tree) -> str:
    """What a node that tells no rate is, for the end of a sentence; nothing where that says nothing."""
    try:
        text, shape = node.text(), node.shape()
    except UserError:  # it cannot be read
        return ""
    if text is not None:
        return f": it is '{shortened(text, 20)}'"
    if shape is not None and math.prod(shape) == 1:
        return f": it is {node.array().item()!s:.20}"
    return "" if node.is_none else f": it is {node.described}"


def told_rate(path: Path, said: str, rate: float, options: ReadOptions, notes: list[str]) -> float:
    """The rate that a file tells, which goes before that of the options; one that is not believed does not.

    Args:
        path: the file, for sentences.
        said: how the file tells it, for the beginning of a sentence.
        rate: what it tells.
        options: may tell another.
        notes: is told if they do.

    Raises:
        UserError: it is not believed, and the options tell none.
    """
    low, high = RATES
    if not low <= rate <= high:
        said = f"{said} {rate:g} frames per second; expected {low:g} to {high:g}"
        if options.rate is None:
            raise NoRate(path, said)
        notes.append(f"{said}; {options.rate:g} are taken, as given")
        return float(options.rate)
    if options.rate is not None and options.rate != rate:
        notes.append(f"the rate of {options.rate:g} that was given is left out: the file says {rate:g}")
    return rate


def asked_rate(path: Path, options: ReadOptions, why: str = "") -> float:
    """The rate that the options tell.

    Args:
        path: the file, for sentences.
        options: may tell it.
        why: the file does not, as a note says it, if that is known.

    Raises:
        NoRate: they do not.
    """
    if options.rate is None:
        raise NoRate(path, why or "holds no frame rate")
    return float(options.rate)
