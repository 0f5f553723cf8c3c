"""Capsules: what shapes become, and where two of them are nearest."""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

from mrhubo.robot.shapes import LinkGeometry

SHORT = 1e-9
Capsule = tuple[np.ndarray, np.ndarray, float]
"""The ends (3,) of its axis and its radius, all in m."""


def closest_points(a_23: Tensor, b_23: Tensor) -> tuple[Tensor, Tensor]:
    """The points (..., 3) where segments a and b (..., 2, 3) are nearest; a segment may be a point.

    C. Ericson, Real-Time Collision Detection (2005), section 5.1.9, without branches.
    """
    start_a, start_b = a_23[..., 0, :], b_23[..., 0, :]
    along_a, along_b, r = a_23[..., 1, :] - start_a, b_23[..., 1, :] - start_b, start_a - start_b
    a, e, b = along_a.square().sum(-1), along_b.square().sum(-1), (along_a * along_b).sum(-1)
    c, f = (along_a * r).sum(-1), (along_b * r).sum(-1)
    safe_a, safe_e = a.clamp_min(SHORT), e.clamp_min(SHORT)
    # Nearly parallel segments have no one answer; any point of a will do, the other end follows from it.
    determinant = a * e - b * b
    s = torch.where(determinant > 1e-7 * a * e, (b * f - c * e) / determinant.clamp_min(SHORT * SHORT), 0.0)
    t = ((b * s.clamp(0, 1) + f) / safe_e).clamp(0, 1)
    s = ((b * t - c) / safe_a).clamp(0, 1)
    t = ((b * s + f) / safe_e).clamp(0, 1)
    return start_a + s[..., None] * along_a, start_b + t[..., None] * along_b


def capsules(shape: LinkGeometry, pose_44: np.ndarray) -> list[Capsule]:
    """Capsules (start (3,), end (3,), radius) around a shape whose centre is at the pose."""
    centre_3, axes_33 = pose_44[:3, 3], pose_44[:3, :3]
    if shape.kind != "box":
        half_3 = 0.5 * (shape.size[1] if len(shape.size) == 2 else 0.0) * axes_33[:, 2]
        return [(centre_3 - half_3, centre_3 + half_3, shape.size[0])]
    thin, wide, long = np.argsort(shape.size)
    count = max(1, math.ceil(shape.size[wide] / max(shape.size[thin], 0.1 * shape.size[wide])))
    step = shape.size[wide] / count
    radius = 0.5 * math.hypot(shape.size[thin], step)
    half_3 = max(0.0, 0.5 * shape.size[long]) * axes_33[:, long]
    centres = [centre_3 + ((k + 0.5) * step - 0.5 * shape.size[wide]) * axes_33[:, wide] for k in range(count)]
    return [(centre - half_3, centre + half_3, radius) for centre in centres]
