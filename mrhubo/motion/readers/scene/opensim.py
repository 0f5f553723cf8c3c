"""Motions of OpenSim, a line a frame: angles of a musculoskeletal model's joints, in `.mot` and `.sto` files, as its
inverse kinematics, OpenCap (https://www.opencap.ai) and AddBiomechanics (https://addbiomechanics.org) write them.

Lines that tell of the file, `inDegrees=yes` among them, up to `endheader`; the names of columns; and the frames, `time`
[s] first. Coordinates are those of the full-body model of A. Rajagopal et al. ("Full-body musculoskeletal model for
muscle-driven simulation of human gait", IEEE TBME 2016), of which OpenCap's and AddBiomechanics' are kin: their signs
and axes are the same, and so are those of the older gait models, whose knees bend backwards to negative angles. At all
angles 0 somebody stands upright, arms hanging and palms forward. World: x forward, y up, z to the right [m].

Legend: T frames, N parts.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from mrhubo.body.joints import SIDES
from mrhubo.errors import UserError, listed, shortened
from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.files.regular import read_regular
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import Content, NoMotion
from mrhubo.motion.readers.keypoint_table import numbers_of
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import asked_rate, rate_of_seconds, told_rate
from mrhubo.motion.readers.scene.turned import Skeleton, turned_motion
from mrhubo.robot_motion.clock import at_rate, rate_of_rounded

_BEGINS = re.compile(r"(?:[^\n]*\n){1,40}?[ \t]*endheader[ \t]*\r?\n(?:[ \t\r]*\n)*[ \t]*time\b", re.IGNORECASE)
_END = "endheader"
_MAX_BYTES, _MAX_FRAMES, _MOST = 2**27, 500_000, 3_000
_DIGITS, _STEP_DIGITS = 3, 5
"""Of times in frames, and of steps: files round them."""
_LARGEST = 1_000.0
"""No angle is beyond this [rad], and no place [m]: angles that wind up are a few turns."""

_Z, _X, _Y = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
_Vector = tuple[float, float, float]
_PARTS: tuple[tuple[str, str, _Vector, tuple[tuple[str, _Vector], ...]], ...] = (
    ("pelvis", "", (0.0, 0.0, 0.0), (("pelvis_tilt", _Z), ("pelvis_list", _X), ("pelvis_rotation", _Y))),
    (
        "torso", "pelvis", (-0.1007, 0.0815, 0.0),
        (("lumbar_extension", _Z), ("lumbar_bending", _X), ("lumbar_rotation", _Y)),
    ),
    (
        "head", "torso", (0.03, 0.45, 0.0),
        (("neck_extension", _Z), ("neck_bending", _X), ("neck_rotation", _Y)),
    ),
    (
        "femur", "pelvis", (-0.0563, -0.0785, 0.0773),
        (("hip_flexion", _Z), ("hip_adduction", _X), ("hip_rotation", _Y)),
    ),
    ("tibia", "femur", (-0.0045, -0.4096, -0.0018), (("knee_angle", _Z),)),
    (
        "foot", "tibia", (-0.01, -0.4, 0.0),
        (("ankle_angle", (-0.105, -0.174, 0.979)), ("subtalar_angle", (0.787, 0.605, -0.121))),
    ),
    ("toes", "foot", (0.13, -0.044, 0.009), ()),
    (
        "humerus", "torso", (0.0032, 0.3715, 0.17),
        (("arm_flex", _Z), ("arm_add", _X), ("arm_rot", _Y)),
    ),
    ("forearm", "humerus", (0.0131, -0.2863, -0.0096), (("elbow_flex", (0.226, 0.022, 0.974)),)),
    ("twist", "forearm", (-0.0067, -0.013, 0.0261), (("pro_sup", (0.056, 0.998, 0.002)),)),
    ("hand", "twist", (-0.0088, -0.2358, 0.0136), (("wrist_flex", _Z), ("wrist_dev", _X))),
    ("hand_index", "hand", (0.0, -0.09, 0.0), ()),
    ("hand_thumb", "hand", (0.0, -0.04, 0.03), ()),
)  # fmt: skip
"""Parts of the right side and of the middle: what carries each, where it begins there [m], and about what it is turned
there, one after the other, in the axes of the right side."""
_MIDDLE = ("pelvis", "torso", "head")
_NEEDED = (
    *("pelvis_tilt", "pelvis_list", "pelvis_rotation"),
    *(f"{name}_{side[0]}" for name in ("hip_flexion", "knee_angle", "arm_flex", "elbow_flex") for side in SIDES),
)
_OURS = {
    "femur": "hip", "tibia": "knee", "foot": "ankle", "toes": "foot",
    "humerus": "shoulder", "forearm": "elbow", "hand": "wrist",
}  # fmt: skip
"""Our joints where parts begin."""
_PLACE = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
_KNEE = "knee_angle"


def is_opensim(content: Content) -> bool:
    """Whether a text begins as OpenSim's tables do."""
    return content.text is not None and _BEGINS.match(content.text) is not None


