"""Xsens' segments of a body: how each is turned, and where it begins.

All segments are turned as the world is, x forward, y left, z up, where somebody stands in a T-pose and looks along x
(Xsens MVN User Manual, segments' axes).

Legend: T frames, S = 23 segments.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.motion.far_places import FARTHEST
from mrhubo.motion.motion import Motion
from mrhubo.motion.positions import BodyPoints, motion_from_points
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.other_rotations import from_quaternions

_ARM = ("Shoulder", "UpperArm", "ForeArm", "Hand")
_LEG = ("UpperLeg", "LowerLeg", "Foot", "Toe")
SEGMENTS = (
    "Pelvis", "L5", "L3", "T12", "T8", "Neck", "Head",
    *(f"{side}{part}" for parts in (_ARM, _LEG) for side in ("Right", "Left") for part in parts),
)  # fmt: skip
"""Names of the segments, in Xsens' order."""
BEGINS = {
    "Shoulder": "collar", "UpperArm": "shoulder", "ForeArm": "elbow", "Hand": "wrist", "UpperLeg": "hip",
    "LowerLeg": "knee", "Foot": "ankle", "Toe": "foot",
}  # fmt: skip
"""Our joint where each segment of a limb begins."""
_TRUNK = {"Pelvis": "pelvis", "T8": "spine3", "Neck": "neck", "Head": "head"}
"""Ours that is turned as a segment; they begin elsewhere than ours, which turns tell."""
_ENDS = ("Hand", "Foot")
HUMAN_33 = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""From axes x forward, y left, z up to ours: x left, y up, z forward."""


def segments_motion(
    path: Path,
    turn_TS4: np.ndarray,
    place_TS3: np.ndarray,
    frame_rate: float,
    source: str,
    notes: tuple[str, ...],
    places_are: str,
) -> Motion:
    """The motion of a body's segments.

    Args:
        path: the file.
        turn_TS4: quaternions, w first.
        place_TS3: where they begin [m].
        frame_rate: frames per second.
        source: what the file was taken for.
        notes: what the reader has to say.
        places_are: what the file calls the places, for a sentence.

    Raises:
        UserError: places are NaN, infinite or too far, or turns tell no chest.
    """
    if not (np.abs(np.nan_to_num(place_TS3, nan=np.inf)) < FARTHEST).all():
        raise UserError(f"{path}: {places_are} holds NaN, infinite numbers, or some beyond {FARTHEST:g} m")
    turn_TS33 = from_quaternions(turn_TS4)
    at = {name: segment for segment, name in enumerate(SEGMENTS)}
    limbs = {
        f"{side.lower()}_{joint}": at[f"{side}{part}"] for side in ("Left", "Right") for part, joint in BEGINS.items()
    }
    turned = {joint: at[name] for name, joint in _TRUNK.items()} | {
        f"{side.lower()}_{BEGINS[end]}": at[f"{side}{end}"] for side in ("Left", "Right") for end in _ENDS
    }
    body = BodyPoints(
        {joint: place_TS3[:, segment] @ HUMAN_33.T for joint, segment in limbs.items()},
        {joint: HUMAN_33 @ turn_TS33[:, segment] @ HUMAN_33.T for joint, segment in turned.items()},
    )
    return motion_from_points(body, motion_name(path), frame_rate, source, notes, str(path))
