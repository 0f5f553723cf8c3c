"""Anatomical ranges of motion of the 21 posed joints, and by how much a pose leaves them.

Every joint's rotation is split into a twist about the joint's own axis (a hinge's axis, or the bone) and a swing of the
other two axes: R = twist . swing. Angles are those of a left joint; right ones are mirrored first.

Sources: American Academy of Orthopaedic Surgeons, "Joint Motion: Method of Measuring and Recording" (1965), for the
ranges; widened by 10 to 15 degrees, because one generic skeleton stands for all people and SMPL's rest pose is not the
anatomical zero, and, for shoulder, hip and spine, which move together with collars and pelvis, by what athletes do.

The shoulder's swings are about oblique axes: the ranges were set for an arm that is turned about itself by 29 degrees
more than SMPL's (`arm_axes`).

Legend: B batch, J = 21 joints; the three angles are (twist, first swing, second swing).
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body.joints import ELBOW_AXIS, PAIRED_JOINTS, POSED_JOINT_NAMES, SIDE_OF, SIDES

_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

# part: (twist axis, range), (swing axis, range), (swing axis, range); degrees, left side.
_Entry = tuple[tuple[float, float, float], tuple[float, float]]
_SPINE: tuple[_Entry, _Entry, _Entry] = ((_Y, (-25, 25)), (_X, (-30, 40)), (_Z, (-25, 25)))
_RANGES: dict[str, tuple[_Entry, _Entry, _Entry]] = {
    "hip": ((_Y, (-60, 60)), (_X, (-140, 45)), (_Z, (-40, 70))),
    "knee": ((_X, (-10, 160)), (_Y, (-25, 25)), (_Z, (-25, 25))),
    "ankle": ((_X, (-70, 50)), (_Y, (-45, 50)), (_Z, (-45, 45))),
    "foot": ((_X, (-45, 45)), (_Y, (-15, 15)), (_Z, (-15, 15))),
    "spine1": _SPINE,
    "spine2": _SPINE,
    "spine3": _SPINE,
    "neck": ((_Y, (-50, 50)), (_X, (-45, 45)), (_Z, (-40, 40))),
    "head": ((_Y, (-60, 60)), (_X, (-60, 80)), (_Z, (-60, 60))),
    "collar": ((_X, (-30, 30)), (_Y, (-30, 30)), (_Z, (-20, 45))),
    "shoulder": ((_X, (-140, 80)), ((0.0, 0.871, 0.491), (-140, 65)), ((0.0, -0.491, 0.871), (-115, 105))),
    "elbow": ((ELBOW_AXIS, (-10, 160)), (_X, (-25, 25)), (_Z, (-25, 25))),
    "wrist": ((_X, (-80, 140)), (_Y, (-45, 45)), (_Z, (-90, 90))),
}


def _table() -> tuple[Tensor, Tensor]:
    """Axes (21, 3, 3), one per row, and limits (21, 3, 2) [rad] of every joint as if it were on the left."""
    axes, limits = [], []
    ranges = _RANGES | {f"{side}_{name}": _RANGES[name] for side in SIDES for name in PAIRED_JOINTS}
    for name in POSED_JOINT_NAMES:
        entries = ranges[name]
        axes.append([axis for axis, _ in entries])
        limits.append([limit for _, limit in entries])
    return torch.nn.functional.normalize(torch.tensor(axes), dim=-1), torch.deg2rad(torch.tensor(limits))


AXES_J33, LIMITS_J32 = _table()
RIGHT = torch.tensor([SIDE_OF.get(name) == "right" for name in POSED_JOINT_NAMES])


def joint_angles(matrix_BJ33: Tensor) -> Tensor:
    """Twist and two swings (B, 21, 3) [rad] of local rotations (B, 21, 3, 3), as of left joints."""
    axes = AXES_J33.to(matrix_BJ33)
    mirrored = matrix_BJ33.new_tensor([1.0, -1.0, -1.0])
    sign = torch.where(RIGHT.to(matrix_BJ33.device)[:, None], mirrored, torch.ones_like(mirrored))
    quaternion = rotation.matrix_to_quaternion(matrix_BJ33)
    quaternion = quaternion * torch.where(quaternion[..., 3:] < 0, -1.0, 1.0)
    vector, scalar = quaternion[..., :3] * sign, quaternion[..., 3]
    along = (vector * axes[:, 0]).sum(-1)
    # A half turn about another axis leaves the twist open: 0 / 0, whose derivative would be NaN.
    twist = torch.atan2(along, torch.where(scalar.abs() + along.abs() > 1e-6, scalar, torch.ones_like(scalar)))
    half = axes[:, 0] * torch.sin(twist)[..., None]
    cosine = torch.cos(twist)
    swing_scalar = cosine * scalar + (half * vector).sum(-1)
    swing = cosine[..., None] * vector - scalar[..., None] * half - torch.linalg.cross(half, vector)
    sine = (swing.square().sum(-1) + 1e-12).sqrt()
    swing = swing * (2 * torch.atan2(sine, swing_scalar) / sine)[..., None]
    return torch.stack((2 * twist, (swing * axes[:, 1]).sum(-1), (swing * axes[:, 2]).sum(-1)), dim=-1)


def excess(matrix_BJ33: Tensor, margin: float = 0.0) -> Tensor:
    """By how much each angle (B, 21, 3) [rad] of local rotations (B, 21, 3, 3) leaves its range; 0 inside.

    The ranges are `margin` [rad] narrower at both ends.
    """
    angles, limits = joint_angles(matrix_BJ33), LIMITS_J32.to(matrix_BJ33)
    return torch.relu(angles - limits[..., 1] + margin) + torch.relu(limits[..., 0] + margin - angles)


def random_rotations(joint: int, count: int, generator: torch.Generator) -> Tensor:
    """Local rotations (count, 3, 3) of one joint (its position in POSED_JOINT_NAMES), twist and swings uniform in their
    ranges.
    """
    lower_3, upper_3 = LIMITS_J32[joint].T
    angle_B3 = lower_3 + (upper_3 - lower_3) * torch.rand(count, 3, generator=generator)
    axis_33 = AXES_J33[joint] * (torch.tensor([1.0, -1.0, -1.0]) if RIGHT[joint] else 1.0)
    twist_B33, swing_B33 = (
        rotation.axis_angle_to_matrix(angle_B3[:, part] @ axis_33[part]) for part in (slice(0, 1), slice(1, 3))
    )
    return twist_B33 @ swing_B33


def inside(pose_BJ6: Tensor) -> Tensor:
    """Whether every joint of each pose (B, 21, 6) is inside its ranges: (B,) of bool."""
    return (excess(rotation.sixd_to_matrix(pose_BJ6)) <= 0).flatten(1).all(dim=1)
