"""The frame rate of files that tell times in place of it: that of every frame, or the step from one to the next.

What is written is rounded: 0.033333 s is the step of 30 frames per second and not of 30.0003. Of the rates whose times
a file's digits are, the roundest is meant.

Legend: T frames, S frames of another rate, X numbers of a frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from decimal import Decimal

import numpy as np

from mrhubo.errors import UserError

_DIGITS = 17
"""Of a float64 that tell it apart from every other."""
_FEW = 7
"""Digits of a rate whose times agree with a file's to the last bit by no accident."""
_NTSC = tuple(rate * 1000 / 1001 for rate in (24, 30, 48, 60, 120, 240))
"""Rates of video that are no whole numbers (SMPTE ST 12-1)."""
_MOST_USUAL = (30.0, 60.0, 120.0, 24.0, 25.0, 50.0, 100.0, 240.0, 15.0, 90.0, 20.0, 12.0, 144.0, 200.0, 10.0)
"""Rates, the most usual first."""
_SINGLE, _DOUBLE = 2.0**-22, 2.0**-51
"""How far apart numbers lie, as a share of them, that are the same but for float32 and its texts, or for float64."""
_SURE, _FINEST = 6, 9
"""Decimals that times may have been rounded to: so few for sure, more if they are not those of float32; and at most."""
_SOME = 1_000
"""Times that are looked at."""
_COARSE, _FINE = 10, 1_000
"""A step tells a rounder rate than its reciprocal if it has so many units of its last digit; one that is the same
between all times of a file, and so most likely is exact, if it has so many.
"""
_CLOCKS = (1_000_000, 1_000)
"""Units of clocks that whole nanoseconds may come from: ms, us."""
STEADY = 0.2
"""Of a frame: so far may frames be from where a fixed rate has them; files round times to 1 ms."""
_UNEVEN = 0.1
"""How far a step may be from the mean one, as a share of it: whole milliseconds at 120 frames a second are off by 8%, a
frame that was dropped by 100%."""


def find_rate(time_T: np.ndarray, clock: Callable[[np.ndarray, float], np.ndarray]) -> float | None:
    """Frames per second of evenly spaced times; None for fewer than two frames, which tell none.

    Args:
        time_T: times (T,), in the file's unit.
        clock: the times that frames (T,) have at a rate, in the same unit.

    Raises:
        UserError: the times do not rise, or not evenly.
    """
    if len(time_T) < 2:
        return None
    step_T = np.diff(time_T.astype(np.float64)) / _second(clock)
    mean = float(step_T.mean())
    if not np.isfinite(step_T).all() or mean <= 0 or np.abs(step_T - mean).max() > _UNEVEN * mean:
        raise UserError("the times of its frames do not rise evenly; a robot motion has one frame rate")
    return rate_of_times(time_T, clock)


def rate_of_times(time_T: np.ndarray, clock: Callable[[np.ndarray, float], np.ndarray]) -> float:
    """As `find_rate`, of two times or more that rise, however evenly.

    A rate with few digits that has these times to the last bit comes back as it was written. Else it is the roundest
    one that has them when they are rounded, or cut off, to the digits that the file has.
    """
    second, frame_T = _second(clock), np.arange(len(time_T), dtype=np.float64)
    passed_T, unit, is_written = _passed(time_T)
    step = float(passed_T[-1]) / (len(time_T) - 1)
    step_T = np.diff(np.rint(passed_T / unit))
    is_repeated = is_written and bool((step_T == step_T[0]).all())

    def agrees(rate: float) -> bool:
        return np.array_equal(clock(frame_T, rate), passed_T)

    def rounds(rate: float) -> bool:
        if is_repeated:  # a step that was rounded and then repeated; or one that is as it is written
            return step >= _FINE * unit and _is_usual(rate) and _has_step(rate, step / second, unit / second)
        return float(np.ptp(frame_T * (second / rate) - passed_T)) < unit * (1 + 1e-6)

    exact = second / step
    return (
        _first(exact, lambda rate: _is_usual(rate) and rounds(rate))
        or _first(exact, agrees, _FEW)
        or _first(exact, rounds)
        or _first(exact, agrees)
        or exact
    )


def rate_of_step(text: str) -> float | None:
    """Frames per second of the seconds between frames, as a file writes them; None where they are none, or no time.

    The roundest rate whose step is rounded to these digits, or a usual one whose step is cut off to them.
    """
    step = float(text)
    if not (math.isfinite(step) and step > 0 and math.isfinite(1 / step)):
        return None
    unit = max(10.0 ** int(Decimal(text).as_tuple().exponent), step * _SINGLE)
    found = _first(1 / step, lambda rate: 1 / rate == step, _FEW)
    if found is None and step >= _COARSE * unit:
        found = _first(1 / step, lambda rate: _has_step(rate, step, unit))
    return found or 1 / step


def rate_of_rounded(step: float, digits: int) -> float:
    """The same of a step above 0 that is right to so many digits."""
    return rate_of_step(f"{step:.{digits}g}") or 1 / step


