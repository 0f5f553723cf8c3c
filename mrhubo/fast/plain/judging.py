"""What is told beside joint angles: what the robot reads of a pose, its plausibility, and confidence.

Sources: `mrhubo.robot.plausibility`, `mrhubo.robot.alignment`, `mrhubo.body.anatomy`, `mrhubo.retargeter.confidence`.

Legend: B frames, D directions, T turned human joints, X branches.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.plain.human import bend_axis, cross, norm, normalize, orthonormal_columns, rodrigues
from mrhubo.fast.plain.networks import ACTIVATIONS, Activation, mlp
from mrhubo.fast.sections import BEND, LIMB, SHARE, Reading

SHORT = 1e-9
_TINY = 1e-12


def read_pose(reading: Reading, constants: Mapping[str, float], target_BD3: np.ndarray) -> np.ndarray:
    """Local rotations (B, T, 3, 3) of the turned joints of a person at rest but for these directions."""
    batch, slots = len(target_BD3), len(reading.joint_T) + 1
    turn_BT33 = np.broadcast_to(np.eye(3), (batch, slots, 3, 3)).copy()
    for k, kind in enumerate(reading.kind_K):
        before_B33 = turn_BT33[:, reading.of_K[k]]
        columns = reading.direction_K3[k]
        wanted_BX3 = target_BD3[:, columns] @ turn_BT33[:, reading.seen_K[k]].swapaxes(-1, -2)
        rest_23 = reading.rest_K23[k]
        if kind == LIMB:
            more_B33 = _shortest(before_B33 @ rest_23[0], wanted_BX3[:, 0])
        elif kind == BEND:
            own_B3 = before_B33 @ rest_23[0]
            told_B3 = wanted_BX3[:, 2] if columns[2] >= 0 else own_B3
            axis_B3 = bend_axis(wanted_BX3[:, 0], wanted_BX3[:, 1], told_B3, constants)[0]
            more_B33 = _about(wanted_BX3[:, 0], own_B3, axis_B3)
        else:
            aim_B33 = _columns(wanted_BX3[:, 0], wanted_BX3[:, 1]) @ _columns(rest_23[0], rest_23[1]).T
            if kind == SHARE:
                missing_B33 = aim_B33 @ turn_BT33[:, reading.last_K[k]].swapaxes(-1, -2)
                more_B33 = _share(missing_B33, reading.share_K[k])
            else:
                more_B33 = aim_B33 @ before_B33.swapaxes(-1, -2)
        turn_BT33[:, reading.slot_K[k]] = more_B33 @ before_B33
    return turn_BT33[:, reading.parent_T].swapaxes(-1, -2) @ turn_BT33[:, 1:]


def _columns(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return np.stack((first, second, cross(first, second)), axis=-1)


def _shortest(start_B3: np.ndarray, end_B3: np.ndarray) -> np.ndarray:
    """The smallest turns (B, 3, 3) between unit vectors; none where they are opposite."""
    axis_B3 = cross(start_B3, end_B3)
    sine_B = norm(axis_B3)
    cosine_B = (start_B3 * end_B3).sum(-1)
    told_B = sine_B > SHORT
    length_B = np.hypot(sine_B, cosine_B)
    sine_B, cosine_B = np.where(told_B, sine_B / length_B, 0.0), np.where(told_B, cosine_B / length_B, 1.0)
    return rodrigues(normalize(axis_B3), sine_B, cosine_B)


def _about(axis_B3: np.ndarray, start_B3: np.ndarray, end_B3: np.ndarray) -> np.ndarray:
    """Turns (B, 3, 3) about unit axes that take the half-plane of one vector to that of another."""
    sine_B = (axis_B3 * cross(start_B3, end_B3)).sum(-1)
    cosine_B = (start_B3 * end_B3).sum(-1) - (start_B3 * axis_B3).sum(-1) * (end_B3 * axis_B3).sum(-1)
    angle_B = np.arctan2(sine_B, cosine_B)
    return rodrigues(axis_B3, np.sin(angle_B), np.cos(angle_B))


def quaternions(matrix_X33: np.ndarray) -> np.ndarray:
    """Unit quaternions (..., 4), x y z w with w >= 0, of rotations: the longest row of the four that each tells."""
    m = np.moveaxis(matrix_X33, (-2, -1), (0, 1))
    xy, xz, yz = m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1]
    xw, yw, zw = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    x, y, z = (1 + m[i, i] - m[(i + 1) % 3, (i + 1) % 3] - m[(i + 2) % 3, (i + 2) % 3] for i in range(3))
    w = 1 + m[0, 0] + m[1, 1] + m[2, 2]
    rows_X44 = np.stack((x, xy, xz, xw, xy, y, yz, yw, xz, yz, z, zw, xw, yw, zw, w), axis=-1)
    rows_X44 = rows_X44.reshape(*rows_X44.shape[:-1], 4, 4)
    longest_X = np.stack((x, y, z, w), axis=-1).argmax(axis=-1)
    found_X4 = np.take_along_axis(rows_X44, longest_X[..., None, None], axis=-2)[..., 0, :]
    found_X4 = found_X4 / np.sqrt((found_X4 * found_X4).sum(-1, keepdims=True))
    return np.where(found_X4[..., 3:] < 0, -found_X4, found_X4)


def _share(matrix_B33: np.ndarray, share: float) -> np.ndarray:
    """Turns about the same axes by a share of the angles."""
    quaternion_B4 = quaternions(matrix_B33)
    sine_B = norm(quaternion_B4[:, :3])
    angle_B = 2 * share * np.arctan2(sine_B, quaternion_B4[:, 3])
    return rodrigues(normalize(quaternion_B4[:, :3]), np.sin(angle_B), np.cos(angle_B))


def excess(reading: Reading, local_BT33: np.ndarray) -> np.ndarray:
    """By how much each turned joint leaves its anatomical range (B, T) [rad], at its worst angle."""
    sign_T3 = np.where(reading.mirror_T[:, None] > 0, [1.0, -1.0, -1.0], 1.0)
    quaternion_BT4 = quaternions(local_BT33)
    vector_BT3, scalar_BT = quaternion_BT4[..., :3] * sign_T3, quaternion_BT4[..., 3]
    twist_axis_T3 = reading.axis_T33[:, 0]
    along_BT = (vector_BT3 * twist_axis_T3).sum(-1)
    twist_BT = np.arctan2(along_BT, np.where(np.abs(scalar_BT) + np.abs(along_BT) > 1e-6, scalar_BT, 1.0))
    half_BT3, cosine_BT = twist_axis_T3 * np.sin(twist_BT)[..., None], np.cos(twist_BT)
    scalar_swing_BT = cosine_BT * scalar_BT + (half_BT3 * vector_BT3).sum(-1)
    swing_BT3 = cosine_BT[..., None] * vector_BT3 - scalar_BT[..., None] * half_BT3 - cross(half_BT3, vector_BT3)
    sine_BT = np.sqrt((swing_BT3 * swing_BT3).sum(-1) + _TINY)
    swing_BT3 = swing_BT3 * (2 * np.arctan2(sine_BT, scalar_swing_BT) / sine_BT)[..., None]
    others_BT2 = (swing_BT3[..., None, :] * reading.axis_T33[:, 1:]).sum(-1)
    angle_BT3 = np.concatenate((2 * twist_BT[..., None], others_BT2), axis=-1)
    limits_T32 = reading.limit_T32
    over_BT3 = np.maximum(angle_BT3 - limits_T32[..., 1], 0) + np.maximum(limits_T32[..., 0] - angle_BT3, 0)
    return over_BT3.max(axis=-1)


def reconstruction_error(description: Description, local_BT33: np.ndarray) -> np.ndarray:
    """Mean squared error of each turned joint's six numbers (B, T) between a pose and the prior's reconstruction."""
    six_BT6 = local_BT33[..., :2].swapaxes(-1, -2).reshape(*local_BT33.shape[:2], 6)
    off_BF = (six_BT6 - [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]).reshape(len(six_BT6), -1).astype(np.float32)
    raw_BF = reconstruct(description, off_BF, ACTIVATIONS[description.settings.activation])
    columns_BT32 = raw_BF.astype(np.float64).reshape(*six_BT6.shape[:2], 2, 3).swapaxes(-1, -2)
    again_BT32 = orthonormal_columns(columns_BT32)[..., :2]
    return ((again_BT32 - local_BT33[..., :2]) ** 2).mean(axis=(-2, -1))


def reconstruct(description: Description, off_BF: np.ndarray, act: Activation) -> np.ndarray:
    """The body prior's six numbers for each turned joint, not yet orthonormal, of those by which it is off its rest."""
    prior = description.prior
    return mlp(prior.decoder, mlp(prior.encoder, off_BF, act), act)


