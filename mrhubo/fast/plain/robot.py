"""The robot's bodies, its directions and their Jacobian (`mrhubo.reference.jacobian`).

Everything is in the base frame: a direction that is seen from a part turns with it, so squares of differences are the
same there, and the Jacobian needs no turning. Frames are the last axis of all arrays here, so that NumPy works on many
frames at a time however small the matrices are.

Legend: B frames, A driven joints, L = A + 1 bodies, D directions, V parts that they are seen from, N joints, Q pairs of
a direction and a joint.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.fast.description import Kinematics
from mrhubo.fast.plain.human import skew


@dataclass(frozen=True)
class Placed:
    """A robot's bodies and directions, base frame."""

    rotation_L33B: np.ndarray
    position_L3B: np.ndarray
    start_D3B: np.ndarray
    """Where limbs start [m]; 0 for axes, which are like limbs of length 1."""
    end_D3B: np.ndarray
    view_V33B: np.ndarray
    """Columns are left, up and forward of the parts that directions are seen from."""
    direction_D3B: np.ndarray
    """Unit directions."""
    length_DB: np.ndarray

    @property
    def rotation_BL33(self) -> np.ndarray:
        """The bodies' rotations, frame by frame."""
        return np.moveaxis(self.rotation_L33B, -1, 0)

    @property
    def position_BL3(self) -> np.ndarray:
        """Where the bodies are [m], frame by frame."""
        return np.moveaxis(self.position_L3B, -1, 0)


def place(kinematics: Kinematics, q_BN: np.ndarray) -> Placed:
    """Bodies and directions at joint angles (B, N) [rad]."""
    k = kinematics
    angle_AB = q_BN.T[k.column_A] * k.ratio_A[:, None] + k.offset_A[:, None]
    rotary_A1 = k.rotary_A[:, None] > 0
    sine_AB, rest_AB = np.where(rotary_A1, np.sin(angle_AB), 0.0), np.where(rotary_A1, 1 - np.cos(angle_AB), 0.0)
    origin_A33, across_A33 = k.origin_A34[..., :3], skew(k.axis_A3)
    once_A33 = origin_A33 @ across_A33
    inner_A33B = np.einsum("aij,ab->aijb", once_A33, sine_AB) + origin_A33[..., None]
    inner_A33B += np.einsum("aij,ab->aijb", once_A33 @ across_A33, rest_AB)
    along_A3 = (origin_A33 @ k.axis_A3[..., None])[..., 0]
    inner_A3B = k.origin_A34[..., 3, None] + along_A3[..., None] * np.where(rotary_A1, 0.0, angle_AB)[:, None]
    rotation_L33B = np.empty((len(angle_AB) + 1, 3, 3, len(q_BN)))
    position_L3B = np.zeros((len(angle_AB) + 1, 3, len(q_BN)))
    rotation_L33B[0] = np.eye(3)[..., None]
    for joint, parent in enumerate(k.parent_A):
        above_33B = rotation_L33B[parent]
        np.einsum("ijb,jkb->ikb", above_33B, inner_A33B[joint], out=rotation_L33B[joint + 1])
        np.einsum("ijb,jb->ib", above_33B, inner_A3B[joint], out=position_L3B[joint + 1])
        position_L3B[joint + 1] += position_L3B[parent]
    limb_D11 = k.limb_D[:, None, None]
    start_D3B, end_D3B = (
        np.einsum("dijb,dj->dib", rotation_L33B[body_D], point_D3) + position_L3B[body_D] * limb_D11
        for body_D, point_D3 in ((k.start_body_D, k.start_D3), (k.end_body_D, k.end_D3))
    )
    view_V33B = np.einsum("vijb,vjk->vikb", rotation_L33B[k.view_body_V], k.view_V33)
    along_D3B = end_D3B - start_D3B
    length_DB = np.sqrt(np.einsum("dib,dib->db", along_D3B, along_D3B))
    return Placed(rotation_L33B, position_L3B, start_D3B, end_D3B, view_V33B, along_D3B / length_DB[:, None], length_DB)


def jacobian(kinematics: Kinematics, placed: Placed, joints: int) -> np.ndarray:
    """How directions, as they are seen from their parts, change (D, 3, N, B) [1/rad], in the base frame's axes; N is
    `joints`.
    """
    axis_A3B = np.einsum("aijb,aj->aib", placed.rotation_L33B[1:], kinematics.axis_A3)
    d, a, n = kinematics.direction_Q, kinematics.joint_Q, kinematics.column_Q
    end_Q11, start_Q11, bend_Q11, slide_Q11 = kinematics.factor_Q4.T[..., None, None]
    axis_Q3B, along_Q3B = axis_A3B[a], placed.direction_D3B[d]
    lever_Q3B = placed.end_D3B[d] * end_Q11
    lever_Q3B -= placed.start_D3B[d] * start_Q11
    lever_Q3B -= placed.position_L3B[1:][a] * bend_Q11
    moved_Q3B = _cross(axis_Q3B, lever_Q3B)
    moved_Q3B += axis_Q3B * slide_Q11
    moved_Q3B -= along_Q3B * np.einsum("qib,qib->qb", along_Q3B, moved_Q3B)[:, None]
    moved_Q3B /= placed.length_DB[d, None]
    found_D3NB = np.zeros((len(kinematics.limb_D), 3, joints, moved_Q3B.shape[-1]))
    for pair in range(len(d)):  # a joint that others mimic has several pairs for one entry, which are added
        found_D3NB[d[pair], :, n[pair]] += moved_Q3B[pair]
    return found_D3NB


def turning(kinematics: Kinematics, seen_D: np.ndarray, q_BN: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (B, D, 3) and their Jacobian (B, D, 3, N) [1/rad], both in the axes of the parts that see them."""
    placed = place(kinematics, q_BN)
    jacobian_D3NB = jacobian(kinematics, placed, q_BN.shape[1])
    turned_D3NB = np.einsum("dijb,dinb->djnb", placed.view_V33B[seen_D], jacobian_D3NB)
    return seen_directions(placed, seen_D), np.ascontiguousarray(np.moveaxis(turned_D3NB, -1, 0))


def seen_directions(placed: Placed, seen_D: np.ndarray) -> np.ndarray:
    """Directions (B, D, 3) of a robot in the axes of the parts that see them."""
    return np.moveaxis(seen(seen_D, placed.view_V33B, placed.direction_D3B), -1, 0)


def _cross(a_Q3B: np.ndarray, b_Q3B: np.ndarray) -> np.ndarray:
    found_Q3B = np.empty_like(a_Q3B)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a_Q3B[:, j], b_Q3B[:, k], out=found_Q3B[:, i])
        found_Q3B[:, i] -= a_Q3B[:, k] * b_Q3B[:, j]
    return found_Q3B


def seen(view_D: np.ndarray, view_V33B: np.ndarray, vector_D3B: np.ndarray) -> np.ndarray:
    """Vectors (D, 3, B) of the base frame in the axes of the parts that see them."""
    return np.einsum("dijb,dib->djb", view_V33B[view_D], vector_D3B)


def unseen(view_D: np.ndarray, view_V33B: np.ndarray, vector_D3B: np.ndarray) -> np.ndarray:
    """The other way: of the parts' axes, in the base frame."""
    return np.einsum("dijb,djb->dib", view_V33B[view_D], vector_D3B)
