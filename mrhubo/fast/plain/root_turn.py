"""How the base is turned further than the person's pelvis (`mrhubo.robot.root_turn`, where the reasons stand), for both
forms.

Legend: B frames, J = 21 posed joints, D directions, G joints of the waist.
"""

from __future__ import annotations

import numpy as np

from mrhubo.fast.leg_section import RootTurn
from mrhubo.fast.plain.human import cross, orthonormal_columns, rodrigues

SWEEPS, SETTLED_RAD = 40, 1e-8
"""Joints of a waist are turned one after the other so often at most, or until none turns by more."""
_SEEN = [1, 2]


def root_turn(root: RootTurn, local_BJ33: np.ndarray) -> np.ndarray:
    """Axes (B, 3, 3) from which legs are seen, in those of the person's pelvis, of local rotations (B, 21, 3, 3)."""
    spine_B333 = orthonormal_columns(local_BJ33[:, root.spine_3, :, :2].astype(np.float64))
    chest_B33 = spine_B333[:, 0] @ spine_B333[:, 1] @ spine_B333[:, 2]
    turn_B33 = chest_B33 @ _reached(root, chest_B33).swapaxes(1, 2)
    return turn_B33 if root.share_1[0] == 1 else _half_way(turn_B33)


def turned_back(root: RootTurn | None, target_BD3: np.ndarray, local_BJ33: np.ndarray) -> np.ndarray:
    """Directions (B, D, 3) that are seen from what carries each, with those of legs as they are seen from there."""
    if root is None:
        return target_BD3
    return np.where(root.leg_D[:, None] > 0, target_BD3 @ root_turn(root, local_BJ33), target_BD3)


def _reached(root: RootTurn, chest_B33: np.ndarray) -> np.ndarray:
    """What the waist can do of turns of a chest (B, 3, 3)."""
    angle_BG = np.tile(np.clip(0.0, root.limit_G2[:, 0], root.limit_G2[:, 1]), (len(chest_B33), 1))
    turns = [_about(axis_3, angle_B) for axis_3, angle_B in zip(root.axis_G3, angle_BG.T, strict=True)]
    for _ in range(SWEEPS if turns and len(chest_B33) else 0):
        moved = 0.0
        for g, (axis_3, limit_2) in enumerate(zip(root.axis_G3, root.limit_G2, strict=True)):
            outer_B33, inner_B33 = _product(turns[g + 1 :]) @ root.rest_33, _product(turns[:g])
            angle_B = _best_angle(axis_3, limit_2, outer_B33, np.swapaxes(inner_B33, -1, -2) @ chest_B33)
            moved = max(moved, float(np.abs(angle_B - angle_BG[:, g]).max()))
            angle_BG[:, g], turns[g] = angle_B, _about(axis_3, angle_B)
        if moved < SETTLED_RAD:
            break
    return np.broadcast_to(_product(turns) @ root.rest_33, chest_B33.shape)


def _product(turns: list[np.ndarray]) -> np.ndarray:
    found = np.eye(3)
    for turn_B33 in turns:
        found = found @ turn_B33
    return found


def _about(axis_3: np.ndarray, angle_B: np.ndarray) -> np.ndarray:
    return rodrigues(np.broadcast_to(axis_3, (len(angle_B), 3)), np.sin(angle_B), np.cos(angle_B))


def _best_angle(axis_3: np.ndarray, limit_2: np.ndarray, outer_B33: np.ndarray, wanted_B33: np.ndarray) -> np.ndarray:
    """The angle (B,) inside a range by which columns of one matrix, turned about an axis, come nearest to another's."""
    to_BX3 = np.swapaxes(wanted_B33, -1, -2)[..., _SEEN, :]
    from_BX3 = np.broadcast_to(np.swapaxes(outer_B33, -1, -2)[..., _SEEN, :], to_BX3.shape)
    sine_B = (cross(from_BX3, to_BX3) @ axis_3).sum(-1)
    along_B = ((from_BX3 @ axis_3) * (to_BX3 @ axis_3)).sum(-1)
    angle_B, (low, high) = np.arctan2(sine_B, (from_BX3 * to_BX3).sum((-2, -1)) - along_B), limit_2
    nearer_B = np.where(np.cos(high - angle_B) >= np.cos(low - angle_B), high, low)
    return np.where((angle_B >= low) & (angle_B <= high), angle_B, nearer_B)


def _half_way(turn_B33: np.ndarray) -> np.ndarray:
    """Turns about the same axes by half the angles: Rodrigues' formula for a half in terms of the one for the whole."""
    back_B33 = turn_B33.swapaxes(1, 2)
    cosine_B = np.sqrt(np.maximum(1.0 + np.trace(turn_B33, axis1=1, axis2=2), 1e-12))[:, None, None] / 2
    even_B33 = (turn_B33 + back_B33) / 2 - np.eye(3)
    return np.eye(3) + (turn_B33 - back_B33) / (4 * cosine_B) + even_B33 / (2 * (1 + cosine_B))
