"""Points of soles are where they are to be (`mrhubo.reference.terms.soles`), and where they are.

Places and weights come after the directions in targets: H rows of places [m], seen from what carries the legs, then H
rows whose first number is the weight [1/m^2]. Differences are in the base frame, as of directions.

Legend: B frames, H points of soles, J balls, D directions, N joints, C blocks, A driven joints.
"""

from __future__ import annotations

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.leg_section import Legs
from mrhubo.fast.plain.collision import carries
from mrhubo.fast.plain.human import cross
from mrhubo.fast.plain.robot import Placed


def turned_points(placed: Placed, body_X: np.ndarray, point_X3: np.ndarray) -> np.ndarray:
    """Points of bodies (B, X, 3) [m], base frame."""
    return (placed.rotation_BL33[:, body_X] @ point_X3[..., None])[..., 0] + placed.position_BL3[:, body_X]


def carrier(legs: Legs, placed: Placed) -> tuple[np.ndarray, np.ndarray]:
    """Human axes (B, 3, 3) of what carries the legs, and the root's place (B, 3) [m], base frame."""
    axes_B33 = placed.rotation_BL33[:, legs.carrier_1[0]] @ legs.axes_33
    return axes_B33, turned_points(placed, legs.carrier_1, legs.root_3[None])[:, 0]


def add_soles(
    description: Description, legs: Legs, placed: Placed, target_BX3: np.ndarray,
    cost_BC: np.ndarray, gradient_BN: np.ndarray, hessian_BNN: np.ndarray,
) -> None:  # fmt: skip
    """Adds the term to a model at a pose, for directions (B, D + 2 H, 3) with places and weights after them."""
    cost, kinematics, points = description.cost, description.kinematics, len(legs.body_H)
    wanted_BH3, weight_BH = target_BX3[:, -2 * points : -points], target_BX3[:, -points:, 0]
    axes_B33, root_B3 = carrier(legs, placed)
    place_BH3 = turned_points(placed, legs.body_H, legs.point_H3)
    miss_BH3 = place_BH3 - root_B3[:, None] - wanted_BH3 @ axes_B33.swapaxes(-1, -2)
    axis_BA3 = (placed.rotation_BL33[:, 1:] @ kinematics.axis_A3[..., None])[..., 0]
    lever_BHA3 = place_BH3[:, :, None] - placed.position_BL3[:, None, 1:]
    turned_BHA3 = cross(axis_BA3[:, None], lever_BHA3)
    moved_BHA3 = np.where(kinematics.rotary_A[:, None] > 0, turned_BHA3, axis_BA3[:, None])
    carried_HAN = moved_points(description, legs)
    jacobian_BHN3 = np.einsum("bhai,han->bhni", moved_BHA3, carried_HAN)
    block_HC = ((np.abs(carried_HAN).sum(axis=1) > 0) @ cost.joints_NC > 0) * 1.0
    cost_BC += (weight_BH * (miss_BH3 * miss_BH3).sum(-1)) @ block_HC
    weighted_BHN3 = weight_BH[..., None, None] * jacobian_BHN3
    gradient_BN += np.einsum("bhni,bhi->bn", weighted_BHN3, miss_BH3)
    hessian_BNN += np.einsum("bhni,bhmi->bnm", weighted_BHN3, jacobian_BHN3)


def moved_points(description: Description, legs: Legs) -> np.ndarray:
    """By how much each driven joint turns with each joint of q where it moves a point against what carries the legs
    (H, A, N); negative where it moves that against the point.
    """
    carried_LAN = carries(description.kinematics, len(description.cost.lower_N))
    return carried_LAN[legs.body_H] - carried_LAN[legs.carrier_1[0]]
