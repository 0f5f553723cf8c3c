"""The networks (`mrhubo.retargeter.networks`) and the body prior's layers, float32.

Legend: B frames, F numbers that the networks see, N joints.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.plain.human import cross, norm, normalize
from mrhubo.fast.sections import Layers, Part

# erf(x) = x P(x^2) / Q(x^2) up to |x| = 4, beyond which it is 1 in float32: a rational fit with an error below 3e-8,
# found by iteratively reweighted least squares on the values of scipy.special.erf.
ERF_TOP = (1.1283789765461936, 0.19624791356658905, 0.053467330137303405, 0.004003595034881348,
           0.00028803932033508314, 1.974827287362027e-06)  # fmt: skip
ERF_BOTTOM = (1.0, 0.5072513450242637, 0.11647597831624709, 0.015444325421374245, 0.001216345537898967,
              3.7480720233753056e-05)  # fmt: skip
ERF_END = 4.0
_NEAR = 2**15
"""Numbers that are worked on at a time, so that they stay near the processor."""
Activation = Callable[[np.ndarray], np.ndarray]
_HALF, _ROOT = np.float32(0.5), np.float32(np.sqrt(0.5))


def gelu(x_X: np.ndarray) -> np.ndarray:
    """x (1 + erf(x / sqrt 2)) / 2, of float32 numbers; NumPy has no erf, and SciPy takes long to import."""
    if x_X.size > _NEAR and len(x_X) > 1:
        rows = max(1, _NEAR * len(x_X) // x_X.size)
        return np.concatenate([gelu(x_X[first : first + rows]) for first in range(0, len(x_X), rows)])
    z_X = np.clip(x_X * _ROOT, np.float32(-ERF_END), np.float32(ERF_END))
    square_X = z_X * z_X
    top_X, bottom_X = _polynomial(ERF_TOP, square_X), _polynomial(ERF_BOTTOM, square_X)
    z_X *= top_X
    z_X /= bottom_X
    z_X += np.float32(1)
    z_X *= x_X
    z_X *= _HALF
    return z_X


def _polynomial(coefficients: tuple[float, ...], x_X: np.ndarray) -> np.ndarray:
    found_X = x_X * np.float32(coefficients[-1])
    for coefficient in coefficients[-2:0:-1]:
        found_X += np.float32(coefficient)
        found_X *= x_X
    found_X += np.float32(coefficients[0])
    return found_X


def silu(x_X: np.ndarray) -> np.ndarray:
    """x / (1 + exp(-x))."""
    with np.errstate(over="ignore"):
        return x_X / (np.float32(1) + np.exp(-x_X))


ACTIVATIONS: dict[str, Activation] = {
    "silu": silu,
    "leaky_relu": lambda x_X: np.where(x_X > 0, x_X, np.float32(0.01) * x_X),
    "tanh": np.tanh,
}
"""Of the body prior, by name."""


def joint_angles(description: Description, features_BF: np.ndarray) -> np.ndarray:
    """Joint angles (B, N) [rad], inside the limits, of what the networks see (B, F); all float32."""
    residual, cost = description.settings.residual, description.cost
    raw_BN = features_BF
    for stage in (description.pre, description.post):
        raw_BN = _branched(stage, raw_BN, residual) if stage else raw_BN
    lower_N, upper_N = cost.lower_N.astype(np.float32), cost.upper_N.astype(np.float32)
    middle_N, half_N = (upper_N + lower_N) / 2, (upper_N - lower_N) / 2
    angles_BN = middle_N + half_N * (np.tanh(raw_BN) if description.settings.bound == "tanh" else raw_BN)
    return np.minimum(np.maximum(np.nan_to_num(angles_BN, nan=0.0), lower_N), upper_N)


def features_of(description: Description, local_BJ33: np.ndarray, direction_BD3: np.ndarray) -> np.ndarray:
    """What the networks see (B, F), of poses (B, 21, 3, 3) and of their directions (B, D, 3)."""
    f, batch = description.features, len(direction_BD3)
    if description.settings.features == "local":
        columns_BI32 = local_BJ33[:, f.input_I, :, :2].swapaxes(-1, -2)
        return (columns_BI32.reshape(batch, 6 * len(f.input_I)).astype(np.float32) - f.center_F) * f.scale_F
    vector_BI3 = direction_BD3[:, f.input_I]
    bend_BW3 = vector_BI3[:, f.bend_W]
    plane_BW3 = normalize(cross(vector_BI3[:, f.upper_W], vector_BI3[:, f.lower_W]))
    bend_BW3 = bend_BW3 + np.maximum(1 - norm(bend_BW3), 0.0)[..., None] * plane_BW3
    unit_BI3 = vector_BI3.copy()
    unit_BI3[:, f.bend_W] = bend_BW3
    cosine_BO = (unit_BI3[:, f.first_O] * unit_BI3[:, f.second_O]).sum(-1)
    along_BM3, axis_BM3, seen_BM3 = (unit_BI3[:, places] for places in (f.limb_M, f.axis_M, f.seen_M))
    axis_BM3 = normalize(axis_BM3 - along_BM3 * (along_BM3 * axis_BM3).sum(-1, keepdims=True))
    views = (along_BM3, axis_BM3, cross(along_BM3, axis_BM3))
    view_BM3 = np.stack([(seen_BM3 * axis).sum(-1) for axis in views], axis=-1)
    several = (vector_BI3, bend_BW3, cosine_BO, view_BM3)
    flat = [numbers.reshape(batch, math.prod(numbers.shape[1:])).astype(np.float32) for numbers in several]
    return (np.concatenate(flat, axis=1) - f.center_F) * f.scale_F


def _branched(stage: tuple[Part, ...], x_BI: np.ndarray, residual: bool) -> np.ndarray:
    found = np.empty((len(x_BI), sum(len(part.output) for part in stage)), np.float32)
    for part in stage:
        (weight, bias), *others = part.layers
        x = x_BI[:, part.input] @ weight.T + bias
        for number, (weight, bias) in enumerate(others):
            y = gelu(x) @ weight.T
            y += bias
            x = x + y if residual and number < len(others) - 1 else y
        found[:, part.output] = x
    return found


def mlp(layers: Layers, x_BI: np.ndarray, act: Activation) -> np.ndarray:
    """A multilayer perceptron of the body prior."""
    for number, (weight, bias) in enumerate(layers):
        x_BI = act(x_BI) @ weight.T + bias if number else x_BI @ weight.T + bias
    return x_BI
