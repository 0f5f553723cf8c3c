"""Robot motions that anybody's retargeter made, measured as a package is.

Legend: T frames, N joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from mrhubo.errors import UserError, listed, unknown_name
from mrhubo.evaluation import Motions, evaluate_clips, motion_table, solve_references, table
from mrhubo.files.regular import naming
from mrhubo.fitting.preparation import Prepared
from mrhubo.motion import Motion, resample, trim
from mrhubo.robot import Robot
from mrhubo.robot_motion import RobotMotion, read_robot_motion
from mrhubo.runtime.progress import Reporter

_SPARE = 1
"""Frames by which a prediction may be shorter or longer than the motion: who resamples may round otherwise."""
_MOVES = 1e-3
"""Range [rad] from which on a joint is said to move."""
_FAR, _ROUNDED = 1.0, 1e-2
"""Beyond a limit [rad]: what no retargeter's own limits explain, and what rounding does."""


@dataclass(frozen=True)
class _Prediction:
    """Joint angles for a motion, both at one frame rate and of one length."""

    motion: Motion
    q_TN: Tensor
    notes: tuple[str, ...]


def measure_predictions(
    prepared: Prepared,
    report: Reporter,
    files: Sequence[Path],
    joint_names: Sequence[str] = (),
    frame_rate: float | None = None,
) -> str:
    """The tables of the motions that are predicted and their means.

    Each is measured at its own frame rate: the human motion is brought to it (`mrhubo.motion.resample`), and the
    reference answers it there.

    Args:
        prepared: the robot, and the motions that measure.
        report: told of the motions.
        files: robot motions (`mrhubo.robot_motion`), or LeRobot datasets of one.
        joint_names: of files that do not tell them.
        frame_rate: of files that do not tell it [1/s].

    Raises:
        UserError: a file is none, of a motion that is not there, or of another length; joints of the robot are missing
            in it; or two answer the same motion.
    """
    robot, known = prepared.body_map.robot, {motion.name: motion for motion in prepared.motions.all}
    found: dict[str, _Prediction] = {}
    for file in files:
        with naming(file):
            prediction = _match(file, read_robot_motion(file, joint_names, frame_rate), known, robot)
        name = prediction.motion.name
        if name in found:
            raise UserError(f"{file}: answers '{name}', as another file does; measure one retargeter at a time")
        found[name] = prediction
    predictions = list(found.values())
    motions = Motions(prepared.motions.folder, [], [prediction.motion for prediction in predictions])
    clips = solve_references(prepared.config, prepared.body_map, motions, prepared.references_dir, report)[1]
    key_links = prepared.config.robot.key_links
    answers = {
        "predictions": [prediction.q_TN for prediction in predictions],
        "reference": [clip.reference_TN for clip in clips],
    }
    ways = {way: evaluate_clips(q, clips, prepared.body_map, key_links) for way, q in answers.items()}
    notes = dict.fromkeys(note for prediction in predictions for note in prediction.notes)
    return "\n".join([table(ways["predictions"]), "", motion_table(ways), *notes])


def _match(file: Path, found: RobotMotion, known: dict[str, Motion], robot: Robot) -> _Prediction:
    """A file's joint angles in the robot's order, and the motion that they answer."""
    found = found.single()
    if found.frame_rate is None:
        raise UserError(f"{file}: has no frame rate; give it as 'frame_rate', or with --rate")
    name = found.name if found.name in known else file.stem
    if name not in known:
        named = found.name or name
        said = unknown_name("motion", named, known, "evaluation.motions")
        raise UserError(f"{file}: {said}; name the file, or 'name' in it, as the motion that it answers")
    motion = resample(known[name], found.frame_rate)
    count = min(len(motion), len(found))
    if abs(len(motion) - len(found)) > _SPARE:
        has = f"has {len(found)} frames at {found.frame_rate:g} per second"
        raise UserError(f"{file}: {has}; '{name}' has {len(motion)} at that rate")
    for joint in robot.joint_names:
        if joint not in found.joint_names:
            raise UserError(f"{file}: {unknown_name('joint', joint, found.joint_names, 'it')}; the robot's joints are "
                            f"{listed(robot.joint_names)}")  # fmt: skip
    columns = [found.joint_names.index(joint) for joint in robot.joint_names]
    q_TN = torch.from_numpy(np.ascontiguousarray(found.q[:count, columns]))
    return _Prediction(_first(motion, count), q_TN, tuple(_notes(name, found, robot, q_TN)))


def _first(motion: Motion, count: int) -> Motion:
    return motion if count == len(motion) else trim(motion, 0.0, (count - 1) / motion.frame_rate)


def _notes(name: str, found: RobotMotion, robot: Robot, q_TN: Tensor) -> list[str]:
    """What a reader of the measures has to know."""
    notes = []
    columns = dict(zip(found.joint_names, found.q.T, strict=True))
    moving = [j for j, column in columns.items() if j not in robot.joint_names and float(np.ptp(column)) > _MOVES]
    if moving:
        notes.append(f"joints that move but are not the config's, and are held here: {listed(moving)}")
    outside = (q_TN < robot.lower_N - 1e-5) | (q_TN > robot.upper_N + 1e-5)
    if bool(outside.any()):
        share = float(outside.any(dim=1).float().mean())
        degrees = "; they look like degrees, and are read as radians" if _look_like_degrees(q_TN, robot) else ""
        notes.append(f"'{name}': {share:.1%} of the frames are outside the joints' limits{degrees}")
    return notes


def _look_like_degrees(q_TN: Tensor, robot: Robot) -> bool:
    """Whether most frames are far outside the limits [rad], and nearly all would be inside them in degrees."""

    def share(q_TN: Tensor, spare: float) -> float:
        beyond = (q_TN < robot.lower_N - spare) | (q_TN > robot.upper_N + spare)
        return float(beyond.any(dim=1).float().mean())

    return share(q_TN, _FAR) > 0.5 and share(torch.deg2rad(q_TN), _ROUNDED) < 0.01