def of_branches(number_BY: np.ndarray, own_XY: np.ndarray) -> np.ndarray:
    """Means (B, X) of numbers of directions or joints over those that are a branch's own."""
    return number_BY @ (own_XY / own_XY.sum(axis=1, keepdims=True)).T


def angle_between(a_X3: np.ndarray, b_X3: np.ndarray) -> np.ndarray:
    """Angles (...) [rad] between vectors."""
    return np.arctan2(norm(cross(a_X3, b_X3)), (a_X3 * b_X3).sum(-1))


def shake(target_TD3: np.ndarray, frame_rate: float, constants: Mapping[str, float]) -> np.ndarray:
    """How far directions of a motion shake (T, D) [rad], as `mrhubo.retargeter.confidence.shake`."""
    frames, directions, _ = target_TD3.shape
    if frames < 3:
        return np.zeros((frames, directions))
    off_YD = angle_between(normalize(target_TD3[:-2] + target_TD3[2:]), target_TD3[1:-1])
    beyond_YD = np.maximum(off_YD - 0.5 * constants["acceleration"] / frame_rate**2, 0.0)
    near = int(constants["neighbours"])
    padded_XD = np.pad(beyond_YD**2, ((near + 1, near + 1), (0, 0)), mode="edge")
    windows_TDW = np.lib.stride_tricks.sliding_window_view(padded_XD, 2 * near + 1, axis=0)
    return np.sqrt(windows_TDW.mean(axis=-1))


def confidence(
    description: Description,
    miss_BX: np.ndarray,
    phi_BX: np.ndarray,
    excess_BX: np.ndarray,
    shake_BX: np.ndarray | None,
) -> np.ndarray:
    """Confidence of branches (B, X): signals are in degrees, phi as it is; no shaking where no frame rate is known."""
    constants = description.settings.constants
    certain, *weights = description.trust.weight_25[1 if shake_BX is None else 0]
    signals = (
        np.maximum(2 * miss_BX / constants["good_deg"] - 1, 0.0),
        np.maximum(np.log(np.maximum(phi_BX, _TINY) / constants["usual_phi"]), 0.0),
        excess_BX / constants["excess_deg"],
        (0.0 if shake_BX is None else shake_BX) / constants["shake_deg"],
    )
    logit_BX = certain - sum(weight * signal for weight, signal in zip(weights, signals, strict=True))
    return np.nan_to_num(1 / (1 + np.exp(-logit_BX)), nan=0.0)
