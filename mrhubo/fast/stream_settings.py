"""What can be set about a stream, with PyTorch or without: times, speeds, angles, in their units."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from mrhubo.errors import UserError, shortened

_FRAMES_PER_GAP = 1.5


@dataclass(frozen=True)
class StreamSettings:
    """The defaults are for people who move as people do, seen 10 to 250 times a second; the bounds are checked."""

    rest_time: float = 0.1
    """Time constant [s] of the filter on what is seen of a person who stands still, 0 or more; 0: no filter."""
    half_speed: float = 0.1
    """Speed of a limb [rad/s] at which the time constant is half as long, at twice that speed a third, and so on; more
    than 0. A limb's lag, in angle, is thus at most `rest_time` times this speed: with the defaults 0.6 degrees."""
    speed_time: float = 0.05
    """Time constant [s] of the estimate of that speed, 0 or more."""
    smoothness: float = 0.01
    """Weight of the pull towards the last answer, 0 or more: that of |q_t - q_(t-1)|^2 at 24 frames a second [1/rad^2],
    and at other rates the same for the same speed. Half of the reference's (`evaluation.smoothness`), as no next frame
    pulls the other way: at 60 frames a second it holds a straight arm's twist ten times as firmly as two degrees of
    noise turn it, and holds up a limb by less than a tenth of a frame."""
    worse_deg: float = 5.0
    """How much worse [degrees, root mean square over an arm's limbs] the branch that is followed must be than the other
    one to be left, 0 or more."""
    worse_time: float = 0.2
    """For how long [s] without a break, 0 or more."""
    ramp_time: float = 0.02
    """Time [s] from rest to a joint's full speed, which limits its acceleration; 0: no such limit. URDFs give none;
    a robot's maker may. Who starts or turns suddenly is followed half of this time later, at least."""
    crossing_time: float = 0.1
    """The same [s] of an arm that crosses over to another answer; no longer than `ramp_time`: it does so as hard as it
    may."""
    avoid_collisions: bool = True
    """Whether answers in which the robot would touch itself give way (`mrhubo.reference.avoidance`), before the limits
    of speed and acceleration."""
    longest_gap: float = 0.1
    """No more time [s] than this, or than one and a half frames, counts as passed since the last answer when joints
    move: after a gap the robot goes on from where it stands, and does not leap to where it would be by now. More than
    0."""

    def __post_init__(self) -> None:
        if not isinstance(self.avoid_collisions, bool):
            raise UserError(f"stream settings: avoid_collisions must be True or False, found {self.avoid_collisions}")
        for field in fields(self):
            if field.name == "avoid_collisions":
                continue
            value, positive = getattr(self, field.name), field.name in ("half_speed", "longest_gap")
            if not is_number(value) or value < 0 or (positive and value == 0):
                least = "more than 0" if positive else "0 or more"
                raise UserError(f"stream settings: {field.name} must be {least}, found {shortened(value)}")

    def longest_step(self, rate: float) -> float:
        """No more time [s] than this counts as passed when joints move, at a rate of frames per second."""
        return max(self.longest_gap, _FRAMES_PER_GAP / rate)


def is_number(value: Any) -> bool:
    """Whether it is a finite number, Python's or NumPy's, that a float can hold."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def checked(settings: StreamSettings | None, floor: float | None) -> tuple[StreamSettings, float | None]:
    """A stream's settings, default: all defaults, and the height of its floor [m], None: it is learned.

    Raises:
        UserError: they are no settings, or the height is no number.
    """
    if settings is not None and not isinstance(settings, StreamSettings):
        raise UserError(f"stream: settings must be StreamSettings(...), found {type(settings).__name__}")
    if floor is not None and not is_number(floor):
        raise UserError(f"stream: the floor's height must be a number of metres, found {shortened(floor)}")
    return settings or StreamSettings(), None if floor is None else float(floor)
