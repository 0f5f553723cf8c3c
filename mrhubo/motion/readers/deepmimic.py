"""Motions of DeepMimic's humanoid, as its `humanoid3d_walk.txt` and what AMP, PyBullet and others took over from it.

JSON: `Frames`, a row a frame of 44 numbers, and `Loop`. A row is how long the frame lasts [s]; where the root is [m]
and how it is turned; then chest, neck, right hip, right knee, right ankle, right shoulder, right elbow and the same of
the left side, each seen from the joint before: knees and elbows an angle [rad], all else a quaternion, w first
(https://github.com/xbpeng/DeepMimic, README.md, "Motion Data"; bones in data/characters/humanoid3d.txt). Axes of all
joints at rest: x forward, y up, z to the right; arms and legs hang. World: y up.

Legend: T frames.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.body.joints import SIDES
from mrhubo.errors import UserError
from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.motion.far_places import FARTHEST
from mrhubo.motion.motion import Motion
from mrhubo.motion.positions import BodyPoints, motion_from_points
from mrhubo.motion.readers.assemble import MAX_FRAMES
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.other_rotations import from_quaternions
from mrhubo.motion.readers.rate import asked_rate, told_rate
from mrhubo.robot_motion.clock import STEADY, at_rate, rate_of_rounded, uneven_steps

_FRAMES = "Frames"
_WIDTH = 44
_PLACE = slice(1, 4)
_QUATERNIONS = {
    "pelvis": 4, "spine3": 8, "head": 12,
    "right_hip": 16, "right_ankle": 21, "right_shoulder": 25,
    "left_hip": 30, "left_ankle": 35, "left_shoulder": 39,
}  # fmt: skip
"""Where in a row the four numbers of what turns each of our joints begin; the neck's carries the head."""
_ANGLES = {"right_knee": 20, "right_elbow": 29, "left_knee": 34, "left_elbow": 43}
_LIMBS = (
    ("pelvis", ("hip", "knee", "ankle"), (0.0, 0.0, 0.084887), (0.421546, 0.40987), -1.0),
    ("spine3", ("shoulder", "elbow", "wrist"), (-0.02405, 0.2435, 0.18311), (0.274788, 0.258947), 1.0),
)
"""What carries a limb; its joints; where the right one begins and how long its bones are [m]; the sign of an angle that
flexes about z."""
_CHEST_3 = np.array([0.0, 0.236151, 0.0])
"""The chest's joint, from the root [m]."""
_ACROSS_3 = np.array([0.0, 0.0, 1.0])
"""The axis of knees and elbows."""
_OURS_33 = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
"""From axes x forward, y up, z to the right to ours: x left, y up, z forward."""
_LARGEST = 2 * np.pi
"""No knee's or elbow's angle is that large [rad]; degrees are."""
_DIGITS = 5
"""Of durations that are right: 0.0166659999 is the step of 60 frames a second."""
_UNIT = 0.1
"""So far from 1 is the length of quaternions that are none, in half of the frames: files round to some digits, and
some average."""


