"""Curves of an FBX file: numbers that change from key to key.

Between two keys a curve is constant, a line, or a cubic of Bezier's with slopes at both ends; how the file has them is
told by the documentation of Autodesk's FBX SDK (`FbxAnimCurveDef`, https://help.autodesk.com/view/FBX/2020/ENU/).

Legend: K keys, F times.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.motion.readers.scene.fbx_file import BadFbx, Record

CONSTANT, LINEAR, CUBIC = 0x2, 0x4, 0x8
"""How a curve goes from a key to the next."""
NEXT = 0x100
"""Of what is constant: as the next key."""
USER = 0x400
"""Of a cubic: with the slopes that the file has; else they are found from the keys beside."""
HEAVY_RIGHT, HEAVY_LEFT = 0x1000000, 0x2000000
"""The tangent to the right, and that of the next key to the left, are not a third as long as the step."""
_THIRD = 1 / 3
LIGHT = 1e-4
"""Unit of the lengths of tangents, as a share of the step."""
_HALVINGS = 40


@dataclass(frozen=True)
class Curve:
    """A number that changes."""

    time_K: np.ndarray
    """[s], rising."""
    value_K: np.ndarray
    kind_K: np.ndarray
    """How it goes from each key to the next: bits."""
    slope_K2: np.ndarray
    """At each key, and at the next key, of the way between them [1/s]."""
    weight_K2: np.ndarray
    """How long the tangents are, as shares of the step."""

    def at(self, time_F: np.ndarray) -> np.ndarray:
        """Its values (F,) at some times [s]; before and after the keys those of the first and the last."""
        if len(self.time_K) < 2:
            return np.full(len(time_F), self.value_K[0])
        key_F = np.clip(np.searchsorted(self.time_K, time_F, side="right") - 1, 0, len(self.time_K) - 2)
        step_F = self.time_K[key_F + 1] - self.time_K[key_F]
        share_F = np.clip((time_F - self.time_K[key_F]) / np.maximum(step_F, 1e-12), 0.0, 1.0)
        from_F, to_F, kind_F = self.value_K[key_F], self.value_K[key_F + 1], self.kind_K[key_F]
        value_F = from_F + share_F * (to_F - from_F)
        constant_F = (kind_F & CONSTANT) > 0
        value_F = np.where(constant_F, np.where((kind_F & NEXT) > 0, to_F, from_F), value_F)
        value_F = np.where(share_F <= 0, from_F, np.where(share_F >= 1, to_F, value_F))
        cubic_F = ~constant_F & ((kind_F & CUBIC) > 0) & (share_F > 0) & (share_F < 1)
        if cubic_F.any():
            key_C, step_C = key_F[cubic_F], step_F[cubic_F]
            weight_C2, slope_C2 = self.weight_K2[key_C], self.slope_K2[key_C]
            along_C = _parameter(share_F[cubic_F], weight_C2)
            first_C = from_F[cubic_F] + slope_C2[:, 0] * weight_C2[:, 0] * step_C
            second_C = to_F[cubic_F] - slope_C2[:, 1] * weight_C2[:, 1] * step_C
            value_F[cubic_F] = _bezier(along_C, from_F[cubic_F], first_C, second_C, to_F[cubic_F])
        return value_F


def read_curve(record: Record, second: float) -> Curve | None:
    """A curve; None where it has no keys.

    Args:
        record: of the curve.
        second: units of the file's times in a second.

    Raises:
        BadFbx: its arrays do not fit together, or hold what is no number.
    """
    tick_K, value_K = record.first("KeyTime").array(), record.first("KeyValueFloat").array()
    if tick_K is None or value_K is None or not len(tick_K):
        return None
    if len(tick_K) != len(value_K):
        raise BadFbx(f"has a curve of {len(tick_K):,} times and {len(value_K):,} values")
    time_K, value_K = tick_K.astype(np.float64) / second, value_K.astype(np.float64)
    if not (np.isfinite(value_K).all() and np.isfinite(time_K).all() and (np.diff(time_K) >= 0).all()):
        raise BadFbx("has a curve with NaN, infinite numbers, or times that fall")
    kind_K, slope_K2, weight_K2 = _ways(record, len(time_K))
    told_K = (kind_K & USER) > 0
    own_K = _smooth_slopes(time_K, value_K)
    beside_K2 = np.stack([own_K, np.append(own_K[1:], own_K[-1])], axis=-1)
    return Curve(time_K, value_K, kind_K, np.where(told_K[:, None], slope_K2, beside_K2), weight_K2)


def _ways(record: Record, keys: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Kinds (K,), slopes (K, 2) and weights (K, 2): lines where the file does not say. Keys alike are told once, with
    their number.
    """
    flags, counts, data = (
        record.first(name).array() for name in ("KeyAttrFlags", "KeyAttrRefCount", "KeyAttrDataFloat")
    )
    line = np.full(keys, LINEAR), np.zeros((keys, 2)), np.full((keys, 2), _THIRD)
    if flags is None or counts is None or data is None or not len(counts):
        return line
    counts = counts.astype(np.int64)
    if len(flags) != len(counts) or len(data) != 4 * len(counts) or (counts < 0).any() or counts.sum() != keys:
        raise BadFbx("has a curve whose interpolation is told for more or fewer keys than there are")
    flags = flags.astype(np.int64)
    data_X4 = data.reshape(-1, 4)
    weights_X = np.ascontiguousarray(data_X4[:, 2])
    # two whole numbers in the bits of a float; in text of some makers, one whole number of those bits
    with np.errstate(all="ignore"):
        bits_X = weights_X.astype(np.float32).view(np.uint32).astype(np.int64)
        packed = np.where(weights_X > 1e6, np.nan_to_num(weights_X), bits_X).astype(np.int64)
    weight_X2 = np.stack(
        [
            np.where(flags & HEAVY_RIGHT, (packed & 0xFFFF) * LIGHT, _THIRD),
            np.where(flags & HEAVY_LEFT, (packed >> 16) * LIGHT, _THIRD),
        ],
        axis=-1,
    )
    slope_X2 = np.nan_to_num(data_X4[:, :2].astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0)
    return np.repeat(flags, counts), np.repeat(slope_X2, counts, axis=0), np.repeat(weight_X2, counts, axis=0)


