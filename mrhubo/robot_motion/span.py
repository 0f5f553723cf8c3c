"""A part of a motion, human or robot, by seconds from its beginning."""

from __future__ import annotations

import math
from dataclasses import replace

from mrhubo.errors import UserError
from mrhubo.robot_motion.motion import PER_FRAME, RobotMotion

_SLACK = 1e-6
"""Of a frame: times that were rounded still name the frame that they are of."""


def check_span(start: float, end: float | None) -> None:
    """Refuses seconds between which no motion can be."""
    if not math.isfinite(start) or start < 0 or (end is not None and not start <= end < math.inf):
        until = "its end" if end is None else f"{end:g} s"
        raise UserError(f"from {start:g} s to {until} is no span of time; motions begin at 0")


def frames_between(name: str, frames: int, rate: float, start: float, end: float | None) -> slice:
    """The frames from `start` to `end` seconds, both in, of so many at a rate a second; None: to the end.

    Raises:
        UserError: the times are no such span, or no frame lies between them; it begins with `name`.
    """
    check_span(start, end)
    first = math.ceil(start * rate - _SLACK)
    last = frames - 1
    if end is not None:
        last = min(last, math.floor(end * rate + _SLACK))
    if first > last:
        span = f"from {start:g} s" + ("" if end is None else f" to {end:g} s")
        raise UserError(f"{name}: has no frame {span}; it lasts from 0 to {max(0, frames - 1) / rate:.3f} s")
    return slice(first, last + 1)


def trim_robot_motion(
    motion: RobotMotion, start: float = 0.0, end: float | None = None, rate: float | None = None
) -> RobotMotion:
    """The frames from `start` to `end` seconds, both in; None: to the motion's end. `rate`: frames per second of a
    motion that does not tell them.

    Raises:
        UserError: as for `frames_between`, or nobody tells the rate.
    """
    rate = motion.frame_rate or rate
    if rate is None:
        raise UserError(f"{motion.name or 'the robot motion'}: does not tell its frame rate, so no part of it is known")
    motion = motion.single()
    rows = frames_between(motion.name or "the robot motion", len(motion), rate, start, end)
    arrays = {name: getattr(motion, name) for name in PER_FRAME}
    return replace(motion, **{name: array[rows] for name, array in arrays.items() if array is not None})
