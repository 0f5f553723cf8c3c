"""A retargeter's package on disk: weights, URDF, settings, joint names, limits, units."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Mapping
from pathlib import Path

from mrhubo.body import BodyPrior, build_skeleton, open_prior, save_skeleton
from mrhubo.config import Config, load_config, to_yaml
from mrhubo.errors import UserError, shortened
from mrhubo.files.atomic import atomic_path, checksum_file
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.retargeter.architecture import build_network
from mrhubo.retargeter.confidence import ConfidenceModel
from mrhubo.retargeter.integrity import (
    check_confidence,
    check_content,
    check_files,
    check_paths,
    check_prior,
    check_weights,
    file_checksums,
)
from mrhubo.retargeter.networks import JointNetwork
from mrhubo.robot import BodyMap, Robot, build_body_map
from mrhubo.robot.solid_urdf import urdf_without_meshes

SCHEMA = "mrhubo.retargeter/6"
_ONE_WIDTH = "mrhubo.retargeter/5"
"""As now, but for the networks of small branches, which are as wide as all others."""
_WEIGHTS, _URDF, _CONFIG, _PRIOR = "retargeter.safetensors", "robot.urdf", "config.yaml", "body_prior.safetensors"
_SKELETON = "skeleton.safetensors"
_OTHERS = (_URDF, _CONFIG, _PRIOR, _SKELETON)
"""Files beside the weights."""


def write_package(
    folder: Path,
    network: JointNetwork,
    body_map: BodyMap,
    prior: BodyPrior,
    config: Config,
    settings: Mapping[str, str],
) -> Path:
    """Writes a package; `settings` go into the header."""
    folder.mkdir(parents=True, exist_ok=True)
    robot = body_map.robot
    with atomic_path(folder / _URDF) as temporary:
        meshes = robot.description.solids.of_meshes  # their files stay where they are
        temporary.write_bytes(urdf_without_meshes(robot.description) if meshes else robot.description.text)
    prior.save(folder / _PRIOR)
    save_skeleton(folder / _SKELETON, body_map.skeleton)
    with atomic_path(folder / _CONFIG) as temporary:
        temporary.write_text(_portable(config), encoding="utf-8")
    metadata = {
        "schema": SCHEMA,
        "robot": robot.name,
        "joint_names": json.dumps(robot.joint_names),
        "lower_rad": json.dumps(robot.lower_N.tolist()),
        "upper_rad": json.dumps(robot.upper_N.tolist()),
        "input": "SMPL body joints 1..21, local rotations, 6D (first two columns, column after column)",
        "seen": json.dumps(network.features.names),
        "output": "joint angles in rad, in the order of joint_names",
        **settings,
        **file_checksums(folder, _OTHERS),
    }
    write_tensors(folder / _WEIGHTS, network.state_dict(), metadata)
    return folder


def package_checksum(folder: Path) -> str:
    """xxh3 of the weights' file, 16 hex digits; its header has the checksums of all other files.

    Raises:
        UserError: it is missing.
    """
    return checksum_file(folder / _WEIGHTS)


def read_package(folder: Path) -> tuple[JointNetwork, BodyMap, BodyPrior, Config, float, ConfidenceModel]:
    """What a retargeter is made of.

    Raises:
        UserError: the folder is no package, a file is missing or damaged, was edited or comes from another package,
            or weights and settings do not fit.
    """
    if os.path.isfile(folder):
        raise UserError(f"{folder}: is a file; a package is a folder: name {folder.parent}")
    if not os.path.lexists(folder / _WEIGHTS):
        raise UserError(f"{folder}: is no package of a retargeter: {_WEIGHTS} is missing")
    tensors, metadata = read_tensors(folder / _WEIGHTS)
    if metadata.get("schema") not in (SCHEMA, _ONE_WIDTH):
        raise UserError(f"{folder / _WEIGHTS}: schema is '{metadata.get('schema')}', expected '{SCHEMA}'")
    check_files(folder, _OTHERS, metadata)
    config = _read_config(folder)
    if metadata["schema"] == _ONE_WIDTH:
        config.model.small_hidden = config.model.hidden
    body = config.body
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
    return network, body_map, prior, config, threshold, check_confidence(folder, metadata)


def read_package_robot(folder: Path) -> Robot:
    """The robot of a package alone.

    Raises:
        UserError: its config or its URDF is missing, or cannot be used.
    """
    return build_body_map(_read_config(folder).robot).robot


def _read_config(folder: Path) -> Config:
    """The config, whose only paths are those of the package's own files."""
    config = load_config(folder / _CONFIG, environment=False)
    body = config.body
    check_paths(folder, {_URDF: config.robot.urdf, _PRIOR: body.prior_path, _SKELETON: body.model_path})
    return config


def _portable(config: Config) -> str:
    """What loading needs of the config, as YAML whose only paths are the files beside it.

    How pairs were made and the network was trained is in the run (`run_id`); a package outlives changes of those keys.
    """
    config = copy.deepcopy(config)
    config.robot.urdf = Path(_URDF)
    config.body.prior_path, config.body.model_path, config.body.betas = Path(_PRIOR), Path(_SKELETON), []
    return to_yaml({"robot": config.robot, "body": config.body, "model": config.model})
