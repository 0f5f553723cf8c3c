"""The limits of joints [rad, rad/s]: what a URDF gives, what it means, and what is left of it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path

from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)

from mrhubo.errors import UserError
from mrhubo.robot.attributes import read_numbers
from mrhubo.robot.joint import Joint, drive

_NO_LIMIT = 1e3
"""Limits from here on mean that there are none."""
_MOST = 14.0
"""Widest range, and largest limit: a little over two turns. More is in degrees, or means none."""
_SLACK = 1e-4
"""How far a joint that mimics another may leave its own limits: what rounded multipliers make of rounded limits."""
MAX_SPEED = 12.0
"""No joint turns faster [rad/s], whatever its URDF gives: 0.5 rad in 1/24 s, from where on a step counts as a jump
(`reference.metrics`); people's arms rarely reach it. Many files give no speed (0), or one that no motor has."""


def with_soft_limits(joint: Joint, safety_controller: etree._Element | None) -> Joint:
    """The joint with the narrower of its limits and those that its safety controller holds it to.

    Soft limits that leave nothing (both are 0 where a file does not give them) hold it to none.
    """
    if safety_controller is None or joint.kind not in ("revolute", "prismatic"):
        return joint
    soft: list[float | None] = []
    for word in ("soft_lower_limit", "soft_upper_limit"):
        numbers = read_numbers(safety_controller.get(word, "none"), 1)
        soft.append(None if isinstance(numbers, str) else numbers[0])
    lower = _tighter(max, joint.lower, soft[0])
    upper = _tighter(min, joint.upper, soft[1])
    if (lower, upper) == (joint.lower, joint.upper) or (lower is not None and upper is not None and lower >= upper):
        return joint
    return dataclasses.replace(joint, lower=lower, upper=upper, limited_by="the URDF's soft limits")


def without_empty_limits(joints: Mapping[str, Joint]) -> dict[str, Joint]:
    """The joints, those that turn without limits where a file has 0 .. 0 for all of them: drawing programs write that
    where they know none, and a robot of which nothing can move is none.
    """
    turning = [joint for joint in joints.values() if joint.rotary]
    if not turning or any((joint.lower, joint.upper) != (0.0, 0.0) for joint in turning):
        return dict(joints)
    return {
        name: dataclasses.replace(joint, lower=None, upper=None) if joint.rotary else joint
        for name, joint in joints.items()
    }


def _tighter(pick: Callable[[float, float], float], hard: float | None, soft: float | None) -> float | None:
    return hard if soft is None else soft if hard is None else pick(hard, soft)


def joint_range(path: Path, joint: Joint, narrower: list[float] | None) -> tuple[float, float]:
    """Lower and upper limit [rad] of a joint that is to be sampled.

    Args:
        path: the URDF, for messages.
        joint: the joint.
        narrower: what `robot.ranges` gives it.

    Raises:
        UserError: the joint is not rotary; it has no limits, or limits that mean none or are in degrees, and no range
            is given; or its range is empty or outside them.
    """
    if not joint.rotary:
        raise UserError(f"{path}: joint '{joint.name}' is {joint.kind}; only rotary joints can be sampled")
    if joint.mimic is not None:
        raise UserError(
            f"{path}: joint '{joint.name}' mimics '{joint.mimic.joint}'; name '{joint.mimic.joint}' instead"
        )
    if narrower is not None:
        if len(narrower) != 2 or not all(map(math.isfinite, narrower)) or not narrower[0] < narrower[1]:
            raise UserError(
                f"robot.ranges.{joint.name}: expected [lower, upper] in rad with lower < upper, found {list(narrower)}"
            )
        if _too_wide(*narrower):
            raise UserError(f"robot.ranges.{joint.name}: {_turns(*narrower)}; give radians")
    lower, upper = joint.lower, joint.upper
    if lower is None or upper is None:
        if narrower is None:
            raise UserError(f"{path}: joint '{joint.name}' has no limits; give it a range in robot.ranges")
        return narrower[0], narrower[1]
    if not lower < upper:
        raise UserError(f"{path}: joint '{joint.name}' has the impossible limits {lower} .. {upper}; correct the URDF")
    if narrower is None:
        if max(abs(lower), abs(upper)) >= _NO_LIMIT:
            raise UserError(
                f"{path}: joint '{joint.name}' has no limits: {lower:g} .. {upper:g} mean none; give it a range in "
                "robot.ranges"
            )
        if _too_wide(lower, upper):
            raise UserError(
                f"{path}: joint '{joint.name}' has limits {_turns(lower, upper)}: are these degrees? A URDF's are in "
                "radians; correct them, or give the joint a range in rad in robot.ranges"
            )
        return lower, upper
    if not _too_wide(lower, upper) and (narrower[0] < lower - 1e-9 or narrower[1] > upper + 1e-9):
        raise UserError(f"robot.ranges.{joint.name}: {list(narrower)} leaves {joint.limited_by} {lower} .. {upper}")
    return narrower[0], narrower[1]


def in_degrees(joints: Iterable[Joint]) -> bool:
    """Whether the limits of most joints that turn can only be degrees."""
    limited = [joint for joint in joints if joint.kind == "revolute" and (joint.lower or 0.0) < (joint.upper or 0.0)]
    return 2 * sum(map(beyond_turns, limited)) > len(limited) > 0


def beyond_turns(joint: Joint) -> bool:
    """Whether limits lie beyond two turns, and are not so large that they mean none."""
    return _MOST < max(abs(joint.lower or 0.0), abs(joint.upper or 0.0)) < _NO_LIMIT


