"""Rigid motions in the forms that viewers and files have them in. Quaternions are unit, w first."""

from __future__ import annotations

import numpy as np
import torch

from mrhubo import rotation


def to_wxyz(rotation_X33: np.ndarray) -> np.ndarray:
    """Rotations (..., 3, 3) as quaternions (..., 4)."""
    return rotation.matrix_to_quaternion(torch.from_numpy(np.asarray(rotation_X33, float))).numpy()[..., [3, 0, 1, 2]]


def from_wxyz(quaternion_X4: np.ndarray) -> np.ndarray:
    """Quaternions (..., 4) as rotations (..., 3, 3)."""
    xyzw_X4 = np.asarray(quaternion_X4, float)[..., [1, 2, 3, 0]]
    return rotation.quaternion_to_matrix(torch.from_numpy(xyzw_X4)).numpy()


def poses(place_X3: np.ndarray, rotation_X33: np.ndarray) -> np.ndarray:
    """Poses (..., 4, 4) of places (..., 3) and rotations (..., 3, 3)."""
    found_X44 = np.tile(np.eye(4), (*place_X3.shape[:-1], 1, 1))
    found_X44[..., :3, :3], found_X44[..., :3, 3] = rotation_X33, place_X3
    return found_X44


def headings(rotation_X33: np.ndarray) -> np.ndarray:
    """Angles [rad] about z of the part of rotations (..., 3, 3) that turns about z (twist, and not swing): a bow far
    beyond the level changes it by nothing.
    """
    quaternion_X4 = to_wxyz(rotation_X33)
    return 2 * np.arctan2(quaternion_X4[..., 3], quaternion_X4[..., 0])


def about_z(angle_X: np.ndarray) -> np.ndarray:
    """Rotations (..., 3, 3) about z by angles (...) [rad]."""
    angle_X = np.asarray(angle_X, float)
    found_X33 = np.tile(np.eye(3), (*angle_X.shape, 1, 1))
    cosine_X, sine_X = np.cos(angle_X), np.sin(angle_X)
    found_X33[..., 0, 0], found_X33[..., 0, 1] = cosine_X, -sine_X
    found_X33[..., 1, 0], found_X33[..., 1, 1] = sine_X, cosine_X
    return found_X33
