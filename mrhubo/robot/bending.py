"""Bend axes: about which axis an elbow bends, on a human and on a robot.

A straight arm leaves open how it is turned about itself, and a robot's elbow with it. The human's own arm knows: its
upper arm is turned one way or the other. Where the elbow is bent, the plane of the two limbs tells the same, whatever a
file makes of the upper arm's turn, so that alone counts there.

Legend: B batch, N robot joints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import torch
from torch import Tensor
from torch.nn.functional import normalize

from mrhubo.fast.plain.human import NEEDED_DEG, PLANE_DEG
from mrhubo.robot.keypoints import Keypoints
from mrhubo.robot.parts import BendPart, LimbPart

if TYPE_CHECKING:
    from mrhubo.robot.model import Robot

_PROBES, _SEED, _TURN = 64, 0, 1e-3
_HINGE = 0.7
"""How much of a hinge's turn the bend changes by: 1 on a human; less where limbs are not at right angles to it."""
_OTHERS = 0.3
"""The same of every other joint: more, and no single joint bends the limb."""


@dataclass(frozen=True)
class BendAxis:
    """A robot's hinge, fixed to a link."""

    part: BendPart
    link: str
    axis_3: Tensor
    """In the link's frame; turning about it by a positive angle bends the joint."""

    @property
    def name(self) -> str:
        """The direction's name."""
        return self.part.name


def _rising(bend_X: Tensor, ends_deg: tuple[float, float]) -> Tensor:
    """0 up to the first angle, 1 from the second on, smooth between."""
    low, high = map(math.radians, ends_deg)
    return smooth_share((bend_X - low) / (high - low))


def smooth_share(share_X: Tensor) -> Tensor:
    """As `mrhubo.fast.plain.human.smooth_share`."""
    share_X = share_X.clamp(0.0, 1.0)
    return share_X.square() * (3 - 2 * share_X)


def bend_axis(upper_X3: Tensor, lower_X3: Tensor, own_X3: Tensor) -> tuple[Tensor, Tensor]:
    """About which axis a limb bends, and how much that counts.

    Args:
        upper_X3: unit directions (..., 3) of the carrying limbs.
        lower_X3: those of the limbs that bend.
        own_X3: where the carrying limbs have their axes, by their own turn.

    Returns:
        Axes (..., 3) at right angles to the carrying limb, of length 1, but shorter where plane and own turn contradict
        each other (an elbow bent backwards by a few degrees), and 0 where neither tells; and how much each is needed
        (...), 1 at a straight joint, 0 at a bent one.
    """
    cross_X3 = torch.linalg.cross(upper_X3, lower_X3)
    bend_X = torch.atan2(cross_X3.norm(dim=-1), (upper_X3 * lower_X3).sum(-1))
    plane_X1 = _rising(bend_X, PLANE_DEG)[..., None]
    own_X3 = own_X3 - upper_X3 * (upper_X3 * own_X3).sum(-1, keepdim=True)
    axis_X3 = plane_X1 * normalize(cross_X3, dim=-1) + (1 - plane_X1) * normalize(own_X3, dim=-1)
    return axis_X3, 1 - _rising(bend_X, NEEDED_DEG)


@torch.no_grad()
def find_bend_axes(robot: Robot, keypoints: Keypoints) -> list[BendAxis]:
    """The hinges of the robot's limbs: of each the one joint that changes the bend, found by turning every joint a
    little in random poses. Limbs that several joints bend have none, and neither have those that nothing bends.
    """
    parts = [part for part in keypoints.parts if isinstance(part, BendPart)]
    if not parts:
        return []
    joints = len(robot.joint_names)
    q_BN = robot.sample(_PROBES, torch.Generator().manual_seed(_SEED)).to(robot.lower_N)
    turned_XN = (q_BN[:, None] + _TURN * torch.eye(joints).to(q_BN)).flatten(0, 1)
    poses = robot.forward(torch.cat((q_BN, turned_XN)))
    found = []
    for part in parts:
        limbs = [limb for limb in keypoints.parts if isinstance(limb, LimbPart)]
        upper, lower = (next(limb for limb in limbs if limb.name == name) for name in part.limbs)
        directions = []
        for limb in (upper, lower):
            ends = [keypoints.points[name] for name in (limb.start, limb.end)]
            rows = [robot.link_index(point.link) for point in ends]
            start_X3, end_X3 = (
                poses.position_BL3[:, row] + poses.rotation_BL33[:, row] @ q_BN.new_tensor(point.offset_3)
                for row, point in zip(rows, ends, strict=True)
            )
            directions.append(normalize(end_X3 - start_X3, dim=-1))
        cross_X3 = torch.linalg.cross(*directions)
        bend_X = torch.atan2(cross_X3.norm(dim=-1), (directions[0] * directions[1]).sum(-1))
        slope_BN = (bend_X[_PROBES:].unflatten(0, (_PROBES, joints)) - bend_X[:_PROBES, None]) / _TURN
        slope_N = slope_BN.abs().median(dim=0).values
        hinge = int(slope_N.argmax())
        others_N = torch.cat((slope_N[:hinge], slope_N[hinge + 1 :]))
        if slope_N[hinge] < _HINGE or bool((others_N > _OTHERS).any()):
            continue
        joint = robot.description.joints[robot.joint_names[hinge]]
        axis_3 = torch.tensor(joint.axis_3.tolist())
        turned_X3 = poses.rotation_BL33[:_PROBES, robot.link_index(joint.child)] @ axis_3.to(q_BN)
        side = torch.sign((turned_X3 * cross_X3[:_PROBES]).sum())
        found.append(BendAxis(part, joint.child, axis_3 * side.cpu()))
    return found
