"""The networks that a robot and a config's `model` section ask for."""

from __future__ import annotations

from collections.abc import Sequence

from mrhubo.config import Config, ModelConfig
from mrhubo.errors import UserError
from mrhubo.reference import DirectionJacobian
from mrhubo.retargeter.features import DirectionFeatures, PoseFeatures, RotationFeatures
from mrhubo.retargeter.networks import Branch, JointNetwork, RetargetNetwork
from mrhubo.retargeter.universal import UniversalJoints
from mrhubo.robot import BodyMap, Robot
from mrhubo.universal.weights import open_network

_MAX_WEIGHTS = 100_000_000
"""Weights of all networks together; training takes sixteen bytes for each. The defaults make some hundred thousand."""
_FEW_JOINTS = 3
"""Of a branch whose networks are `model.small_hidden` wide: few weights learn two directions, as a head has."""


def build_network(config: Config, body_map: BodyMap) -> JointNetwork:
    """An untrained network for a config's robot and `model` section; with `start: universal`, one with the weights that
    come with mrhubo.

    Raises:
        UserError: an input joint does not exist or is named for networks that see no joints, or a branch would see
            none.
    """
    if config.model.start == "universal":
        return UniversalJoints(body_map, open_network())
    model, robot, blocks = config.model, body_map.robot, DirectionJacobian(body_map).blocks
    turned = sorted(direction for directions, _ in blocks for direction in directions)
    features: PoseFeatures
    if model.input_frame == "local":
        features = RotationFeatures(model.input_joints or body_map.input_joints(turned))
        own = [body_map.input_joints(directions) for directions, _ in blocks]
    elif model.input_joints is not None:
        raise UserError(
            f"model.input_joints: is of no use with model.input_frame={model.input_frame}, which reads directions of"
            " body parts; leave it out, or set model.input_frame=local"
        )
    else:
        features = DirectionFeatures(body_map, [sorted(directions) for directions, _ in blocks])
        own = [tuple(body_map.direction_names[i] for i in sorted(directions)) for directions, _ in blocks]
    if model.branches:
        branches = _branches(model, robot, [joints for _, joints in blocks], own, features.names)
    else:
        everything = tuple(range(len(features.names))), tuple(range(len(robot.joint_names)))
        branches = [Branch(*everything, model.hidden)]
    _check_size(model, features, branches)
    settings = model.stages, model.layers, model.bound_output, model.residual
    return RetargetNetwork(features, robot.lower_N, robot.upper_N, branches, *settings)


def _check_size(model: ModelConfig, features: PoseFeatures, branches: Sequence[Branch]) -> None:
    """Refuses networks of more weights than a memory holds, before they are made."""
    weights = 0
    for branch in branches:
        inputs, joints = len(features.columns(branch.inputs)), len(branch.joints)
        links = 6 * joints
        sizes = [(inputs, links), (links, joints)] if model.stages == 2 else [(inputs, joints)]
        for size_in, size_out in sizes:
            inner = (model.layers - 1) * branch.hidden * (branch.hidden + 1)
            weights += (size_in + 1) * branch.hidden + inner + (branch.hidden + 1) * size_out
    if weights > _MAX_WEIGHTS:
        raise UserError(
            f"model.hidden: {model.hidden:,} units in each of {model.layers} layers make {weights:,} weights in all; at"
            f" most {_MAX_WEIGHTS:,} are trained"
        )


def _branches(
    model: ModelConfig,
    robot: Robot,
    blocks: Sequence[set[int]],
    own: Sequence[Sequence[str]],
    inputs: Sequence[str],
) -> list[Branch]:
    """Of each branch its joints and its inputs, and how wide its networks are; an input that belongs to no branch is
    seen by all.

    Args:
        model: for the widths.
        robot: for the names of its joints.
        blocks: the joints of each branch.
        own: the inputs that tell about each branch.
        inputs: those that there are.
    """
    shared = set(inputs).difference(*own)
    found = []
    for names, joints in zip(own, blocks, strict=True):
        seen = tuple(i for i, name in enumerate(inputs) if name in names or name in shared)
        if not seen:
            moved = ", ".join(robot.joint_names[n] for n in sorted(joints))
            raise UserError(
                f"model.input_joints: nothing tells the angles of {moved}; add one of {', '.join(names)}, or set"
                " model.branches to false"
            )
        hidden = min(model.hidden, model.small_hidden) if len(joints) <= _FEW_JOINTS else model.hidden
        found.append(Branch(seen, tuple(sorted(joints)), hidden))
    return found
