"""The trained retargeter as a folder that carries all it needs: weights, URDF, settings, joint names, limits, units.

    retargeter = Retargeter.load("package")
    result = retargeter(motion)                     # joint angles, with a confidence for each frame
    q_TN = retargeter.predict(local_TJ33)           # the two networks alone, microseconds a frame

Legend: T frames, J = 21 human joints, N robot joints, D directions.
"""

from __future__ import annotations

import copy
import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import torch
from torch import Tensor, nn

from mrhubo import rotation
from mrhubo.body import BodyPrior, build_skeleton, open_prior, save_skeleton
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import Config, load_config, to_yaml
from mrhubo.errors import UserError, shortened
from mrhubo.files.storage import atomic_path, read_tensors, write_tensors
from mrhubo.motion import NOT_FINITE, MotionLike, read_poses, refuse_frames, to_tensor
from mrhubo.reference import DirectionProblem, Polish, angle_between
from mrhubo.retargeter.architecture import build_network
from mrhubo.retargeter.confidence import STANDARD, ConfidenceModel, Signals, branches_of, find_signals, shake
from mrhubo.retargeter.features import DirectionFeatures
from mrhubo.retargeter.integrity import (
    check_confidence,
    check_content,
    check_files,
    check_paths,
    check_prior,
    check_weights,
    file_checksums,
)
from mrhubo.retargeter.networks import RetargetNetwork
from mrhubo.retargeter.result import RetargetResult, join_results
from mrhubo.robot import BodyMap, SelfCollision, build_body_map
from mrhubo.robot.plausibility import read

SCHEMA = "mrhubo.retargeter/4"
_WEIGHTS, _URDF, _CONFIG, _PRIOR = "retargeter.safetensors", "robot.urdf", "config.yaml", "body_prior.safetensors"
_SKELETON = "skeleton.safetensors"
_OTHERS = (_URDF, _CONFIG, _PRIOR, _SKELETON)
"""Files beside the weights."""
_CHUNK = 8_192
"""Frames that are worked on at a time: each takes some 13 kB on the way."""
_LARGEST = 2.0
"""No number of a rotation matrix is larger than 1; those that come near to one may be a little."""
POLISH = 10
"""Steps of optimisation that `retarget` makes after the networks, at most, unless told otherwise. On CMU's clips and
NAO, 0.36% of the arms have not converged after ten; five leave 0.84%, forty 0.32%, which need another start."""


