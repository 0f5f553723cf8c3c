"""Directions of human poses (`mrhubo.robot.directions`, `mrhubo.body.turns`).

Legend: B frames, J = 21 posed joints, P of them that are looked at, D directions.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mrhubo.fast.sections import Human

PLANE_DEG = (3.0, 12.0)
"""Below the first bend the upper arm's turn alone tells the axis of an elbow, from the second on the plane of the limbs
alone. Motion capture is some two degrees exact, so the plane of limbs with less than five between them says little."""
NEEDED_DEG = (8.0, 25.0)
"""Up to the first bend the axis counts in full, from the second on not at all: the limbs say everything."""
BEND_DEG = {
    "plane_low_deg": PLANE_DEG[0], "plane_high_deg": PLANE_DEG[1],
    "needed_low_deg": NEEDED_DEG[0], "needed_high_deg": NEEDED_DEG[1],
}  # fmt: skip
"""The same as `bend_axis` takes them."""
_TINY = 1e-12
_SHORT = 1e-12
"""Of `torch.nn.functional.normalize`."""


def orthonormal_columns(columns_X32: np.ndarray) -> np.ndarray:
    """Rotations (..., 3, 3) of two columns each (..., 3, 2): Gram-Schmidt, as `mrhubo.rotation.sixd_to_matrix`."""
    first, second = columns_X32[..., 0], columns_X32[..., 1]
    x = first / np.sqrt((first * first).sum(-1, keepdims=True) + _TINY)
    for _ in range(2):
        second = second - (x * second).sum(-1, keepdims=True) * x
    y = second / np.sqrt((second * second).sum(-1, keepdims=True) + _TINY)
    return np.stack((x, y, cross(x, y)), axis=-1)


def cross(a_X3: np.ndarray, b_X3: np.ndarray) -> np.ndarray:
    """Cross products (..., 3); NumPy's own takes ten times as long for a single one."""
    ax, ay, az = a_X3[..., 0], a_X3[..., 1], a_X3[..., 2]
    bx, by, bz = b_X3[..., 0], b_X3[..., 1], b_X3[..., 2]
    return np.stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx), axis=-1)


def norm(a_X3: np.ndarray) -> np.ndarray:
    """Lengths (...) of vectors (..., 3)."""
    return np.sqrt((a_X3 * a_X3).sum(-1))


def normalize(a_X3: np.ndarray) -> np.ndarray:
    """Unit vectors (..., 3); 0 stays 0."""
    return a_X3 / np.maximum(norm(a_X3), _SHORT)[..., None]


def skew(axis_X3: np.ndarray) -> np.ndarray:
    """Matrices (..., 3, 3) whose product with a vector is the cross product with it."""
    x, y, z = axis_X3[..., 0], axis_X3[..., 1], axis_X3[..., 2]
    nothing = np.zeros_like(x)
    return np.stack((nothing, -z, y, z, nothing, -x, -y, x, nothing), axis=-1).reshape(*x.shape, 3, 3)


def rodrigues(axis_X3: np.ndarray, sine_X: np.ndarray, cosine_X: np.ndarray) -> np.ndarray:
    """Turns (..., 3, 3) about unit axes (..., 3), by Rodrigues' formula."""
    across_X33 = skew(axis_X3)
    turn_X33 = sine_X[..., None, None] * across_X33 + (1 - cosine_X)[..., None, None] * (across_X33 @ across_X33)
    return np.eye(3) + turn_X33


def directions_of(human: Human, constants: Mapping[str, float], local_BJ33: np.ndarray) -> np.ndarray:
    """Directions (B, D, 3) of local rotations (B, 21, 3, 3), as `BodyMap.human_directions`."""
    local_BP33 = orthonormal_columns(local_BJ33[:, human.joint_P, :, :2].astype(np.float64))
    places = np.empty((len(local_BJ33), len(human.joint_P) + 1, 3, 3))
    places[:, 0] = np.eye(3)
    for place, parent in enumerate(human.parent_P, 1):
        turn_B33 = local_BP33[:, place - 1]
        places[:, place] = places[:, parent] @ turn_B33 if parent else turn_B33
    found_BD3 = (places[:, human.place_D] @ human.rest_D3[..., None])[..., 0]
    if len(human.bend_Z):
        upper, lower, own = (found_BD3[:, columns] for columns in (human.upper_Z, human.lower_Z, human.bend_Z))
        axis_BZ3, needed_BZ = bend_axis(upper, lower, own, constants)
        found_BD3[:, human.bend_Z] = axis_BZ3 * needed_BZ[..., None]
    views_BD33 = places[:, human.view_V[human.seen_D]]
    return (found_BD3[:, :, None] @ views_BD33)[:, :, 0]


def bend_axis(
    upper_X3: np.ndarray, lower_X3: np.ndarray, own_X3: np.ndarray, constants: Mapping[str, float]
) -> tuple[np.ndarray, np.ndarray]:
    """As `mrhubo.robot.bending.bend_axis`: axes (..., 3), and how much they count (...)."""
    cross_X3 = cross(upper_X3, lower_X3)
    bend_X = np.arctan2(norm(cross_X3), (upper_X3 * lower_X3).sum(-1))
    plane_X1 = _rising(bend_X, constants["plane_low_deg"], constants["plane_high_deg"])[..., None]
    own_X3 = own_X3 - upper_X3 * (upper_X3 * own_X3).sum(-1, keepdims=True)
    axis_X3 = plane_X1 * normalize(cross_X3) + (1 - plane_X1) * normalize(own_X3)
    return axis_X3, 1 - _rising(bend_X, constants["needed_low_deg"], constants["needed_high_deg"])


def _rising(bend_X: np.ndarray, low_deg: float, high_deg: float) -> np.ndarray:
    low, high = np.radians(low_deg), np.radians(high_deg)
    return smooth_share((bend_X - low) / (high - low))


def smooth_share(share_X: np.ndarray) -> np.ndarray:
    """Shares, 0..1, that begin and end without a corner; what is beyond is cut."""
    share_X = np.clip(share_X, 0.0, 1.0)
    return share_X * share_X * (3 - 2 * share_X)
