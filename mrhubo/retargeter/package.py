"""The trained retargeter as a folder that carries all it needs: weights, URDF, settings, joint names, limits, units.

    retargeter = Retargeter.load("package")
    q_TN = retargeter.predict(pose_TJ6)             # the two networks alone, microseconds a frame
    result = retargeter.retarget(pose_TJ6)          # and a step of optimisation, with a confidence for each frame

Legend: T frames, J = 21 human joints, N robot joints, D directions.
"""

from __future__ import annotations

import copy
import functools
import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body import BodyPrior, build_skeleton, open_prior, save_skeleton
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import Config, load_config, to_yaml
from mrhubo.errors import UserError
from mrhubo.files.storage import atomic_path, read_tensors, write_tensors
from mrhubo.reference import DirectionJacobian, DirectionProblem, direction_error
from mrhubo.retargeter.features import PoseFeatures
from mrhubo.retargeter.networks import Branch, RetargetNetwork
from mrhubo.robot import BodyMap, SelfCollision, build_body_map

SCHEMA = "mrhubo.retargeter/3"
_WEIGHTS, _URDF, _CONFIG, _PRIOR = "retargeter.safetensors", "robot.urdf", "config.yaml", "body_prior.safetensors"
_SKELETON = "skeleton.safetensors"
_AGREEMENT_DEG = 20.0
POLISH = 1
"""Steps of optimisation that `retarget` makes after the networks, unless told otherwise."""


@dataclass(frozen=True)
class RetargetResult:
    """Joint angles and how far to trust them."""

    q_TN: Tensor
    """Joint angles [rad], inside the limits."""
    confidence_T: Tensor
    """0..1: plausibility of the human pose times agreement of the robot's limbs with the human's."""
    direction_error_deg_TD: Tensor
    """Angle [deg] between the robot's and the human's limb, hand and head directions."""
    phi_T: Tensor
    """Reconstruction error of the human pose under the body prior."""
    collision_T: Tensor
    """Whether the robot touches itself (T,), by its URDF's collision shapes; the networks do not avoid it."""


def build_network(config: Config, body_map: BodyMap) -> RetargetNetwork:
    """An untrained network for a config's robot and `model` section.

    Raises:
        UserError: an input joint does not exist, or a branch would see none.
    """
    model, robot, blocks = config.model, body_map.robot, DirectionJacobian(body_map).blocks
    turned = [direction for directions, _ in blocks for direction in directions]
    features = PoseFeatures(model.input_joints or body_map.input_joints(turned), model.input_frame)
    return RetargetNetwork(
        features,
        robot.lower_N,
        robot.upper_N,
        model.stages,
        model.hidden,
        model.layers,
        model.bound_output,
        model.residual,
        _branches(body_map, blocks, features.input_joints) if model.branches else (),
    )


def _branches(body_map: BodyMap, blocks: Sequence[tuple[set[int], set[int]]], inputs: Sequence[str]) -> list[Branch]:
    """Of each branch its joints and its human joints; a human joint that belongs to no branch is seen by all."""
    own = [body_map.input_joints(directions) for directions, _ in blocks]
    shared = set(inputs).difference(*own)
    found = []
    for names, (_, joints) in zip(own, blocks, strict=True):
        seen = tuple(i for i, name in enumerate(inputs) if name in names or name in shared)
        if not seen:
            moved = ", ".join(body_map.robot.joint_names[n] for n in sorted(joints))
            raise UserError(
                f"model.input_joints: nothing tells the angles of {moved}; add one of {', '.join(names)}, or set"
                " model.branches to false"
            )
        found.append(Branch(seen, tuple(sorted(joints))))
    return found


