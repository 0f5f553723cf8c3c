"""Humanoids whose URDFs are not ours to ship, with mappings written by hand; tests skip where the files are not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from mrhubo.config import RobotConfig

_FOLDER = Path(__file__).parents[2] / "data" / "external" / "robots" / "more"
_SIDES = {"left": 1, "right": -1}


def _g1() -> dict[str, Any]:
    arm = ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow", "wrist_roll", "wrist_pitch", "wrist_yaw")
    points: dict[str, Any] = {"chest": "torso_link"}
    for side in _SIDES:
        points |= {
            f"{side}_shoulder": f"{side}_shoulder_roll_link",
            f"{side}_elbow": f"{side}_elbow_link",
            f"{side}_wrist": f"{side}_wrist_pitch_link",
            f"{side}_hand": {"link": f"{side}_wrist_yaw_link", "fingers": [1, 0, 0], "thumb": [0, 0, 1]},
        }
    return {
        "urdf": "g1_29dof_rev_1_0.urdf",
        "joints": [f"{side}_{joint}_joint" for side in _SIDES for joint in arm],
        "keypoints": points,
        "key_links": [f"{side}_{link}_link" for side in _SIDES for link in ("elbow", "wrist_yaw")],
    }


def _softbank(urdf: str, arm: tuple[str, ...], shoulder: str, wrist: str) -> dict[str, Any]:
    points: dict[str, Any] = {"chest": "torso"}
    for side in _SIDES:
        big, small = side[0].upper(), side[0]
        points |= {
            f"{side}_shoulder": f"{big}{shoulder}",
            f"{side}_elbow": f"{big}Elbow",
            f"{side}_wrist": wrist.format(big=big, small=small),
            f"{side}_hand": {"link": f"{small}_wrist", "fingers": [1, 0, 0], "thumb": [0, -_SIDES[side], 0]},
        }
    return {
        "urdf": urdf,
        "joints": [f"{side[0].upper()}{joint}" for side in _SIDES for joint in arm],
        "keypoints": points,
        "key_links": [f"{side[0]}_wrist" for side in _SIDES],
    }


MORE: dict[str, dict[str, Any]] = {
    "g1": _g1(),
    "pepper": _softbank("pepper.urdf", ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll", "WristYaw"),
                        "Shoulder", "{small}_wrist"),
    "romeo": _softbank("romeo.urdf", ("ShoulderPitch", "ShoulderYaw", "ElbowRoll", "ElbowYaw", "WristRoll", "WristYaw",
                                      "WristPitch"), "Shoulder", "{small}_wrist"),
}  # fmt: skip


def more_robot(name: str, **changes: Any) -> RobotConfig:
    """The config of a robot, with keypoints or other settings changed; None takes a keypoint away."""
    known = dict(MORE[name])
    urdf = _FOLDER / known.pop("urdf")
    if not urdf.exists():
        pytest.skip(f"{urdf} is not there")
    keypoints = {**known.pop("keypoints"), **changes.pop("keypoints", {})}
    keypoints = {part: entry for part, entry in keypoints.items() if entry is not None}
    return RobotConfig(**{"name": name, "urdf": urdf, "keypoints": keypoints, **known, **changes})