def _too_wide(lower: float, upper: float) -> bool:
    return upper - lower > _MOST or max(abs(lower), abs(upper)) > _MOST


def _turns(lower: float, upper: float) -> str:
    return f"{lower:g} .. {upper:g}, which is {(upper - lower) / math.tau:.0f} turns from end to end"


def joint_speed(joints: Mapping[str, Joint], name: str, most: float) -> float:
    """How fast a joint may turn [rad/s]: the least of `most`, of what the URDF gives it, and of what it gives those
    that mimic it. What is missing, 0 or negative tells no speed; what is too fast to be true is more than `most`.

    Args:
        joints: all joints of the robot.
        name: the joint, one that mimics none.
        most: no joint turns faster.

    Raises:
        UserError: `most` is no positive number.
    """
    if not (math.isfinite(most) and most > 0):
        raise UserError(f"robot.max_speed: must be a positive number of rad/s, found {most}")
    speeds = [most]
    for joint in (joint for joint in joints.values() if joint.name == name or joint.mimic is not None):
        try:
            source = drive(joints, joint.name)
        except UserError:  # told where it matters
            continue
        if joint.velocity is not None and joint.velocity > 0 and source.joint == name and abs(source.multiplier) > 1e-9:
            speeds.append(joint.velocity / abs(source.multiplier))
    return min(speeds)


def held_angle(joint: Joint, wanted: float | None, degrees: bool = False) -> float:
    """Angle [rad], or position [m], at which a joint rests when it is not sampled; one that mimics another follows it.

    Args:
        joint: the joint.
        wanted: what `robot.hold` gives it; None: 0, or the limit nearest to 0.
        degrees: whether the file's limits are degrees, as `in_degrees` tells.

    Raises:
        UserError: what is wanted lies outside the limits, or is in degrees.
    """
    lower, upper = joint.lower, joint.upper
    if degrees and joint.rotary:
        lower, upper = (None if end is None else math.radians(end) for end in (lower, upper))
    # Limits that cannot be meant keep it from nothing.
    continuous = joint.kind == "continuous" or (joint.rotary and _too_wide(lower or 0.0, upper or 0.0))
    lower = -math.inf if lower is None or continuous else lower
    upper = math.inf if upper is None or continuous else upper
    if wanted is None:
        return float(min(max(0.0, lower), max(lower, upper)))
    if not lower <= wanted <= upper:
        raise UserError(f"robot.hold.{joint.name}: {wanted} leaves {joint.limited_by} {lower} .. {upper}")
    if joint.rotary and abs(wanted) > _MOST:
        raise UserError(f"robot.hold.{joint.name}: {wanted:g} rad is more than two turns; give radians")
    return float(wanted)


@dataclasses.dataclass(frozen=True)
class Narrowing:
    """A joint whose range is narrower than its limits, so that one that mimics it stays within its own."""

    joint: Joint
    """With the narrower range."""
    before: tuple[float | None, float | None]
    follower: Joint

    def __str__(self) -> str:
        old = "without limits" if None in self.before else f"{self.before[0]:g} .. {self.before[1]:g}"
        return (
            f"joint '{self.joint.name}' ({old}) is kept to {self.joint.lower:g} .. {self.joint.upper:g} rad, because "
            f"'{self.follower.name}', which mimics it, would leave its own limits {self.follower.lower:g} .. "
            f"{self.follower.upper:g}"
        )


def narrow_to_mimics(path: Path, joints: Mapping[str, Joint], names: Collection[str]) -> dict[str, Narrowing]:
    """Which of the named joints would drive others, that mimic them, out of their own limits, and what range does not.

    Raises:
        UserError: no range is left.
    """
    found: dict[str, Narrowing] = {}
    for follower in joints.values():
        ends = _usable(follower)
        if follower.mimic is None or ends is None:
            continue
        try:
            source = drive(joints, follower.name)
        except UserError:  # told where it matters
            continue
        if source.joint not in names or abs(source.multiplier) < 1e-9:
            continue
        joint = found[source.joint].joint if source.joint in found else joints[source.joint]
        low, high = sorted((end - source.offset) / source.multiplier for end in ends)
        slack = _SLACK / abs(source.multiplier)
        lower = low if joint.lower is None or low > joint.lower + slack else joint.lower
        upper = high if joint.upper is None or high < joint.upper - slack else joint.upper
        if (lower, upper) == (joint.lower, joint.upper):
            continue
        if not upper - lower > slack:
            raise UserError(
                f"{path}: joint '{follower.name}' mimics '{source.joint}' (times {source.multiplier:g}, plus "
                f"{source.offset:g}) and would leave its own limits {ends[0]:g} .. {ends[1]:g} wherever "
                f"'{source.joint}' is; correct the mimic or the limits"
            )
        reason = f"the range that keeps '{follower.name}', which mimics it, within its own limits,"
        narrower = dataclasses.replace(joint, lower=lower, upper=upper, limited_by=reason)
        found[source.joint] = Narrowing(narrower, (joints[source.joint].lower, joints[source.joint].upper), follower)
    return found


def _usable(joint: Joint) -> tuple[float, float] | None:
    """Limits that are meant as such."""
    lower, upper = joint.lower, joint.upper
    if joint.kind not in ("revolute", "prismatic") or lower is None or upper is None or not lower < upper:
        return None
    return None if _too_wide(lower, upper) else (lower, upper)
