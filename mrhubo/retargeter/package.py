"""The trained retargeter as a folder that carries all it needs: weights, URDF, settings, joint names, limits, units.

    retargeter = Retargeter.load("package")
    result = retargeter(motion)                     # joint angles, with a confidence for each frame
    q_TN = retargeter.predict(local_TJ33)           # the two networks alone, microseconds a frame

Legend: T frames, J = 21 human joints, N robot joints, D directions.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body import BodyPrior
from mrhubo.body.vposer import VPoser
from mrhubo.config import Config
from mrhubo.errors import UserError
from mrhubo.fast.description import FILE, Description
from mrhubo.fast.poses import check_frame_rate
from mrhubo.fast.retargeter import POLISH
from mrhubo.motion import Motion, MotionLike, read_poses
from mrhubo.motion.steady import steady_root
from mrhubo.reference import Avoidance, DirectionProblem, Polish
from mrhubo.reference.standing import Standing
from mrhubo.retargeter.clip import join_frames
from mrhubo.retargeter.confidence import STANDARD, ConfidenceModel, branches_of, shake
from mrhubo.retargeter.describing import describe, write_description
from mrhubo.retargeter.floor import stand, standing_of
from mrhubo.retargeter.judging import judge
from mrhubo.retargeter.networks import JointNetwork
from mrhubo.retargeter.parts import checked_parts
from mrhubo.retargeter.precision import Float32Module, in_float32
from mrhubo.retargeter.result import RetargetResult, join_results
from mrhubo.retargeter.saving import package_checksum, read_package, write_package
from mrhubo.robot import BodyMap, SelfCollision, robot_facts
from mrhubo.robot_motion import RobotFacts


class Retargeter(Float32Module):
    """A trained network with its robot, on the CPU unless `to`, `cuda` or `cpu` moves it.

    Not made for training: its weights take no gradients, and its answers have none.
    """

    def __init__(
        self,
        network: JointNetwork,
        body_map: BodyMap,
        prior: BodyPrior,
        config: Config | None,
        phi_threshold: float,
        confidence: ConfidenceModel = STANDARD,
    ) -> None:
        super().__init__()
        self.network = network.requires_grad_(False).eval()
        self.body_map, self.prior, self.config, self.phi_threshold = body_map, prior, config, phi_threshold
        self.directions = DirectionProblem(body_map)
        """The optimiser's cost, for `polish`."""
        self.polisher = Polish(self.directions)
        self._avoidance: Avoidance | None = None
        self._standing: Standing | None = None
        self.confidence, self.branches = confidence, branches_of(self.directions)
        """How much each branch of an answer is to be trusted, and what the branches are."""
        self.origin, self.checksum = "a network of mrhubo that was not saved", ""
        """Where it was loaded from, and the checksum of its weights' file, which has those of all others."""

    @property
    def device(self) -> torch.device:
        """Where the networks are, and the answers will be."""
        return self.network.limited.lower_N.device

    @property
    def collision(self) -> SelfCollision:
        """The robot's collision shapes."""
        return self.body_map.collision

    @property
    def avoidance(self) -> Avoidance:
        """What makes answers give way that touch the robot itself; made when first asked for."""
        if self._avoidance is None:
            self._avoidance = Avoidance(self.body_map)
        return self._avoidance

    @property
    def standing(self) -> Standing | None:
        """What stands the robot on the floor, made when first asked for; None: it has no feet."""
        if self._standing is None:
            self._standing = standing_of(self.body_map)
        return self._standing

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints of the output, in order."""
        return self.body_map.robot.joint_names

    @cached_property
    def facts(self) -> RobotFacts:
        """What files of the robot's motion tell of it."""
        return robot_facts(self.body_map.robot, self.origin, self.checksum)

    @in_float32
    def forward(
        self,
        motion: MotionLike,
        polish: int = POLISH,
        frame_rate: float | None = None,
        together: bool | None = None,
        avoid_collisions: bool = True,
    ) -> RetargetResult:
        """Joint angles of a human motion, with a confidence for each frame; where the motion tells a root and the robot
        has feet, also where its base goes, so that planted feet stay where they are (docs/whole-body.md).

        Args:
            motion: a `Motion`, or an array of local rotations of SMPL's joints 1..21: matrices (..., 21, 3, 3),
                axis-angle [rad] (..., 63) or 6D (..., 21, 6). The answer has its leading axes, of which the last is the
                time and the others are motions of their own; none for a single pose. No frames give an empty answer.
            polish: steps of optimisation after the networks at most, see `predict`.
            frame_rate: frames per second of an array; a `Motion` has its own.
            together: all frames of a motion become one smooth motion, see `retarget`; None: where the frame rate is
                known.
            avoid_collisions: as for `predict`.

        Raises:
            UserError: the array has another shape, holds NaN, infinite numbers or what is no rotation (says in which
                frame), `polish` is negative, or the frame rate is not positive, or missing and needed.
        """
        poses = read_poses(motion, frame_rate, self.body_map.skeleton)
        length = poses.shape[-1] if poses.shape and poses.frame_rate else len(poses.local_TJ33)
        clips = [motion] if isinstance(motion, Motion) else poses.local_TJ33.split(max(1, length))
        options = (polish, poses.frame_rate, together, avoid_collisions)
        answers = [self.retarget(clip, *options) for clip in clips]
        told = (motion.name, motion.source) if isinstance(motion, Motion) else ()
        return join_results(answers).with_leading(poses.shape, poses.frame_rate, *told)

    if TYPE_CHECKING:
        __call__ = forward

    @in_float32
    def predict(
        self,
        local_TJ33: MotionLike,
        polish: int = 0,
        frame_rate: float | None = None,
        avoid_collisions: bool = True,
    ) -> Tensor:
        """Joint angles (T, N) [rad] of human poses; inside the limits.

        Args:
            local_TJ33: local rotations (T, 21, 3, 3) of SMPL's joints 1..21: an array, nested lists, or a motion.
            polish: Levenberg-Marquardt steps of the reference retargeter from the networks' answer, at most, each frame
                on its own, until it has converged; a step that does not bring the limbs nearer to the human's is not
                taken. An arm (or the head) that is then still far off starts again from other places, see
                `mrhubo.reference.polish`. 0: the networks alone.
            frame_rate: frames per second: all frames become one smooth motion, in which no joint turns faster than it
                can (`mrhubo.retargeter.clip`). None: each frame on its own.
            avoid_collisions: frames in which the robot would touch itself give way (`mrhubo.reference.avoidance`), if
                there are steps of optimisation at all.

        Raises:
            UserError: the poses have another shape, or hold NaN, infinite numbers or some that no rotation has;
                `polish` is negative, or the frame rate not positive.
        """
        check_frame_rate(frame_rate)
        parts = checked_parts(local_TJ33, self.body_map.skeleton, self.device, polish)
        directed = bool(polish or frame_rate) or self.network.directed
        targets = [self.body_map.human_directions(part) for part in parts] if directed else [None] * len(parts)
        return self.follow(parts, targets, polish, frame_rate, avoid_collisions)

    def follow(
        self, parts: Sequence[Tensor], targets: Sequence[Tensor | None], polish: int, frame_rate: float | None,
        avoid_collisions: bool,
    ) -> Tensor:  # fmt: skip
        """`predict` for the parts of a motion that are known to be good, with their directions, or others that shall be
        imitated in their place, where they are needed.
        """
        q_TN = torch.cat([self.answer(*part, polish) for part in zip(parts, targets, strict=True)])
        avoidance = self.avoidance if polish and avoid_collisions else None
        known = [target for target in targets if target is not None]
        if frame_rate is not None:
            return join_frames(self.directions, q_TN, torch.cat(known), frame_rate, avoidance)
        return q_TN if avoidance is None else avoidance(q_TN, torch.cat(known))

    @in_float32
    def retarget(
        self,
        local_TJ33: MotionLike,
        polish: int = POLISH,
        frame_rate: float | None = None,
        together: bool | None = None,
        avoid_collisions: bool = True,
    ) -> RetargetResult:
        """Joint angles, by default after steps of optimisation until they have converged, with a confidence for each
        frame; a `Motion` that becomes one smooth motion moves the base of a robot with feet, as `forward` does.

        Args:
            local_TJ33: as for `predict`.
            polish: as for `predict`.
            frame_rate: frames per second, if the poses are one motion; a `Motion` has its own.
            together: all frames become one smooth motion, as for `predict`; None: where the frame rate is known.
            avoid_collisions: as for `predict`.

        Raises:
            UserError: as for `predict`; or a motion without a frame rate is to become smooth.
        """
        if isinstance(local_TJ33, Motion):
            frame_rate = local_TJ33.frame_rate
        if together and frame_rate is None:
            raise UserError("together=True needs the frame rate: frame_rate=..., or a Motion, which has its own")
        joined_at = None if together is False else frame_rate
        check_frame_rate(joined_at)
        as_seen = local_TJ33
        if joined_at is not None and isinstance(local_TJ33, Motion) and self.standing is not None:
            local_TJ33 = steady_root(local_TJ33)
        parts = checked_parts(local_TJ33, self.body_map.skeleton, self.device, polish)
        targets = [self.body_map.human_directions(part) for part in parts]
        stands = (
            None if joined_at is None else stand(self, local_TJ33, as_seen, parts, targets, polish, avoid_collisions)
        )
        q_TN, told = stands or (self.follow(parts, targets, polish, joined_at, avoid_collisions), {})
        shake_TD = None if frame_rate is None else shake(torch.cat(targets), frame_rate)
        sizes = [len(target) for target in targets]
        shakes = [None] * len(sizes) if shake_TD is None else shake_TD.split(sizes)
        judged = [judge(self, *part) for part in zip(q_TN.split(sizes), targets, shakes, strict=True)]
        return dataclasses.replace(join_results(judged), **told)

    @in_float32
    def judge(self, q_TN: Tensor, local_TJ33: Tensor, frame_rate: float | None = None) -> RetargetResult:
        """What `retarget` tells about its own answers, for any joint angles (T, N) [rad] and human poses (T, 21, 3, 3),
        both on the retargeter's device, float32; with frames per second, if they are one motion.
        """
        target_TD3 = self.body_map.human_directions(local_TJ33)
        return judge(self, q_TN, target_TD3, None if frame_rate is None else shake(target_TD3, frame_rate))

    @in_float32
    def answer(self, local_TJ33: Tensor, target_TD3: Tensor | None, polish: int = 0) -> Tensor:
        """Joint angles (T, N) [rad] for poses that are known to be good, on the retargeter's device, float32.

        Args:
            local_TJ33: human poses (T, 21, 3, 3).
            target_TD3: their directions (`BodyMap.human_directions`), or others that shall be imitated in their place;
                needed for steps of optimisation. Networks that see directions see these.
            polish: as for `predict`.
        """
        if target_TD3 is not None and self.network.directed:
            q_TN = self.network.of_directions(target_TD3)
        else:
            q_TN = self.network(rotation.matrix_to_sixd(local_TJ33))
        if not polish or not len(q_TN) or target_TD3 is None:
            return q_TN
        return self.polisher(q_TN, target_TD3, polish)

    def save(self, folder: Path, provenance: dict[str, str]) -> Path:
        """Writes the package; `provenance` (run, commit, checksums, measures) goes into the header.

        Raises:
            UserError: the retargeter was made without a config.
        """
        if self.config is None:
            raise UserError(f"{folder}: {self.origin} is not saved; a fit with model.start=universal makes a package")
        settings = {"phi_threshold": repr(self.phi_threshold), "confidence": self.confidence.to_json(), **provenance}
        write_package(folder, self.network, self.body_map, self.prior, self.config, settings)
        self.origin, self.checksum = f"package {folder.resolve().name}", package_checksum(folder)
        self.__dict__.pop("facts", None)
        self.save_description(folder)
        return folder

    def describe(self) -> Description:
        """All that an answer needs as plain arrays, for `mrhubo.fast`.

        Raises:
            UserError: its body prior is VPoser, with which only PyTorch works.
        """
        return describe(self)

    def save_description(self, folder: Path) -> Path | None:
        """Writes `describe` into a folder; None for a retargeter that has no such arrays."""
        return None if isinstance(self.prior, VPoser) else write_description(self.describe(), folder / FILE)

    @classmethod
    @in_float32
    def load(cls, folder: Path | str) -> Retargeter:
        """Reads a package.

        Raises:
            UserError: the folder is no package, a file is missing or damaged, was edited or comes from another package,
                or weights and settings do not fit.
        """
        folder = Path(folder)
        retargeter = cls(*read_package(folder))
        retargeter.origin, retargeter.checksum = f"package {folder.resolve().name}", package_checksum(folder)
        return retargeter
