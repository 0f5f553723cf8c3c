"""Whether what was discovered of a made-up humanoid is true of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mrhubo.robot.discovery import Discovery
from mrhubo.robot.generator.humanoid import Humanoid
from mrhubo.robot.urdf import Description, describe

_NEAR = 0.02
"""Metres by which a point may be off on an arm of half a metre."""
_UPRIGHT, _POINTING, _ACROSS = 3.0, 10.0, 15.0
"""Degrees by which up and forward, fingers, and a thumb may be off."""
_STANDING = 5.0
"""Degrees by which a foot's directions may be off."""
_ALONG = 5.0
"""Degrees by which a forearm may be off whose wrist no joint tells."""
_CHAINS = {
    "left_arm": "left_hand", "right_arm": "right_hand", "neck": "neck",
    "left_leg": "left_leg", "right_leg": "right_leg", "waist": "waist",
}  # fmt: skip
"""What a mistake about a chain's joints is called."""
_LEG = ("hip", "knee", "ankle", "foot", "leg")
_ELBOWS = {f"{side}_wrist": f"{side}_elbow" for side in ("left", "right")}


def mistakes(found: Discovery, truth: Humanoid, urdf: Path) -> list[str]:
    """What is wrong, as short phrases; the part stands first. A gripper's thumb is right on either jaw; without fingers
    there is none.
    """
    return [
        *_heading(found, truth),
        *_joints(found, truth),
        *_points(found, truth),
        *_hands(found, truth, describe(urdf)),
        *_feet(found, truth, describe(urdf)),
    ]


def region(phrase: str) -> str:
    """What of the body a mistake is about: `arms and head`, `legs`, `waist`."""
    part = phrase.partition(":")[0].rpartition("_")[2]
    return "waist" if part == "waist" else "legs" if part in _LEG else "arms and head"


def asked(found: Discovery, wrong: list[str]) -> bool:
    """Whether a question is about each part that is wrong; that of where the robot faces or is up is about all."""
    about = {question.about for question in found.questions}
    if about & {"forward", "up", "chest"}:
        return True
    # What asks about an elbow names the joints at which its arm was taken to end.
    about |= {f"{side}_hand" for side in ("left", "right") if f"{side}_elbow" in about}
    about |= {f"{side}_leg" for side in ("left", "right") if {f"{side}_{part}" for part in _LEG} & about}
    if "pelvis" in about:
        about |= {"waist", *(f"{side}_{part}" for side in ("left", "right") for part in _LEG)}
    return all(any(phrase.startswith(name) for name in about) for phrase in wrong)


def _heading(found: Discovery, truth: Humanoid) -> Iterator[str]:
    for name, axis, true_3 in (("up", found.up, truth.up_3), ("forward", found.forward, truth.forward_3)):
        if (off := _degrees(np.array(axis.root_3), true_3)) > _UPRIGHT:
            yield f"{name}: {off:.0f} degrees off"


def _joints(found: Discovery, truth: Humanoid) -> Iterator[str]:
    for chain, part in _CHAINS.items():
        if not found.whole_body and region(part) != "arms and head":
            continue
        chosen, right = found.chains.get(chain, ()), truth.chains[chain]
        if chain == "waist":
            chosen = tuple(joint for joint in chosen if joint in found.joints)  # what slides is held
        # Without a joint beyond the elbow that turns a hand, nothing is lost by one.
        if set(chosen) != set(right):
            yield f"{part}: {sorted(set(chosen) ^ set(right))}"


def _points(found: Discovery, truth: Humanoid) -> Iterator[str]:
    points = truth.points
    side = "left" if "left_elbow" in points else "right"
    arm = sum(np.linalg.norm(points[f"{side}_{end}"] - points[f"{side}_elbow"]) for end in ("shoulder", "wrist"))
    near = _NEAR * max(float(arm) / 0.5, 0.25)
    for name, true_3 in points.items():
        if name not in found.points:
            yield f"{name}: not found"
            continue
        point_3 = np.array(found.points[name].root_3)
        if name in _ELBOWS and truth.wrist_swings == 0:
            elbow = _ELBOWS[name]
            off = _degrees(point_3 - np.array(found.points[elbow].root_3), true_3 - points[elbow])
            if off > _ALONG:
                yield f"{name}: {off:.0f} degrees off, seen from the elbow"
        elif (off := float(np.linalg.norm(point_3 - true_3))) > near:
            yield f"{name}: {1000 * off:.0f} mm off"


def _hands(found: Discovery, truth: Humanoid, description: Description) -> Iterator[str]:
    for side in ("left", "right"):
        end = found.ends.get(f"{side}_hand")
        if end is None:
            if truth.wrist_joints and truth.chains[f"{side}_arm"]:
                yield f"{side}_hand: not found"
            continue
        if not truth.chains[f"{side}_arm"]:
            yield f"{side}_hand: there is none"
            continue
        pose_33 = _turn(description, end.link)
        fingers, thumb = (
            _degrees(pose_33 @ np.array(end.axes[word]), truth.directions[f"{side}_{word}"])
            for word in ("fingers", "thumb")
        )
        if fingers > _POINTING:
            yield f"{side}_hand: fingers {fingers:.0f} degrees off"
        elif truth.hand.endswith("fingers") and thumb > _ACROSS:
            yield f"{side}_hand: thumb {thumb:.0f} degrees off"
        elif "jaw" in truth.hand and min(thumb, 180 - thumb) > _ACROSS:
            yield f"{side}_hand: jaws {thumb:.0f} degrees off"


def _feet(found: Discovery, truth: Humanoid, description: Description) -> Iterator[str]:
    if not found.whole_body:
        return
    for side in ("left", "right"):
        end, true = found.ends.get(f"{side}_foot"), truth.directions.get(f"{side}_toes")
        if (end is None) != (true is None):
            yield f"{side}_foot: {'not found' if end is None else 'there is none'}"
        if end is None or true is None:
            continue
        for word, name in (("forward", "toes"), ("up", "foot_up")):
            axis_3 = _turn(description, end.link) @ np.array(end.axes[word])
            if (off := _degrees(axis_3, truth.directions[f"{side}_{name}"])) > _STANDING:
                yield f"{side}_foot: {word} {off:.0f} degrees off"


def _turn(description: Description, link: str) -> np.ndarray:
    """The rotation (3, 3) of a link at zero, in the root's frame."""
    pose_33 = np.eye(3)
    for joint in reversed(description.joints_above(link)):
        pose_33 = pose_33 @ joint.origin_44[:3, :3]
    return pose_33


def _degrees(a_3: np.ndarray, b_3: np.ndarray) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a_3, b_3)), a_3 @ b_3)))