def _smooth_slopes(time_K: np.ndarray, value_K: np.ndarray) -> np.ndarray:
    """Slopes (K,) of a smooth way through all keys: between those of the steps to both sides."""
    if len(time_K) < 2:
        return np.zeros(len(time_K))
    step_K = np.maximum(np.diff(time_K), 1e-9)
    slope_K = np.diff(value_K) / step_K
    share_K = step_K[:-1] / (step_K[:-1] + step_K[1:])
    inner_K = (value_K[2:] - value_K[:-2]) / (step_K[:-1] + step_K[1:])
    inner_K = 0.5 * (inner_K + (1 - share_K) * slope_K[:-1] + share_K * slope_K[1:])
    return np.concatenate([slope_K[:1], inner_K, slope_K[-1:]])


def _parameter(share_C: np.ndarray, weight_C2: np.ndarray) -> np.ndarray:
    """Where on Bezier's cubic (C,) the time is a share of the step: the time rises along it, so halving finds it."""
    low_C, high_C = np.zeros_like(share_C), np.ones_like(share_C)
    first_C, second_C = np.clip(weight_C2[:, 0], 0, 1), 1 - np.clip(weight_C2[:, 1], 0, 1)
    if np.allclose(weight_C2, _THIRD, atol=1e-4):
        return share_C
    for _ in range(_HALVINGS):
        middle_C = 0.5 * (low_C + high_C)
        before_C = _bezier(middle_C, 0.0, first_C, second_C, 1.0) < share_C
        low_C, high_C = np.where(before_C, middle_C, low_C), np.where(before_C, high_C, middle_C)
    return 0.5 * (low_C + high_C)


def _bezier(
    along: np.ndarray, a: np.ndarray | float, b: np.ndarray, c: np.ndarray, d: np.ndarray | float
) -> np.ndarray:
    rest = 1 - along
    return rest**3 * a + 3 * rest**2 * along * b + 3 * rest * along**2 * c + along**3 * d
