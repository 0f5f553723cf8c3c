"""Where a hand's fingers and thumb point, from its fingers' bases and how they curl, or from the zero pose.

A hand's thumb, fingers and palm are one triple: on a left hand whose fingers point away from the elbow, the thumb lies
where palm cross fingers points; on a right hand on the other side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.errors import UserError
from mrhubo.robot.discovery.arm import Arm
from mrhubo.robot.discovery.bodies import Bodies, Step
from mrhubo.robot.discovery.ends import carried_along
from mrhubo.robot.discovery.lines import cross, unit
from mrhubo.robot.discovery.motion import turned, usual_range
from mrhubo.robot.joint import drive

_STRAIGHT = 0.8
"""Cosine (37 degrees) up to which fingers are taken to go on as the forearm does: bases of fingers are spread."""
_CLEAR = 0.35
"""Cosine from which on a direction tells a side."""
_ASIDE = 0.85
"""Cosine from which on a finger's axis is the direction in which its base lies beside the thumb's (32 degrees)."""
_ALIKE, _PLANE = 0.98, 0.25
"""Cosine from which on axes are parallel, and how far apart along them jaws begin, as a share of how far across."""


@dataclass(frozen=True)
class Hand:
    """A hand's link and directions at the zero pose, root's frame."""

    link: str
    fingers_3: np.ndarray
    thumb_3: np.ndarray
    confidence: float
    cue: str
    doubt: str | None
    """What could not be told, if anything."""


@dataclass(frozen=True)
class _Finger:
    base_3: np.ndarray
    tip_3: np.ndarray
    curl_3: np.ndarray
    """Where its tip moves as it closes."""
    axis_3: np.ndarray
    slides: bool
    named_thumb: bool


def read_hand(bodies: Bodies, arm: Arm, left: float, left_3: np.ndarray, forward_3: np.ndarray) -> Hand | None:
    """A hand's directions; None if no joint beyond the elbow turns it.

    Args:
        bodies: the robot.
        arm: its arm.
        left: 1 for the left hand, -1 for the right one.
        left_3: where left is.
        forward_3: where the robot faces.
    """
    if arm.elbow_at + 1 >= len(arm.chain):
        return None
    last = arm.chain[-1]
    forearm_3 = unit(arm.wrist.point_3 - arm.elbow.point_3)
    if not forearm_3.any():
        return None
    if arm.forearm_twist_at is not None:
        axis_3 = arm.chain[arm.forearm_twist_at].hinge.line.axis_3
        if abs(float(axis_3 @ forearm_3)) > 0.95:
            forearm_3 = axis_3 * np.sign(axis_3 @ forearm_3)
    fingers = _fingers(bodies, last, arm.wrist.point_3)
    fingers_3, how = forearm_3, "the forearm's direction at the zero pose"
    rest_3 = _rest_thumb(arm, left * left_3, forward_3)
    span = 0.1 * arm.length
    fingers = _without_rods([f for f in fingers if np.linalg.norm(f.tip_3 - arm.wrist.point_3) > span / 2])
    if fingers:
        bases_3 = np.mean([finger.base_3 for finger in fingers], axis=0)
        tips_3 = np.mean([finger.tip_3 for finger in fingers], axis=0)
        out_3 = unit(tips_3 - arm.wrist.point_3) + unit(bases_3 - arm.wrist.point_3)
        far = float(np.linalg.norm(bases_3 - arm.wrist.point_3)) > span
        if far and np.linalg.norm(out_3) > 0.5 and -0.2 < float(unit(out_3) @ forearm_3) < _STRAIGHT:
            fingers_3, how = unit(bases_3 - arm.wrist.point_3), "from the wrist to the fingers' bases"
    # A forearm that only twists ends where what it carries does.
    tool_3 = None if arm.chain[arm.forearm_twist_at or 0] is last else carried_along(bodies, last, arm.wrist.point_3)
    if tool_3 is not None and float(tool_3 @ forearm_3) < _STRAIGHT:
        # At zero the hand is folded against the forearm, as those of Franka's and Universal Robots' arms are.
        fingers_3, how = tool_3, "along the axis of the last joint, where all lies that it carries"
    thumb_3, told, sure, doubt = rest_3, "the thumb as a human's in the zero pose", 0.4, None
    if len(fingers) >= 3:
        thumb_3, told, sure, doubt = _dexterous(fingers, fingers_3, left, rest_3)
    elif fingers:
        thumb_3, told, sure, doubt = _jaws(fingers, fingers_3, left * left_3, rest_3, arm.wrist.point_3)
    else:
        doubt = "nothing tells on which side the thumb would be"
    thumb_3 = thumb_3 - fingers_3 * (fingers_3 @ thumb_3)
    if np.linalg.norm(thumb_3) < 0.1:
        other_3 = cross(fingers_3, left_3) if abs(fingers_3 @ left_3) < 0.9 else forward_3
        thumb_3 = other_3 - fingers_3 * (fingers_3 @ other_3)
    thumb_3 = unit(thumb_3)
    return Hand(last.outer_link, fingers_3, thumb_3, sure, f"{how}; {told}", doubt)


def _rest_thumb(arm: Arm, outward_3: np.ndarray, forward_3: np.ndarray) -> np.ndarray:
    """Where a human's thumb is whose arm, at rest outwards with the thumb forward, is turned the short way until its
    upper arm points as the robot's, and then its forearm.
    """
    upper_3 = unit(arm.elbow.point_3 - arm.shoulder.point_3)
    forearm_3 = unit(arm.wrist.point_3 - arm.elbow.point_3)
    return _swung(_swung(forward_3, outward_3, upper_3), upper_3, forearm_3)


def _swung(vector_3: np.ndarray, start_3: np.ndarray, end_3: np.ndarray) -> np.ndarray:
    """A vector turned the short way that takes one direction to another."""
    about_3 = cross(start_3, end_3)
    sine = float(np.linalg.norm(about_3))
    return turned(vector_3, about_3 / sine, float(np.arctan2(sine, start_3 @ end_3))) if sine > 1e-6 else vector_3


def _fingers(bodies: Bodies, last: Step, wrist_3: np.ndarray) -> list[_Finger]:
    """The movable branches at the end of an arm, without those that reach nowhere."""
    found = []
    longest = max((bodies.extent(on) for on in bodies.onward(last)), default=0.0)
    for on in bodies.onward(last):
        if bodies.extent(on) < 0.2 * longest:
            continue
        inside, hinges = bodies.beyond(on)
        corners = np.concatenate([bodies.corners(body) for body in inside])
        base_3 = bodies.position(on.outer_link)
        tip_3 = corners[int(np.argmax(np.linalg.norm(corners - wrist_3, axis=-1)))]
        centres = [centre for body in inside if (centre := bodies.centre(body)) is not None]
        if np.linalg.norm(tip_3 - base_3) < 1e-3 and centres:
            tip_3 = base_3 + 2 * (np.mean(centres, axis=0) - base_3)
        curl_3 = np.zeros(3)
        for hinge in hinges:
            if not hinge.rotary:
                continue
            way = _closing(bodies, hinge.name)
            curl_3 = curl_3 + way * cross(hinge.line.axis_3, tip_3 - hinge.line.point_3)
        flexing = [hinge.line.axis_3 for hinge in hinges if hinge.rotary]
        axis_3 = flexing[-1] if flexing else on.hinge.line.axis_3
        slides = not on.hinge.rotary
        thumb = any("thumb" in name.lower() for name in (on.hinge.name, on.outer_link))
        found.append(_Finger(base_3, tip_3, curl_3, axis_3, slides, thumb))
    return found


def _without_rods(fingers: list[_Finger]) -> list[_Finger]:
    """Two jaws without the rods beside them of loops that a URDF had to cut: all turn about parallel axes, and begin in
    a plane across these, as many on the one side as on the other, where fingers of a hand lie side by side.
    """
    axis_3 = fingers[0].axis_3 if fingers else np.zeros(3)
    if len(fingers) < 3 or any(abs(float(finger.axis_3 @ axis_3)) < _ALIKE for finger in fingers):
        return fingers
    bases = np.array([finger.base_3 for finger in fingers])
    bases = bases - bases.mean(axis=0)
    along_N = bases @ axis_3
    if np.ptp(along_N) > _PLANE * float(np.linalg.norm(bases, axis=-1).max()):
        return fingers
    sides_N = bases @ np.linalg.svd(bases - np.outer(along_N, axis_3))[2][0]
    pairs = [[finger for finger, side in zip(fingers, sides_N, strict=True) if side * sign > 0] for sign in (1, -1)]
    if len(pairs[0]) != len(pairs[1]) or len(pairs[0]) + len(pairs[1]) < len(fingers):
        return fingers
    return [max(pair, key=lambda finger: float(np.linalg.norm(finger.tip_3 - finger.base_3))) for pair in pairs]


def _closing(bodies: Bodies, name: str) -> float:
    """Which way a joint of a finger goes as it closes: towards its longer side from zero."""
    joints = bodies.description.joints
    hinge = next(hinge for hinge in bodies.hinges if hinge.name == name)
    factor = 1.0
    if joints[name].mimic is not None:
        try:
            source = drive(joints, name)
        except UserError:  # told where it matters
            return 0.0
        factor = 1.0 if source.multiplier >= 0 else -1.0
        moving = [other for other in bodies.hinges if other.name == source.joint]
        if not moving:
            return 0.0
        hinge = moving[0]
    if not hinge.limited:
        return 0.0
    lower, upper = usual_range(hinge)
    if abs(lower + upper) < 0.2 * (upper - lower):
        return 0.0
    return factor * float(np.sign(lower + upper))


def _dexterous(
    fingers: list[_Finger], fingers_3: np.ndarray, left: float, rest_3: np.ndarray
) -> tuple[np.ndarray, str, float, str | None]:
    """Thumb of a hand with three or more fingers."""
    named = [finger for finger in fingers if finger.named_thumb]
    thumb = named[0] if len(named) == 1 else max(fingers, key=lambda finger: _odd(finger, fingers))
    others = [finger for finger in fingers if finger is not thumb]
    middle_3 = np.mean([finger.base_3 for finger in others], axis=0)
    spread = np.array([finger.base_3 - middle_3 for finger in others])
    spread = spread - np.outer(spread @ fingers_3, fingers_3)
    lateral_3 = np.linalg.svd(spread)[2][0] if len(others) > 1 and np.abs(spread).max() > 1e-4 else others[0].axis_3
    lateral_3 = unit(lateral_3 - fingers_3 * (fingers_3 @ lateral_3))
    palm_3 = cross(fingers_3, lateral_3)
    reach = float(np.mean([np.linalg.norm(finger.tip_3 - finger.base_3) for finger in others]))
    # The palm is where the thumb opposes the fingers, and where these go as they close.
    opposed = float((thumb.tip_3 - np.mean([finger.base_3 for finger in others], axis=0)) @ palm_3) / max(reach, 1e-6)
    curls = [float(finger.curl_3 @ palm_3) / max(float(np.linalg.norm(finger.curl_3)), 1e-9) for finger in others]
    palm = float(np.clip(2 * opposed, -1, 1)) + 0.8 * float(np.mean(curls))
    by_curl = left * float(np.clip(palm, -1, 1)) * float(cross(palm_3, fingers_3) @ lateral_3)
    size = max(float(np.linalg.norm(finger.base_3 - thumb.base_3)) for finger in others)
    by_base = float((thumb.base_3 - middle_3) @ lateral_3) / max(size, 1e-9)
    vote = 0.8 * by_curl + 2.0 * float(np.clip(by_base, -1, 1))
    agree = by_curl * by_base > 0 or abs(by_base) < 0.15 or abs(by_curl) < _CLEAR
    sign = 1.0 if vote > 0 else -1.0
    if abs(vote) < 0.3:
        sign = 1.0 if lateral_3 @ rest_3 > 0 else -1.0
        return sign * lateral_3, "the thumb on the side of a human's", 0.4, "the fingers do not tell where the thumb is"
    cue = "the thumb across the fingers, on its base's side and as they curl"
    return sign * lateral_3, cue, 0.85 if agree else 0.6, None


def _odd(finger: _Finger, fingers: list[_Finger]) -> float:
    """How unlike the others a finger is: its axis, which way it closes, and where it begins."""
    others = [other for other in fingers if other is not finger]
    against = 1 - float(np.mean([unit(finger.curl_3) @ unit(other.curl_3) for other in others]))
    turned_away = 1 - float(np.mean([abs(float(finger.axis_3 @ other.axis_3)) for other in others]))
    middle_3 = np.mean([other.base_3 for other in others], axis=0)
    spread = float(np.mean([np.linalg.norm(other.base_3 - middle_3) for other in others]))
    return turned_away + 0.5 * against + 0.5 * float(np.linalg.norm(finger.base_3 - middle_3)) / max(spread, 1e-4)


def _jaws(
    fingers: list[_Finger], fingers_3: np.ndarray, outward_3: np.ndarray, rest_3: np.ndarray, wrist_3: np.ndarray
) -> tuple[np.ndarray, str, float, str | None]:
    """Thumb of a gripper: one of its jaws."""
    if len(fingers) == 2:
        across_3 = fingers[1].base_3 - fingers[0].base_3
        if np.linalg.norm(across_3) < 1e-4:
            across_3 = fingers[1].tip_3 - fingers[0].tip_3
        one, other = (finger.axis_3 for finger in fingers)
        if not (fingers[0].slides or fingers[1].slides) and abs(float(one @ other)) > _ALIKE:
            # Where along their axes a file puts two parallel hinges says nothing.
            beside_3 = across_3 - one * float(one @ across_3)
            across_3 = beside_3 if np.linalg.norm(beside_3) > 1e-4 else cross(one, fingers_3)
    elif fingers[0].slides:
        across_3 = fingers[0].axis_3
    else:
        across_3 = cross(fingers[0].axis_3, fingers_3)
    across_3 = across_3 - fingers_3 * (fingers_3 @ across_3)
    if np.linalg.norm(across_3) < 1e-6:
        across_3 = cross(fingers[0].axis_3, fingers_3)
    across_3 = unit(across_3)
    named = [finger for finger in fingers if finger.named_thumb]
    if len(named) == 1 and len(fingers) == 2:
        # A finger curls about what runs across the hand; its base may lie nearer to the palm than the thumb's.
        finger = next(finger for finger in fingers if finger is not named[0])
        axis_3 = unit(finger.axis_3 - fingers_3 * (fingers_3 @ finger.axis_3))
        if abs(float(axis_3 @ across_3)) > _ASIDE:
            across_3 = axis_3
        side = float((named[0].base_3 - np.mean([f.base_3 for f in fingers], axis=0)) @ across_3)
        return (across_3 if side > 0 else -across_3), "the thumb's jaw by its name", 0.8, None
    told = float(across_3 @ rest_3)
    doubt = "a gripper has no thumb; one of its jaws was taken"
    if abs(told) > _CLEAR:
        return np.sign(told) * across_3, "the jaw nearest to where a human's thumb is in the zero pose", 0.5, doubt
    inward = float(across_3 @ outward_3)
    return (-across_3 if inward > 0 else across_3), "the inner jaw, as the palm faces back", 0.4, doubt
