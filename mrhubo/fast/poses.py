"""Human poses that a retargeter without PyTorch is given, in the three forms of `mrhubo.motion.read_poses`."""

from __future__ import annotations

import contextlib
import math
from typing import Any, NamedTuple

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.fast.plain.human import cross, norm
from mrhubo.fast.rotations import axis_angle_to_matrix

NOT_FINITE = "NaN or infinite numbers"
LOWEST_RATE, HIGHEST_RATE = 1e-3, 1e6
"""Frames per second: a frame in a quarter of an hour, and more than any camera's."""
_MOST_STEPS = 1_000_000
_JOINTS = 21
_MOST_TURN = 6 * math.pi
_FLAT = 1e-4
"""As `mrhubo.motion.poses` has them."""


class Poses(NamedTuple):
    """Local rotations (T, 21, 3, 3), float32, with the leading axes that they had and what is known of them."""

    local_TJ33: np.ndarray
    shape: tuple[int, ...]
    frame_rate: float | None
    name: str = ""
    source: str = ""


def read_poses(given: Any, frame_rate: float | None, own_rest: bool) -> Poses:
    """Poses of a motion or an array. Matrices are not looked at; other forms are.

    Raises:
        UserError: it is neither, has another shape, or the frame rate is not positive; the axis-angle or 6D numbers
            are no rotations; or a motion's rotations refer to another rest pose than the retargeter's (`own_rest`).
    """
    name = source = ""
    if is_motion(given):
        if not own_rest:
            raise UserError(
                "this retargeter is for a body model with a rest pose of its own; give it an array for that"
            )
        frame_rate, name, source, given = given.frame_rate, given.name, given.source, given.arrays.local_TJ33
    array = to_array(given)
    if array.dtype.kind not in "fiu":
        raise UserError(f"human motion: expected a Motion or an array of numbers, found {array.dtype}")
    check_frame_rate(frame_rate)
    for axes, read in ((_JOINTS, 3, 3), None), ((_JOINTS, 6), _of_sixd), ((3 * _JOINTS,), _of_axis_angle):
        if array.shape[-len(axes) :] == axes:
            shape = array.shape[: -len(axes)]
            array = array.reshape(math.prod(shape), *axes)
            if read is None and array.dtype == np.float32:
                return Poses(np.ascontiguousarray(array), shape, frame_rate, name, source)
            with np.errstate(over="ignore"):
                local_TJ33 = np.ascontiguousarray(array if read is None else read(array, shape), np.float32)
            return Poses(local_TJ33, shape, frame_rate, name, source)
    raise UserError(
        f"human poses must have the shape (..., {_JOINTS}, 3, 3) (matrices), (..., {3 * _JOINTS}) (axis-angle, rad) or"
        f" (..., {_JOINTS}, 6) (6D), found {array.shape}"
    )


def is_motion(given: Any) -> bool:
    """Whether it is a `mrhubo.Motion`, of which nothing is known here but its arrays."""
    return hasattr(type(given), "local_TJ33")  # an object's own would be a tensor, and import PyTorch


def to_array(given: Any) -> np.ndarray:
    """What a user gives, as NumPy's: an array, nested lists, a tensor of PyTorch, which is not imported for that.

    Raises:
        UserError: NumPy makes no array of it, as of ragged lists.
    """
    if isinstance(given, np.ndarray):
        return plain_array(given)
    with contextlib.suppress(Exception):
        return np.asarray(given)
    try:  # a tensor that takes gradients, lies on a GPU, or has numbers that NumPy does not know
        return given.detach().cpu().float().numpy()
    except Exception as error:
        kind = type(given).__name__
        raise UserError(f"human motion: expected a Motion or an array of numbers, found {kind}") from error


def plain_array(array: np.ndarray) -> np.ndarray:
    """An array of NumPy's own class; numbers that are masked are missing, so they are NaN."""
    if type(array) is np.ndarray:
        return array
    if isinstance(array, np.ma.MaskedArray) and array.dtype.kind in "fiu" and np.ma.is_masked(array):
        return np.ma.filled(array.astype(np.float64), np.nan)
    return np.asarray(array)


def check_frame_rate(frame_rate: float | None, needed: bool = False) -> None:
    """Refuses what is no number of frames per second, or one with whose powers nobody can reckon; None is one that is
    not known, unless it is needed.
    """
    if frame_rate is None and not needed:
        return
    number = isinstance(frame_rate, int | float | np.integer | np.floating) and not isinstance(frame_rate, bool)
    if frame_rate is None or not (number and 0 < frame_rate < math.inf):
        raise UserError(f"human motion: the frame rate must be a positive number, found {shortened(frame_rate)}")
    if not LOWEST_RATE <= frame_rate <= HIGHEST_RATE:
        bounds = f"{LOWEST_RATE:g} to {HIGHEST_RATE:,.0f}"
        raise UserError(f"human motion: the frame rate must be from {bounds} a second, found {shortened(frame_rate)}")


def checked_polish(polish: int) -> int:
    """The number of steps of optimisation that is asked for.

    Raises:
        UserError: it is negative, no whole number, or more than anybody waits for.
    """
    if isinstance(polish, bool) or not isinstance(polish, int | np.integer) or not 0 <= polish <= _MOST_STEPS:
        raise UserError(f"polish must be 0 or more steps, at most {_MOST_STEPS:,}, found {shortened(polish)}")
    return int(polish)


def refuse(wrong: tuple[int, str] | None, shape: tuple[int, ...]) -> None:
    """Refuses poses of which a frame is wrong; names it by the leading axes.

    Raises:
        UserError: one is.
    """
    if wrong is not None:
        index = tuple(map(int, np.unravel_index(wrong[0], shape))) if shape else ()
        frame = f" {index[0]}" if len(index) == 1 else f" {index}" if index else ""
        raise UserError(f"human pose{frame} holds {wrong[1]}")


def _refuse_first(wrong_TJ: np.ndarray, array: np.ndarray, what: str, shape: tuple[int, ...]) -> None:
    """Refuses the first frame of which a joint is wrong, for what it holds."""
    if wrong_TJ.any():
        place = int(wrong_TJ.any(axis=1).argmax())
        refuse((place, what if np.isfinite(array[place]).all() else NOT_FINITE), shape)


def _of_sixd(array: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """6D: two columns, one after the other."""
    first, second = array[..., :3].astype(np.float64), array[..., 3:].astype(np.float64)
    third = cross(first, second)
    parallel_TJ = ~(norm(third) > _FLAT * norm(first) * norm(second))
    _refuse_first(parallel_TJ, array, "six numbers that are no rotation", shape)
    x = first / norm(first)[..., None]
    second = second - (x * second).sum(-1, keepdims=True) * x
    y = second / norm(second)[..., None]
    return np.stack((x, y, cross(x, y)), axis=-1)


def _of_axis_angle(array: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Axis times angle [rad], by Rodrigues' formula."""
    vector = array.reshape(len(array), _JOINTS, 3).astype(np.float64)
    angle = norm(vector)
    _refuse_first(~(angle <= _MOST_TURN), array, "no axis-angle in radians (degrees?)", shape)
    return axis_angle_to_matrix(vector)


def has_gaps(given: np.ndarray) -> bool:
    """Whether an array of numbers holds some that float32 cannot."""
    with np.errstate(over="ignore"):
        return given.dtype.kind == "f" and not bool(np.isfinite(given.astype(np.float32)).all())