def read_deepmimic(path: Path, value: Any, options: ReadOptions) -> Motion | None:
    """Reads DeepMimic's rows from what a JSON file holds; None of anything else.

    Frames that last differently long are interpolated to the rate at which most of them follow each other.

    Raises:
        NoMotion: its rows are another character's.
        UserError: the numbers are no motion, or the frame rate is not known.
    """
    rows = value.get(_FRAMES) if isinstance(value, dict) else None
    if not isinstance(rows, list) or not rows or not all(isinstance(row, list) for row in rows):
        return None
    widths = sorted({len(row) for row in rows})
    if any(isinstance(number, list | dict) for number in rows[0]) or widths[0] < 2:
        return None
    if widths != [_WIDTH]:
        found = " or ".join(map(str, widths[:3]))
        raise NoMotion(
            f"{path}: has '{_FRAMES}' as DeepMimic's motions have, but with rows of {found} numbers; its humanoid's"
            f" have {_WIDTH}, and other characters, as dogs and robots, are not read"
        )
    try:
        row_TX = np.array(rows, np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise UserError(f"{path}: '{_FRAMES}' holds what is no number") from error
    _check(path, row_TX)
    notes = options.of_one()
    row_TX, rate = _steady(path, row_TX, options, notes)
    body = _body(row_TX)
    source = f"DeepMimic's humanoid, '{_FRAMES}', y up"
    return motion_from_points(body, motion_name(path), rate, source, tuple(notes), str(path))


def _check(path: Path, row_TX: np.ndarray) -> None:
    """Refuses rows that are no motion."""
    if not np.isfinite(row_TX).all():
        raise UserError(f"{path}: '{_FRAMES}' holds NaN or infinite numbers")
    if np.abs(row_TX[:, _PLACE]).max() > FARTHEST:
        raise UserError(f"{path}: '{_FRAMES}' holds places beyond {FARTHEST:g} m")
    for joint, start in _QUATERNIONS.items():
        length_T = np.linalg.norm(row_TX[:, start : start + 4], axis=1)
        if abs(float(np.median(length_T)) - 1) > _UNIT:
            raise UserError(
                f"{path}: numbers {start + 1} to {start + 4} of the rows of '{_FRAMES}' are no quaternions; DeepMimic's"
                f" are, as they turn the {joint.replace('_', ' ')}"
            )
    if max(np.abs(row_TX[:, place]).max() for place in _ANGLES.values()) > _LARGEST:
        raise UserError(f"{path}: knees or elbows in '{_FRAMES}' have no angles in radians (degrees?)")


def _steady(path: Path, row_TX: np.ndarray, options: ReadOptions, notes: list[str]) -> tuple[np.ndarray, float]:
    """Rows at a fixed rate, and that [1/s]."""
    step_T = row_TX[:-1, 0] if len(row_TX) > 1 else row_TX[:, 0]
    if not step_T.any():
        return row_TX, asked_rate(path, options, f"says of all frames in '{_FRAMES}' that they last 0 s")
    if step_T.min() <= 0:
        raise UserError(f"{path}: frame {int(step_T.argmin())} of '{_FRAMES}' lasts {step_T.min():g} s")
    usual = float(np.median(step_T))
    exact = rate_of_rounded(usual, _DIGITS)
    rate = told_rate(path, "has", exact, options, notes)
    time_T = np.concatenate([[0.0], np.cumsum(row_TX[:-1, 0])])
    if rate != exact or np.abs(time_T / usual - np.arange(len(time_T))).max() <= STEADY:
        return row_TX, rate
    if time_T[-1] * rate > MAX_FRAMES:
        raise UserError(f"{path}: its {len(time_T):,} frames are spread over {time_T[-1]:.3g} s; that is no motion")
    notes.append(
        f"its {len(time_T):,} frames last {uneven_steps(time_T)} ms each: they are interpolated to {rate:.4g} a second"
    )
    for start in _QUATERNIONS.values():  # the same rotation on the side of the one before, between which lines go
        turn_T4 = row_TX[:, start : start + 4]
        far_T = (turn_T4[1:] * turn_T4[:-1]).sum(axis=1) < 0
        turn_T4[1:][np.cumsum(far_T) % 2 == 1] *= -1
    return at_rate(time_T, row_TX, rate), rate


def _body(row_TX: np.ndarray) -> BodyPoints:
    """Where limbs begin and end, how trunk, head and feet are turned, and about what limbs bend, in our world."""
    own = {joint: from_quaternions(row_TX[:, start : start + 4]) for joint, start in _QUATERNIONS.items()}
    own |= {joint: axis_angle_to_matrix(row_TX[:, place, None] * _ACROSS_3) for joint, place in _ANGLES.items()}
    world = {"pelvis": own["pelvis"]}
    world["spine3"] = world["pelvis"] @ own["spine3"]
    world["head"] = world["spine3"] @ own["head"]
    places = {"pelvis": row_TX[:, _PLACE]}
    places["spine3"] = places["pelvis"] + world["pelvis"] @ _CHEST_3
    points, hinges = {}, {}
    for carrier, joints, begins, bones, bends in _LIMBS:
        for side, sign in (("right", 1.0), ("left", -1.0)):
            turn_T33 = world[carrier]
            place_T3 = places[carrier] + turn_T33 @ (np.array(begins) * [1.0, 1.0, sign])
            for place, joint in enumerate(f"{side}_{name}" for name in joints):
                points[joint] = place_T3
                turn_T33 = turn_T33 @ own[joint] if joint in own else turn_T33
                world[joint] = turn_T33
                place_T3 = place_T3 - turn_T33[:, :, 1] * bones[place] if place < len(bones) else place_T3
            hinges[f"{side}_{joints[0]}"] = world[f"{side}_{joints[0]}"][:, :, 2] * bends
    turned = ("pelvis", "spine3", "head", *(f"{side}_ankle" for side in SIDES))
    return BodyPoints(
        {name: point_T3 @ _OURS_33.T for name, point_T3 in points.items()},
        {name: _OURS_33 @ world[name] @ _OURS_33.T for name in turned},
        {name: axis_T3 @ _OURS_33.T for name, axis_T3 in hinges.items()},
    )
