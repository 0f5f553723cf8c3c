"""The human motions that measure a retargeter, each with the reference retargeter's answer.

The answer is kept on disk: it depends on the motions, the robot and the reference's settings alone.
Legend: T frames, J = 21 human joints, N robot joints.
"""

from __future__ import annotations

import itertools
import os
import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from torch import Tensor

from mrhubo.body import Skeleton
from mrhubo.config import Config, EvaluationConfig, fingerprint
from mrhubo.errors import UserError, unknown_name
from mrhubo.files.arrays import DamagedFile
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.motion import Motion, find_motions, read_folder, reshare
from mrhubo.motion.readers.options import NoRate
from mrhubo.pairing import pose_settings
from mrhubo.reference import OptimizationRetargeter
from mrhubo.robot import BodyMap
from mrhubo.runtime.locations import default_motions
from mrhubo.runtime.progress import SILENT, Reporter
from mrhubo.runtime.threads import each_in_a_thread

REFERENCE_SCHEMA = "mrhubo.reference/4"
_NAME = 80
"""Bytes of a motion's name that the name of a file begins with."""


@dataclass(frozen=True)
class Clip:
    """A motion, and the joint angles (T, N) [rad] that the reference retargeter gives it."""

    motion: Motion
    reference_TN: Tensor
    optimum_TN: Tensor | None = None
    """Those (T, N) [rad] that suit each frame best, whatever comes before and after; None: nobody asked."""

    @property
    def name(self) -> str:
        """The motion's name."""
        return self.motion.name


@dataclass(frozen=True)
class Motions:
    """Motions for validation and for the test, from one folder."""

    folder: Path
    validation: list[Motion]
    test: list[Motion]

    @property
    def all(self) -> list[Motion]:
        """Those for validation, then those for the test."""
        return [*self.validation, *self.test]


def load_motions(config: Config, skeleton: Skeleton | None = None, split: bool = True) -> Motions:
    """Reads and splits the motions of `evaluation`, or those that lie where motions lie by default; their rotations are
    for a skeleton (`Motion.for_skeleton`), by default ours. Unless `split`, either part may be empty.

    Raises:
        UserError: no folder exists, a file cannot be used, a clip for validation is not there, or the split leaves
            validation or test empty.
    """
    try:
        folder = find_motions(config.evaluation.motions or default_motions())
    except UserError as error:
        raise UserError(f"evaluation.motions: {error}") from error
    skeleton = skeleton or Skeleton()
    try:
        motions = [motion.for_skeleton(skeleton) for motion in read_folder(folder)]
    except NoRate as error:
        raise error.instead(
            "clips tell it themselves, as AMASS's .npz by 'mocap_frame_rate'; write such a file"
        ) from error
    names = set(config.evaluation.validation)
    missing = sorted(names.difference(m.name for m in motions))
    asked = config.evaluation.validation != EvaluationConfig().validation  # which names clips of two folders
    if split and missing and asked:
        known = unknown_name("clip", missing[0], [m.name for m in motions], str(folder))
        raise UserError(f"evaluation.validation: {known}")
    validation = [m for m in motions if m.name in names]
    test = [m for m in motions if m.name not in names]
    if split and not (validation and test):
        found = ", ".join(m.name for m in motions)
        which = "validation" if not validation else "the test"
        raise UserError(f"evaluation.validation: leaves no clip for {which}; {folder} holds {found}")
    return Motions(folder, validation, test)


def reshare_clips(clips: Sequence[Clip]) -> list[Clip]:
    """The clips with their motions re-shared (`mrhubo.motion.reshare`), each with a seed of its own, the same ever
    again. Limbs point where they did, so the reference's answers are those to the motions as they were.
    """
    return [replace(clip, motion=reshare(clip.motion, int(clip.motion.checksum, 16) % 2**31)) for clip in clips]


def solve_references(
    config: Config,
    body_map: BodyMap,
    motions: Motions,
    folder: Path,
    report: Reporter = SILENT,
) -> tuple[list[Clip], list[Clip]]:
    """Reference joint angles for all clips: validation and test. Answers in `folder` are used again.

    Args:
        config: the run's config.
        body_map: the robot, on the CPU.
        motions: what `load_motions` gave.
        folder: where answers are kept.
        report: told of every clip.
    """
    # Directions are all that the reference sees of a robot, whatever its lengths are made of.
    directions = {k: v for k, v in pose_settings(config).items() if k not in ("scale", "manual", "search")}
    common = {
        "schema": REFERENCE_SCHEMA,
        "robot": fingerprint(directions),
        "skeleton": body_map.skeleton.checksum,
        "kinematics": body_map.robot.description.kinematics,
        "velocity": repr(body_map.robot.velocity_N.tolist()),
        "smoothness": repr(config.evaluation.smoothness),
    }
    retargeter = OptimizationRetargeter(body_map, smoothness=config.evaluation.smoothness)

    def answers(motion: Motion) -> Clip:
        header = {**common, "motion_xxh3": motion.checksum}
        short = os.fsencode(motion.name)[:_NAME].decode(errors="ignore")
        path = folder / f"{config.robot.name}-{short}-{fingerprint(header)}.safetensors"
        try:
            tensors, found = read_tensors(path)
            known = [tensors["q"], tensors["optimum"]] if found == header else []
        except (DamagedFile, KeyError):
            known = []
        shape = (len(motion), len(body_map.robot.joint_names))
        if not known or any(answer.shape != shape for answer in known):
            known = [q.float() for q in retargeter.motion_and_optima(motion.local_TJ33, motion.frame_rate)]
            write_tensors(path, dict(zip(("q", "optimum"), known, strict=True)), header)
        return Clip(motion, *known)

    everything, lock, done = motions.all, threading.Lock(), itertools.count(1)
    with report.step("reference", len(everything), "clips") as progress:
        progress.update(0)

        def told(motion: Motion) -> Clip:
            clip = answers(motion)
            with lock:
                progress.update(next(done), motion.name)
            return clip

        clips = each_in_a_thread(told, everything)
    count = len(motions.validation)
    return clips[:count], clips[count:]