class Retargeter(nn.Module):
    """A trained network with its robot, on the CPU unless `to`, `cuda` or `cpu` moves it.

    Not made for training: its weights take no gradients, and its answers have none.
    """

    network: RetargetNetwork
    prior: BodyPrior
    body_map: BodyMap

    def __init__(
        self,
        network: RetargetNetwork,
        body_map: BodyMap,
        prior: BodyPrior,
        config: Config,
        phi_threshold: float,
        confidence: ConfidenceModel = STANDARD,
    ) -> None:
        super().__init__()
        self.network = network.requires_grad_(False).eval()
        self.body_map, self.prior, self.config, self.phi_threshold = body_map, prior, config, phi_threshold
        self.directions = DirectionProblem(body_map)
        """The optimiser's cost, for `polish`."""
        self._polish = Polish(self.directions)
        self.confidence, self.branches = confidence, branches_of(self.directions)
        """How much each branch of an answer is to be trusted, and what the branches are."""

    @property
    def device(self) -> torch.device:
        """Where the networks are, and the answers will be."""
        return self.network.limited.lower_N.device

    @property
    def collision(self) -> SelfCollision:
        """The robot's collision shapes."""
        return self.body_map.collision

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints of the output, in order."""
        return self.body_map.robot.joint_names

    if TYPE_CHECKING:

        def __call__(self, motion: MotionLike, polish: int = POLISH, frame_rate: float | None = None) -> RetargetResult:
            """`forward`."""
            ...

    def forward(self, motion: MotionLike, polish: int = POLISH, frame_rate: float | None = None) -> RetargetResult:
        """Joint angles of a human motion, with a confidence for each frame.

        Args:
            motion: a `Motion`, or an array of local rotations of SMPL's joints 1..21: matrices (..., 21, 3, 3),
                axis-angle [rad] (..., 63) or 6D (..., 21, 6). The answer has its leading axes: none for a single pose.
                No frames give an empty answer.
            polish: steps of optimisation after the networks at most, see `predict`.
            frame_rate: frames per second of an array; a `Motion` has its own. The angles do not depend on it.

        Raises:
            UserError: the array has another shape, holds NaN, infinite numbers or what is no rotation (says in which
                frame), `polish` is negative, or the frame rate is not positive.
        """
        poses = read_poses(motion, frame_rate, self.body_map.skeleton)
        length = poses.shape[-1] if poses.shape else 1
        answers = [
            self.retarget(clip_TJ33, polish, poses.frame_rate)
            for clip_TJ33 in (poses.local_TJ33.split(max(1, length)) if poses.frame_rate else [poses.local_TJ33])
        ]
        return join_results(answers).with_leading(poses.shape, poses.frame_rate)

    @torch.no_grad()
    def predict(self, local_TJ33: MotionLike, polish: int = 0) -> Tensor:
        """Joint angles (T, N) [rad] of human poses; inside the limits.

        Args:
            local_TJ33: local rotations (T, 21, 3, 3) of SMPL's joints 1..21: an array, nested lists, or a motion.
            polish: Levenberg-Marquardt steps of the reference retargeter from the networks' answer, at most, each frame
                on its own, until it has converged; a step that does not bring the limbs nearer to the human's is not
                taken. An arm (or the head) that is then still far off starts again from other places, see
                `mrhubo.reference.polish`. 0: the networks alone.

        Raises:
            UserError: the poses have another shape, or hold NaN, infinite numbers or some that no rotation has;
                `polish` is negative.
        """
        return torch.cat([self._predict(part, polish) for part in self._parts(local_TJ33, polish)])

    def _predict(self, local_TJ33: Tensor, polish: int) -> Tensor:
        needed = bool(polish) or isinstance(self.network.features, DirectionFeatures)
        return self.answer(local_TJ33, self.body_map.human_directions(local_TJ33) if needed else None, polish)

    @torch.no_grad()
    def retarget(self, local_TJ33: MotionLike, polish: int = POLISH, frame_rate: float | None = None) -> RetargetResult:
        """Joint angles, by default after steps of optimisation until they have converged, with a confidence for each
        frame; arguments as for `predict`, and frames per second, if the poses are one motion.
        """
        return join_results([self._retarget(part, polish, frame_rate) for part in self._parts(local_TJ33, polish)])

    @torch.no_grad()
    def signals(self, local_TJ33: Tensor, shake_TD: Tensor | None, polish: int = POLISH) -> tuple[Signals, Tensor]:
        """What tells how far to trust the answers to poses (T, 21, 3, 3), and the answers' directions (T, D, 3).

        Args:
            local_TJ33: local rotations (T, 21, 3, 3), of which no more are given than fit into memory.
            shake_TD: how much directions shake (`mrhubo.retargeter.confidence.shake`), where that is known.
            polish: as for `predict`.
        """
        target_TD3 = self.body_map.human_directions(local_TJ33)
        q_TN = self.answer(local_TJ33, target_TD3, polish)
        robot_TD3 = self.body_map.robot_directions(self.body_map.robot.forward(q_TN))
        return self._signals(target_TD3, robot_TD3, shake_TD), robot_TD3

    def _signals(self, target_TD3: Tensor, robot_TD3: Tensor, shake_TD: Tensor | None) -> Signals:
        reading = read(self.body_map, self.prior, target_TD3)
        return find_signals(self.branches, target_TD3, robot_TD3, reading, shake_TD)

    def _retarget(self, local_TJ33: Tensor, polish: int, frame_rate: float | None) -> RetargetResult:
        target_TD3 = self.body_map.human_directions(local_TJ33)
        return self._judge(self.answer(local_TJ33, target_TD3, polish), target_TD3, frame_rate)

    @torch.no_grad()
    def judge(self, q_TN: Tensor, local_TJ33: Tensor, frame_rate: float | None = None) -> RetargetResult:
        """What `retarget` tells about its own answers, for any joint angles (T, N) [rad] and human poses (T, 21, 3, 3),
        both on the retargeter's device, float32; with frames per second, if they are one motion.
        """
        return self._judge(q_TN, self.body_map.human_directions(local_TJ33), frame_rate)

    def _judge(self, q_TN: Tensor, target_TD3: Tensor, frame_rate: float | None) -> RetargetResult:
        links = self.body_map.robot.forward(q_TN)
        robot_TD3, columns = self.body_map.robot_directions(links), self.body_map.measured
        error_deg_TD = torch.rad2deg(angle_between(robot_TD3[:, columns], target_TD3[:, columns]))
        shake_TD = None if frame_rate is None else shake(target_TD3, frame_rate)
        signals = self._signals(target_TD3, robot_TD3, shake_TD)
        trust_TC = self.confidence(signals)
        return RetargetResult(
            q_TN,
            self.joint_names,
            trust_TC.amin(dim=1) if self.branches else torch.zeros_like(q_TN[:, 0]),
            error_deg_TD,
            signals.phi.amax(dim=1) if self.branches else torch.zeros_like(q_TN[:, 0]),
            self.collision.collides(q_TN, links),
            trust_TC,
            tuple(branch.name for branch in self.branches),
        )

    def _parts(self, local_TJ33: MotionLike, polish: int) -> Iterator[Tensor]:
        """The poses as the networks want them, on their device, float32, so many at a time that all that is made of
        them fits into memory.
        """
        if isinstance(polish, bool) or not isinstance(polish, int) or polish < 0:
            raise UserError(f"polish must be 0 or more steps, found {polish}")
        given, joints = to_tensor(local_TJ33, self.body_map.skeleton), len(POSED_JOINT_NAMES)
        if given.ndim != 4 or given.shape[1:] != (joints, 3, 3):
            raise UserError(
                f"human poses must have the shape (frames, {joints}, 3, 3), found {tuple(given.shape)}; other forms are"
                " for a call, retargeter(poses)"
            )
        for number, part in enumerate(given.split(_CHUNK)):
            largest_T = part.abs().flatten(1).amax(dim=1) if len(part) else part.new_zeros(0)
            refuse_frames(~largest_T.isfinite(), NOT_FINITE, number * _CHUNK)
            refuse_frames(largest_T > _LARGEST, "numbers that no rotation has", number * _CHUNK)
            yield part.to(self.device, torch.float32)

    @torch.no_grad()
    def answer(self, local_TJ33: Tensor, target_TD3: Tensor | None, polish: int = 0) -> Tensor:
        """Joint angles (T, N) [rad] for poses that are known to be good, on the retargeter's device, float32.

        Args:
            local_TJ33: human poses (T, 21, 3, 3).
            target_TD3: their directions (`BodyMap.human_directions`), or others that shall be imitated in their place;
                needed for steps of optimisation. Networks that see directions see these.
            polish: as for `predict`.
        """
        features = self.network.features
        if target_TD3 is not None and isinstance(features, DirectionFeatures):
            q_TN = self.network.joints(features.of(target_TD3))
        else:
            q_TN = self.network(rotation.matrix_to_sixd(local_TJ33))
        if not polish or not len(q_TN) or target_TD3 is None:
            return q_TN
        return self._polish(q_TN, target_TD3, polish)

    def save(self, folder: Path, provenance: dict[str, str]) -> Path:
        """Writes the package; `provenance` (run, commit, checksums, measures) goes into the header."""
        folder.mkdir(parents=True, exist_ok=True)
        robot = self.body_map.robot
        with atomic_path(folder / _URDF) as temporary:
            shutil.copyfile(self.config.robot.urdf, temporary)
        self.prior.save(folder / _PRIOR)
        save_skeleton(folder / _SKELETON, self.body_map.skeleton)
        with atomic_path(folder / _CONFIG) as temporary:
            temporary.write_text(_portable(self.config))
        metadata = {
            "schema": SCHEMA,
            "robot": robot.name,
            "joint_names": json.dumps(robot.joint_names),
            "lower_rad": json.dumps(robot.lower_N.tolist()),
            "upper_rad": json.dumps(robot.upper_N.tolist()),
            "input": "SMPL body joints 1..21, local rotations, 6D (first two columns, column after column)",
            "seen": json.dumps(self.network.features.names),
            "output": "joint angles in rad, in the order of joint_names",
            "phi_threshold": repr(self.phi_threshold),
            "confidence": self.confidence.to_json(),
            **provenance,
            **file_checksums(folder, _OTHERS),
        }
        write_tensors(folder / _WEIGHTS, self.network.state_dict(), metadata)
        return folder

    @classmethod
    def load(cls, folder: Path | str) -> Retargeter:
        """Reads a package.

        Raises:
            UserError: the folder is no package, a file is missing or damaged, was edited or comes from another package,
                or weights and settings do not fit.
        """
        folder = Path(folder)
        if os.path.isfile(folder):
            raise UserError(f"{folder}: is a file; a package is a folder: name {folder.parent}")
        if not os.path.lexists(folder / _WEIGHTS):
            raise UserError(f"{folder}: is no package of a retargeter: {_WEIGHTS} is missing")
        tensors, metadata = read_tensors(folder / _WEIGHTS)
        if metadata.get("schema") != SCHEMA:
            raise UserError(f"{folder / _WEIGHTS}: schema is '{metadata.get('schema')}', expected '{SCHEMA}'")
        check_files(folder, _OTHERS, metadata)
        config = load_config(folder / _CONFIG, environment=False)
        body = config.body
        check_paths(folder, {_URDF: config.robot.urdf, _PRIOR: body.prior_path, _SKELETON: body.model_path})
        prior, body_map = open_prior(body), build_body_map(config.robot, build_skeleton(body))
        check_prior(folder, metadata, prior)
        network = build_network(config, body_map)
        threshold = check_content(folder, metadata, body_map.robot, network.features.names)
        try:
            network.load_state_dict({name: tensor for name, tensor in tensors.items() if tensor.is_floating_point()})
        except RuntimeError as error:
            said = shortened(" ".join(str(error).split()), 300)
            raise UserError(f"{folder}: weights and settings do not fit: {said}") from error
        check_weights(folder, network.state_dict(), body_map.robot)
        return cls(network, body_map, prior, config, threshold, check_confidence(folder, metadata))


def _portable(config: Config) -> str:
    """What loading needs of the config, as YAML whose only paths are the files beside it.

    How pairs were made and the network was trained is in the run (`run_id`); a package outlives changes of those keys.
    """
    config = copy.deepcopy(config)
    config.robot.urdf = Path(_URDF)
    config.body.prior_path, config.body.model_path, config.body.betas = Path(_PRIOR), Path(_SKELETON), []
    return to_yaml({"robot": config.robot, "body": config.body, "model": config.model})