def read_opensim(path: Path, options: ReadOptions) -> Motion:
    """Reads the angles of a body.

    Raises:
        NoMotion: the columns are none of a whole body's.
        UserError: the file is damaged or too large, or the numbers are no motion.
    """
    columns, value_TX, in_degrees = _table(path)
    place = {_coordinate(name): i for i, name in reversed(list(enumerate(columns)))}
    missing = [name for name in _NEEDED if name not in place]
    if missing:
        raise NoMotion(
            f"{path}: is a table of OpenSim without {shortened(listed(missing), 120)}; a human motion is read from the"
            " angles of pelvis, legs and arms, as inverse kinematics writes them, not from forces or markers"
        )
    notes: list[str] = []
    value_TX, rate = _steady(path, value_TX, options, notes)
    turns, skeleton = _skeleton()
    local_TN33 = np.tile(np.eye(3), (len(value_TX), len(turns), 1, 1))
    for part, axes in enumerate(turns):
        for coordinate, axis_3 in axes:
            if coordinate not in place:
                continue
            angle_T = value_TX[:, place[coordinate]]
            angle_T = np.radians(angle_T) if in_degrees else angle_T
            if coordinate.startswith(_KNEE):  # they bend one way, whatever its sign
                angle_T = -angle_T if np.mean(angle_T) > 0 else angle_T
            local_TN33[:, part] = local_TN33[:, part] @ axis_angle_to_matrix(angle_T[:, None] * axis_3)
    if all(name in place for name in _PLACE):
        root_T3 = value_TX[:, [place[name] for name in _PLACE]]
    else:
        root_T3 = np.zeros((len(value_TX), 3))
        notes.append("where the pelvis is is not told")
    return turned_motion(path, skeleton, local_TN33, root_T3, rate, "angles of OpenSim", options, notes)


def _table(path: Path) -> tuple[list[str], np.ndarray, bool]:
    """The names of columns, the frames (T, X), and whether angles are in degrees."""
    lines = read_regular(path, _MAX_BYTES).decode("utf-8-sig", "replace").splitlines()
    end = next((i for i, line in enumerate(lines) if line.strip().lower() == _END), len(lines))
    head = "".join(lines[:end]).replace(" ", "").lower()
    rows = [line.split() for line in lines[end + 1 :] if line.strip()]
    if len(rows) < 2:
        raise UserError(f"{path}: has a header and no frames")
    columns, *rows = rows
    if len(columns) > _MOST or len(rows) > _MAX_FRAMES:
        raise UserError(f"{path}: has {len(rows):,} frames of {len(columns):,} numbers; more than are read")
    value_TX = numbers_of(path, rows, " ", columns, range(len(columns)))
    return columns, value_TX, "indegrees=yes" in head


def _coordinate(column: str) -> str:
    """The coordinate that a column is of; OpenSim 4 has `/jointset/hip_r/hip_flexion_r/value` for `hip_flexion_r`, and
    speeds beside.
    """
    return column if column.endswith("/speed") else column.removesuffix("/value").rpartition("/")[2]


def _steady(path: Path, value_TX: np.ndarray, options: ReadOptions, notes: list[str]) -> tuple[np.ndarray, float]:
    """Frames at a fixed rate, and that [1/s]."""
    time_T = value_TX[:, 0] - value_TX[0, 0]
    if not np.isfinite(value_TX).all() or np.abs(value_TX[:, 1:]).max(initial=0.0) > np.degrees(_LARGEST):
        raise UserError(f"{path}: holds NaN, infinite numbers, or numbers beyond all angles and places")
    rate = rate_of_seconds(time_T)
    if rate is not None:
        return value_TX, told_rate(path, "its times are at", rate, options, notes)
    why, usual = "has times that do not rise evenly", float(np.median(np.diff(time_T))) if len(time_T) > 1 else 0.0
    if usual <= 0 or options.rate is not None:
        return value_TX, asked_rate(path, options, why)
    rate = told_rate(path, "has", rate_of_rounded(usual, _STEP_DIGITS), options, notes)
    frame_T = np.round(time_T * rate, _DIGITS)
    if np.diff(frame_T).min() <= 0:
        return value_TX, asked_rate(path, options, why)
    if frame_T[-1] > _MAX_FRAMES:
        raise UserError(f"{path}: its {len(time_T):,} frames are spread over {time_T[-1]:.3g} s; that is no motion")
    notes.append(f"its {len(time_T):,} frames follow each other unevenly: they are interpolated to {rate:.4g} a second")
    return at_rate(frame_T / rate, value_TX, rate), rate


def _skeleton() -> tuple[list[list[tuple[str, np.ndarray]]], Skeleton]:
    """About what parts are turned, by which coordinates; and the parts, left ones mirrored."""
    rows: list[tuple[str, str, np.ndarray, list[tuple[str, np.ndarray]]]] = []
    for side in ("", *SIDES):
        across = np.array([1.0, 1.0, -1.0 if side == "left" else 1.0])
        for part, carrier, start_3, axes in _PARTS:
            if (part in _MIDDLE) != (side == ""):
                continue
            end = f"_{side[0]}" if side else ""
            # a turn's axis is mirrored as no direction is: the other two of its numbers change their sign
            turned = [(f"{name}{end}", np.array(axis_3) * across * across[2]) for name, axis_3 in axes]
            above = carrier if carrier in ("", *_MIDDLE) else f"{side}_{carrier}"
            rows.append((f"{side}_{part}" if side else part, above, np.array(start_3) * across, turned))
    names = [name for name, _, _, _ in rows]
    parents = [names.index(above) if above else -1 for _, above, _, _ in rows]
    offset_N3 = np.array([start_3 for _, _, start_3, _ in rows])
    body = {"pelvis": "pelvis", "spine3": "torso", "head": "head"}
    body |= {f"{side}_{joint}": f"{side}_{part}" for part, joint in _OURS.items() for side in SIDES}
    places = {joint: names.index(part) for joint, part in body.items()}
    return [axes for _, _, _, axes in rows], Skeleton(names, parents, offset_N3, "its pose at all angles 0", places)
