"""The robot's bodies, its directions and their Jacobian (`mrhubo.reference.jacobian`).

Everything is in the base frame: a direction that is seen from a part turns with it, so squares of differences are the
same there, and the Jacobian needs no turning.

Legend: B frames, A driven joints, L = A + 1 bodies, D directions, N joints, Q pairs of a direction and a joint.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.fast.plain.human import cross, norm, rodrigues
from mrhubo.fast.sections import Kinematics


@dataclass(frozen=True)
class Placed:
    """A robot's bodies and directions, base frame."""

    rotation_BL33: np.ndarray
    position_BL3: np.ndarray
    start_BD3: np.ndarray
    """Where limbs start [m]; 0 for axes, which are like limbs of length 1."""
    end_BD3: np.ndarray
    view_BV33: np.ndarray
    """Columns are left, up and forward of the parts that directions are seen from."""
    direction_BD3: np.ndarray
    """Unit directions."""
    length_BD: np.ndarray


def place(kinematics: Kinematics, q_BN: np.ndarray) -> Placed:
    """Bodies and directions at joint angles (B, N) [rad]."""
    batch, joints = len(q_BN), len(kinematics.parent_A)
    angle_BA = q_BN[:, kinematics.column_A] * kinematics.ratio_A + kinematics.offset_A
    turn_BA33 = rodrigues(kinematics.axis_A3, np.sin(angle_BA), np.cos(angle_BA))
    turn_BA33[:, kinematics.rotary_A == 0] = np.eye(3)
    slide_BA = np.where(kinematics.rotary_A > 0, 0.0, angle_BA)
    rotation_A33, position_A3 = kinematics.origin_A34[..., :3], kinematics.origin_A34[..., 3]
    inner_BA33 = rotation_A33 @ turn_BA33
    inner_BA3 = position_A3 + slide_BA[..., None] * (rotation_A33 @ kinematics.axis_A3[..., None])[..., 0]
    rotation_BL33, position_BL3 = np.empty((batch, joints + 1, 3, 3)), np.zeros((batch, joints + 1, 3))
    rotation_BL33[:, 0] = np.eye(3)
    for joint, parent in enumerate(kinematics.parent_A):
        above_B33 = rotation_BL33[:, parent]
        rotation_BL33[:, joint + 1] = above_B33 @ inner_BA33[:, joint]
        position_BL3[:, joint + 1] = position_BL3[:, parent] + (above_B33 @ inner_BA3[:, joint, :, None])[..., 0]
    limb_D1 = kinematics.limb_D[:, None]
    start_BD3, end_BD3 = (
        (rotation_BL33[:, body_D] @ point_D3[..., None])[..., 0] + position_BL3[:, body_D] * limb_D1
        for body_D, point_D3 in (
            (kinematics.start_body_D, kinematics.start_D3),
            (kinematics.end_body_D, kinematics.end_D3),
        )
    )
    view_BV33 = rotation_BL33[:, kinematics.view_body_V] @ kinematics.view_V33
    along_BD3 = end_BD3 - start_BD3
    length_BD = norm(along_BD3)
    direction_BD3 = along_BD3 / length_BD[..., None]
    return Placed(rotation_BL33, position_BL3, start_BD3, end_BD3, view_BV33, direction_BD3, length_BD)


def jacobian(kinematics: Kinematics, placed: Placed, joints: int) -> np.ndarray:
    """How directions, as they are seen from their parts, change (B, D, N, 3) [1/rad], in the base frame's axes; N is
    `joints`.
    """
    axis_BA3 = (placed.rotation_BL33[:, 1:] @ kinematics.axis_A3[..., None])[..., 0]
    d, a, n = kinematics.direction_Q, kinematics.joint_Q, kinematics.column_Q
    end_Q1, start_Q1, bend_Q1, slide_Q1 = kinematics.factor_Q4.T[..., None]
    axis_BQ3 = axis_BA3[:, a]
    lever_BQ3 = placed.end_BD3[:, d] * end_Q1 - placed.start_BD3[:, d] * start_Q1
    lever_BQ3 -= placed.position_BL3[:, 1:][:, a] * bend_Q1
    moved_BQ3 = cross(axis_BQ3, lever_BQ3) + axis_BQ3 * slide_Q1
    along_BQ3 = placed.direction_BD3[:, d]
    moved_BQ3 -= along_BQ3 * (along_BQ3 * moved_BQ3).sum(-1, keepdims=True)
    moved_BQ3 /= placed.length_BD[:, d, None]
    # A joint that others mimic has several pairs for one entry, which are added.
    entries_XQ = np.zeros((len(kinematics.limb_D) * joints, len(d)))
    entries_XQ[d * joints + n, np.arange(len(d))] = 1.0
    return (entries_XQ @ moved_BQ3).reshape(len(axis_BA3), -1, joints, 3)


def seen(kinematics_view_D: np.ndarray, view_BV33: np.ndarray, vector_BD3: np.ndarray) -> np.ndarray:
    """Vectors (B, D, 3) of the base frame in the axes of the parts that see them."""
    return (vector_BD3[:, :, None] @ view_BV33[:, kinematics_view_D])[:, :, 0]


def unseen(kinematics_view_D: np.ndarray, view_BV33: np.ndarray, vector_BD3: np.ndarray) -> np.ndarray:
    """The other way: of the parts' axes, in the base frame."""
    return (view_BV33[:, kinematics_view_D] @ vector_BD3[..., None])[..., 0]
