"""The networks that a robot and a config's `model` section ask for."""

from __future__ import annotations

from collections.abc import Sequence

from mrhubo.config import Config, ModelConfig
from mrhubo.errors import UserError
from mrhubo.reference import DirectionJacobian
from mrhubo.retargeter.features import PoseFeatures
from mrhubo.retargeter.networks import Branch, RetargetNetwork
from mrhubo.robot import BodyMap

_MAX_WEIGHTS = 100_000_000
"""Weights of all networks together; training takes sixteen bytes for each. The defaults make some hundred thousand."""


def build_network(config: Config, body_map: BodyMap) -> RetargetNetwork:
    """An untrained network for a config's robot and `model` section.

    Raises:
        UserError: an input joint does not exist, or a branch would see none.
    """
    model, robot, blocks = config.model, body_map.robot, DirectionJacobian(body_map).blocks
    turned = [direction for directions, _ in blocks for direction in directions]
    features = PoseFeatures(model.input_joints or body_map.input_joints(turned), model.input_frame)
    joints = tuple(range(len(robot.joint_names)))
    branches = _branches(body_map, blocks, features.input_joints) if model.branches else []
    _check_size(model, branches or [Branch(tuple(range(features.size // 6)), joints)])
    return RetargetNetwork(
        features,
        robot.lower_N,
        robot.upper_N,
        model.stages,
        model.hidden,
        model.layers,
        model.bound_output,
        model.residual,
        branches,
    )


def _check_size(model: ModelConfig, branches: Sequence[Branch]) -> None:
    """Refuses networks of more weights than a memory holds, before they are made."""
    weights = 0
    for branch in branches:
        inputs, links, joints = 6 * len(branch.inputs), 6 * len(branch.joints), len(branch.joints)
        sizes = [(inputs, links), (links, joints)] if model.stages == 2 else [(inputs, joints)]
        for size_in, size_out in sizes:
            inner = (model.layers - 1) * model.hidden * (model.hidden + 1)
            weights += (size_in + 1) * model.hidden + inner + (model.hidden + 1) * size_out
    if weights > _MAX_WEIGHTS:
        raise UserError(
            f"model.hidden: {model.hidden:,} units in each of {model.layers} layers make {weights:,} weights in all; at"
            f" most {_MAX_WEIGHTS:,} are trained"
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
