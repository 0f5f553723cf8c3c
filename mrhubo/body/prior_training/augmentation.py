"""What the training of the body prior adds to its data: motion that the data lacks, and noise to remove.

Legend: B batch, J = 21 joints.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body.prior_training.measures import turn_joints
from mrhubo.body.skeleton import POSED_JOINT_NAMES

_Triple = tuple[float, float, float]
_MISSING: dict[str, tuple[_Triple, _Triple]] = {
    "wrist": ((0.0, 16.0, 34.0), (0.0, 35.0, 75.0)),
    "collar": ((3.0, 7.0, 8.0), (8.0, 18.0, 18.0)),
    "foot": ((12.0, 0.0, 0.0), (35.0, 0.0, 0.0)),
    "ankle": ((6.0, 6.0, 6.0), (15.0, 15.0, 15.0)),
}
"""Joints that never move in the data, or do so in one performer's way: standard deviation and limit of added angles
about x, y, z [deg]."""

_READ = ("shoulder", "elbow", "wrist", "neck", "head")


def add_missing_motion(pose_BJ6: Tensor, share: float) -> Tensor:
    """Gives wrists, ankles, collars and toes plausible angles that the data lacks; each pair in a random share of the
    poses.

    What a collar is turned by, the shoulder is turned back, so that the arm keeps its direction, as when a person
    shrugs. Angles are normal, cut off inside the anatomical ranges.
    """
    local = {part: rotation.sixd_to_matrix(pose_BJ6[:, _pair(part)]) for part in (*_MISSING, "shoulder")}
    turns = {part: _random_turns(pose_BJ6, *spread, share) for part, spread in _MISSING.items()}
    changed = {part: local[part] @ turn for part, turn in turns.items()}
    changed["shoulder"] = turns["collar"].mT @ local["shoulder"]
    joints = torch.tensor([joint for part in changed for joint in _pair(part)], device=pose_BJ6.device)
    return pose_BJ6.index_copy(1, joints, rotation.matrix_to_sixd(torch.cat(list(changed.values()), dim=1)))


def _random_turns(pose_BJ6: Tensor, std_deg: _Triple, limit_deg: _Triple, share: float) -> Tensor:
    """Rotations (B, 2, 3, 3) of a left and a right joint; the identity for those poses that are not in the share."""
    std, limit = (torch.deg2rad(pose_BJ6.new_tensor(values)) for values in (std_deg, limit_deg))
    angle = (torch.randn(len(pose_BJ6), 2, 3, device=pose_BJ6.device) * std).clamp(-limit, limit)
    chosen = torch.rand(len(pose_BJ6), 1, 1, device=pose_BJ6.device) < share
    return rotation.axis_angle_to_matrix(angle * chosen)


def _pair(part: str) -> list[int]:
    return [POSED_JOINT_NAMES.index(f"{side}_{part}") for side in ("left", "right")]


def stand_at_rest(pose_BJ6: Tensor, share: float) -> Tensor:
    """Puts all but arms and head of a random share of the poses at rest; the arms keep their directions. So a robot
    with arms and a head reads a pose (`mrhubo.robot.alignment`).
    """
    rest = torch.zeros(len(POSED_JOINT_NAMES), dtype=torch.bool)
    rest[[i for i, name in enumerate(POSED_JOINT_NAMES) if not name.endswith(_READ)]] = True
    identity = pose_BJ6.new_tensor([1.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    collar, shoulder = (rotation.sixd_to_matrix(pose_BJ6[:, _pair(part)]) for part in ("collar", "shoulder"))
    found = torch.where(rest.to(pose_BJ6.device)[:, None], identity, pose_BJ6)
    found[:, _pair("shoulder")] = rotation.matrix_to_sixd(collar @ shoulder)
    chosen = torch.rand(len(pose_BJ6), 1, 1, device=pose_BJ6.device) < share
    return torch.where(chosen, found, pose_BJ6)


def add_noise(pose_BJ6: Tensor, share: float) -> Tensor:
    """Turns joints of a random share of the poses about random axes.

    Half of them at every joint, by up to 40 degrees, the same angle for all joints; the others at one joint, by up to
    120 degrees.
    """
    batch, device = len(pose_BJ6), pose_BJ6.device
    everywhere = torch.rand(batch, 1, device=device) * 40.0
    one = torch.nn.functional.one_hot(torch.randint(len(POSED_JOINT_NAMES), (batch,)), len(POSED_JOINT_NAMES))
    single = torch.rand(batch, 1, device=device) * 120.0 * one.to(device)
    angle = torch.where(torch.rand(batch, 1, device=device) < 0.5, everywhere, single)
    noisy = torch.rand(batch, device=device) < share
    turned = turn_joints(pose_BJ6[noisy], torch.deg2rad(angle[noisy]))
    return pose_BJ6.index_put((noisy.nonzero()[:, 0],), turned)