def usual_rates(text: str) -> tuple[float, ...]:
    """The usual rates whose step a file may have rounded, or cut off, to the seconds that it writes, where these are so
    few digits that they do not tell one; none where they do, or are no time.
    """
    step = float(text)
    if not (math.isfinite(step) and step > 0):
        return ()
    unit = 10.0 ** int(Decimal(text).as_tuple().exponent)
    if step >= _COARSE * unit * (1 - 1e-9):
        return ()
    return tuple(rate for rate in _MOST_USUAL if _has_step(rate, step, unit))


def uneven_steps(time_T: np.ndarray) -> str:
    """The shortest and the longest step between times (T,) [s], in milliseconds, for a sentence."""
    step_T = 1000 * np.diff(time_T)
    return f"{step_T.min():.0f} to {step_T.max():.0f}"


def at_rate(time_T: np.ndarray, value_TX: np.ndarray, rate: float) -> np.ndarray:
    """Values (S, ...) at a fixed rate, on the straight lines between those (T, ...) at given times, the first of which
    is 0 [s]; NaN between two of which one is.
    """
    time_S = np.arange(int(time_T[-1] * rate * (1 + 1e-9)) + 1) / rate
    before_S = np.clip(np.searchsorted(time_T, time_S, side="right") - 1, 0, len(time_T) - 2)
    share_S = (time_S - time_T[before_S]) / (time_T[before_S + 1] - time_T[before_S])
    share_SX = np.clip(share_S, 0, 1).reshape(-1, *[1] * (value_TX.ndim - 1))
    first, second = value_TX[before_S], value_TX[before_S + 1]
    between = first + share_SX * (second - first)
    return np.where(share_SX == 0, first, np.where(share_SX == 1, second, between))


def in_full(rate: float) -> str:
    """A rate with all its digits, for sentences: one that is not whole does not look so."""
    return repr(float(rate)).removesuffix(".0")


def _first(exact: float, fits: Callable[[float], bool], digits: int = _DIGITS) -> float | None:
    """The roundest rate near one that fits."""
    return next((rate for rate in _rates(exact, digits) if fits(rate)), None)


def _rates(exact: float, digits: int) -> Iterator[float]:
    """Rates near one, the roundest first: whole numbers, those of video, and decimals with more and more digits."""
    decimals = [float(f"{exact:.{count}g}") for count in range(1, digits + 1)]
    yield from (rate for rate in decimals if rate.is_integer())
    yield from _NTSC
    yield from (rate for rate in decimals if not rate.is_integer())


def _is_usual(rate: float) -> bool:
    return rate.is_integer() or rate in _NTSC


def _has_step(rate: float, step: float, unit: float) -> bool:
    """Whether a rate's step [s] is rounded to one that is written in units of its last digit; a usual rate's may be cut
    off.
    """
    return -unit / 2 < 1 / rate - step < (unit if _is_usual(rate) else unit / 2)


def _second(clock: Callable[[np.ndarray, float], np.ndarray]) -> float:
    return float(clock(np.array([1.0]), 1.0)[0])


def _passed(time_T: np.ndarray) -> tuple[np.ndarray, float, bool]:
    """Times (T,) from the first one on; how finely they are told, in their unit; and whether by decimals, to which they
    are rounded then.
    """
    if time_T.dtype.kind in "iu":
        passed_T = time_T - time_T[0]
        unit = next((float(unit) for unit in _CLOCKS if not (passed_T % unit).any()), None)
        # Whole nanoseconds of today may have been floating-point seconds once.
        coarse = max(1.0, float(np.abs(time_T).max()) * _DOUBLE)
        return passed_T, coarse if unit is None else unit, unit is not None or coarse <= 1.0
    passed_T, most = time_T.astype(np.float64) - float(time_T[0]), float(np.abs(time_T).max())
    single = most * _SINGLE if _are_single(time_T) else 0.0
    precision = single if time_T.dtype == np.float32 else most * _DOUBLE
    for places in range(_FINEST + 1):
        written_T, unit = np.round(passed_T, places), 10.0**-places
        if np.abs(written_T - passed_T).max() <= 2 * precision < unit / 10:
            is_sure = places <= _SURE or not single
            return (written_T, unit, True) if is_sure else (passed_T, max(unit, single), False)
    return passed_T, max(precision, single), False


def _are_single(time_T: np.ndarray) -> bool:
    """Whether times are float32 numbers, or the shortest decimals that tell these apart."""
    some_T = time_T[:_SOME].astype(np.float64)
    texts_T = some_T.astype(np.float32).astype(np.str_).astype(np.float64)
    return np.array_equal(texts_T, some_T) or np.array_equal(some_T.astype(np.float32), some_T)


def seconds(frame_T: np.ndarray, rate: float) -> np.ndarray:
    """Times [s] of frames at a rate."""
    return frame_T / rate


def nanoseconds(frame_T: np.ndarray, rate: float) -> np.ndarray:
    """Times [ns] of frames at a rate, whole numbers."""
    return np.rint(frame_T * (1e9 / rate)).astype(np.int64)
