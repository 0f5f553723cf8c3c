"""Which capsules of a robot touch or nearly do, how far they are apart, and how that changes with the joints.

Source: `mrhubo.robot.collision`, where the reasons stand.

Legend: B frames, S capsules, Y pairs of them, X pairs that are near in some frame, L bodies, A driven joints, N joints.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.plain.broad_phase import reaches
from mrhubo.fast.plain.human import cross, norm
from mrhubo.fast.plain.robot import Placed, place
from mrhubo.fast.sections import Capsules, Kinematics

SHORT, PARALLEL = 1e-9, 1e-7
_AT_ONCE = 2**21
"""Most pairs, over all frames, whose rough distance is in memory."""


@dataclass(frozen=True)
class Near:
    """Pairs of capsules that are near, one entry each."""

    row_X: np.ndarray
    """Which frame,"""
    pair_X: np.ndarray
    """and which pair."""
    distance_X: np.ndarray
    """Signed distance of the surfaces [m]; negative where they overlap."""
    point_X3: np.ndarray
    """The nearest point on the first capsule's axis [m],"""
    apart_X3: np.ndarray
    """and from the second's to it."""


def near(
    capsules: Capsules, rotation_BL33: np.ndarray, position_BL3: np.ndarray, margin_Y: np.ndarray | float = 0.0
) -> Near:
    """The pairs that are closer than a margin [m], which each may have of its own."""
    rotation_S33B = np.moveaxis(rotation_BL33, 0, -1)[capsules.body_S]
    ends_S23B = np.einsum("sijb,sej->seib", rotation_S33B, capsules.end_S23)
    ends_S23B += np.moveaxis(position_BL3, 0, -1)[capsules.body_S, None]
    i_Y, j_Y = capsules.pair_Y2.T
    reach_S, centre_S3B = reaches(capsules), ends_S23B.mean(axis=1)
    # The spheres around the capsules tell cheaply which pairs need a closer look.
    reach_Y = reach_S[i_Y] + reach_S[j_Y] + np.maximum(margin_Y, 0.0)
    size = max(1, _AT_ONCE // max(1, len(i_Y)))
    blocks = [centre_S3B[..., first : first + size] for first in range(0, max(1, centre_S3B.shape[-1]), size)]
    found = [np.nonzero(_squared(block[i_Y] - block[j_Y]) < (reach_Y**2)[:, None]) for block in blocks]
    row_X = np.concatenate([row + number * size for number, (_, row) in enumerate(found)])
    pair_X = np.concatenate([pair for pair, _ in found])
    i_X, j_X = i_Y[pair_X], j_Y[pair_X]
    point_X3, apart_X3 = closest(ends_S23B[i_X, :, :, row_X], ends_S23B[j_X, :, :, row_X])
    distance_X = norm(apart_X3) - capsules.radius_S[i_X] - capsules.radius_S[j_X]
    x = np.flatnonzero(distance_X < np.broadcast_to(margin_Y, len(i_Y))[pair_X])
    return Near(row_X[x], pair_X[x], distance_X[x], point_X3[x], apart_X3[x])


def _squared(vector_Y3B: np.ndarray) -> np.ndarray:
    """Squared lengths (Y, B)."""
    return np.einsum("yib,yib->yb", vector_Y3B, vector_Y3B)


def closest(a_X23: np.ndarray, b_X23: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where segments are nearest: the points on the first ones (X, 3), and what leads there from the second ones
    (X, 3) [m]. C. Ericson, Real-Time Collision Detection (2005), section 5.1.9.
    """
    start_a, start_b = a_X23[:, 0], b_X23[:, 0]
    along_a, along_b, r = a_X23[:, 1] - start_a, b_X23[:, 1] - start_b, start_a - start_b
    a, e, b = (along_a * along_a).sum(-1), (along_b * along_b).sum(-1), (along_a * along_b).sum(-1)
    c, f = (along_a * r).sum(-1), (along_b * r).sum(-1)
    safe_a, safe_e = np.maximum(a, SHORT), np.maximum(e, SHORT)
    determinant = a * e - b * b
    s = np.where(determinant > PARALLEL * a * e, (b * f - c * e) / np.maximum(determinant, SHORT * SHORT), 0.0)
    t = np.clip((b * np.clip(s, 0, 1) + f) / safe_e, 0, 1)
    s = np.clip((b * t - c) / safe_a, 0, 1)
    t = np.clip((b * s + f) / safe_e, 0, 1)
    return start_a + s[:, None] * along_a, r + s[:, None] * along_a - t[:, None] * along_b


def collides(capsules: Capsules, rotation_BL33: np.ndarray, position_BL3: np.ndarray) -> np.ndarray:
    """Whether any pair of capsules overlaps (B,)."""
    touches_B = np.zeros(len(position_BL3), bool)
    touches_B[near(capsules, rotation_BL33, position_BL3).row_X] = True
    return touches_B


def clearances(description: Description, most: float) -> np.ndarray:
    """The distance [m] that each pair is to keep (Y,): `most`, or that at home, where that is less."""
    cost = description.cost
    home = place(description.kinematics, np.clip(0.0, cost.lower_N, cost.upper_N)[None])
    found = near(description.capsules, home.rotation_BL33, home.position_BL3, most)
    clear_Y = np.full(len(description.capsules.pair_Y2), most)
    clear_Y[found.pair_X] = found.distance_X
    return clear_Y


def carries(kinematics: Kinematics, joints: int) -> np.ndarray:
    """By how much each driven joint turns with each joint of q, for each body that it carries (L, A, N): else 0."""
    count = len(kinematics.parent_A)
    above_LA = np.zeros((count + 1, count))
    for joint, parent in enumerate(kinematics.parent_A):
        above_LA[joint + 1] = above_LA[parent]
        above_LA[joint + 1, joint] = 1.0
    drive_AN = np.zeros((count, joints))
    drive_AN[np.arange(count), kinematics.column_A] = kinematics.ratio_A
    return above_LA[:, :, None] * drive_AN


def distance_jacobian(
    kinematics: Kinematics, capsules: Capsules, placed: Placed, found: Near, carried_LAN: np.ndarray
) -> np.ndarray:
    """How the distances change (X, N) [m/rad]: with the normal n at the contact c, a joint with the axis a through o
    changes that of a body that it carries by n . (a x (c - o)), one that slides by n . a. `carried_LAN`: `carries`.
    """
    axis_BA3 = (placed.rotation_BL33[:, 1:] @ kinematics.axis_A3[..., None])[..., 0]
    axis_XA3, origin_XA3 = axis_BA3[found.row_X], placed.position_BL3[:, 1:][found.row_X]
    normal_X3 = found.apart_X3 / np.maximum(norm(found.apart_X3), SHORT)[:, None]
    turned_XA3 = cross(axis_XA3, found.point_X3[:, None] - origin_XA3)
    moved_XA3 = np.where(kinematics.rotary_A[:, None] > 0, turned_XA3, axis_XA3)
    body_X2 = capsules.body_S[capsules.pair_Y2[found.pair_X]]
    carried_XAN = carried_LAN[body_X2[:, 0]] - carried_LAN[body_X2[:, 1]]
    return ((moved_XA3 * normal_X3[:, None]).sum(-1)[:, None] @ carried_XAN)[:, 0]