class Retargeter:
    """A trained network with its robot; on the CPU unless `to` moves it."""

    def __init__(
        self, network: RetargetNetwork, body_map: BodyMap, prior: BodyPrior, config: Config, phi_threshold: float
    ) -> None:
        self.network = network.requires_grad_(False).eval()
        self.body_map, self.prior, self.config, self.phi_threshold = body_map, prior, config, phi_threshold

    @property
    def collision(self) -> SelfCollision:
        """The robot's collision shapes."""
        return self.body_map.collision

    @functools.cached_property
    def directions(self) -> DirectionProblem:
        """The reference retargeter's cost."""
        return DirectionProblem(self.body_map)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints of the output, in order."""
        return self.body_map.robot.joint_names

    @torch.no_grad()
    def predict(self, pose_TJ6: Tensor, polish: int = 0) -> Tensor:
        """Joint angles (T, N) [rad] of human poses (T, 21, 6); inside the limits.

        Args:
            pose_TJ6: human poses, 6D.
            polish: Levenberg-Marquardt steps of the reference retargeter from the networks' answer, each frame on its
                own; a step that does not bring the limbs nearer to the human's is not taken. 0: the networks alone.

        Raises:
            UserError: the poses have another shape, or hold NaN or infinite numbers; `polish` is negative.
        """
        if polish < 0:
            raise UserError(f"polish must be 0 or more steps, found {polish}")
        if pose_TJ6.ndim != 3 or pose_TJ6.shape[1:] != (len(POSED_JOINT_NAMES), 6):
            raise UserError(f"human poses must have the shape (frames, 21, 6), found {tuple(pose_TJ6.shape)}")
        finite = torch.isfinite(pose_TJ6).all(dim=2).all(dim=1)
        if not bool(finite.all()):
            raise UserError(f"human pose {int((~finite).nonzero()[0, 0])} holds NaN or infinite numbers")
        q_TN = self.network(pose_TJ6.float())
        if not polish or not len(q_TN):
            return q_TN
        target_TD3 = self.body_map.human_directions(pose_TJ6.float())
        return self.directions.minimise(q_TN, target_TD3, steps=polish)[0]

    @torch.no_grad()
    def retarget(self, pose_TJ6: Tensor, polish: int = POLISH) -> RetargetResult:
        """Joint angles, by default after a step of optimisation, with a confidence for each frame; arguments as for
        `predict`.
        """
        q_TN = self.predict(pose_TJ6, polish)
        pose_TJ6 = pose_TJ6.float()
        poses = self.body_map.robot.forward(q_TN)
        error_TD = direction_error(self.body_map, q_TN, pose_TJ6, poses)
        phi_T = self.prior.reconstruction_error(rotation.matrix_to_sixd(rotation.sixd_to_matrix(pose_TJ6)))
        plausible = (self.phi_threshold / phi_T.clamp_min(1e-12)).clamp(max=1.0)
        agreement = torch.exp(-(error_TD.mean(dim=1) / _AGREEMENT_DEG).square())
        return RetargetResult(q_TN, plausible * agreement, error_TD, phi_T, self.collision.collides(q_TN, poses))

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
            "input_joints": json.dumps(self.network.features.input_joints),
            "output": "joint angles in rad, in the order of joint_names",
            "phi_threshold": repr(self.phi_threshold),
            **provenance,
        }
        write_tensors(folder / _WEIGHTS, self.network.state_dict(), metadata)
        return folder

    @classmethod
    def load(cls, folder: Path | str) -> Retargeter:
        """Reads a package.

        Raises:
            UserError: the folder is no package, a file is missing or damaged, or weights and settings do not fit.
        """
        folder = Path(folder)
        if not (folder / _WEIGHTS).is_file():
            raise UserError(f"{folder}: is no package of a retargeter: {_WEIGHTS} is missing")
        tensors, metadata = read_tensors(folder / _WEIGHTS)
        if metadata.get("schema") != SCHEMA:
            raise UserError(f"{folder / _WEIGHTS}: schema is '{metadata.get('schema')}', expected '{SCHEMA}'")
        config = load_config(folder / _CONFIG)
        prior, body_map = open_prior(config.body), build_body_map(config.robot, build_skeleton(config.body))
        network = build_network(config, body_map)
        try:
            network.load_state_dict(tensors)
            threshold = float(metadata["phi_threshold"])
        except (RuntimeError, KeyError, ValueError) as error:
            raise UserError(f"{folder}: weights and settings do not fit: {error}") from error
        return cls(network, body_map, prior, config, threshold)


def _portable(config: Config) -> str:
    """What loading needs of the config, as YAML whose only paths are the files beside it.

    How pairs were made and the network was trained is in the run (`run_id`); a package outlives changes of those keys.
    """
    config = copy.deepcopy(config)
    config.robot.urdf = Path(_URDF)
    config.body.prior_path, config.body.model_path, config.body.betas = Path(_PRIOR), Path(_SKELETON), []
    return to_yaml({"robot": config.robot, "body": config.body, "model": config.model})
