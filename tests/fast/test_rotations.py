"""Rotations in NumPy are those of PyTorch."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mrhubo import rotation
from mrhubo.fast import rotations
from mrhubo.motion.poses import are_crooked

_ANGLES = (0.0, 1e-9, 1e-7, 1e-3, 1.0, 3.14159, np.pi, 4.0, 6.2)


@pytest.fixture(scope="module")
def axis_angles() -> np.ndarray:
    """About random axes, and about x, y and z."""
    axes = np.concatenate((np.random.default_rng(0).normal(size=(20, 3)), np.eye(3)))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    return np.array(_ANGLES)[:, None, None] * axes


@pytest.mark.parametrize(("kind", "most"), [(np.float64, 1e-12), (np.float32, 2e-6)])
def test_there_and_back(axis_angles: np.ndarray, kind: type, most: float) -> None:
    given = axis_angles.astype(kind)
    matrices, wanted = rotations.axis_angle_to_matrix(given), rotation.axis_angle_to_matrix(torch.from_numpy(given))
    assert matrices.dtype == kind and np.abs(matrices - wanted.numpy()).max() < most
    back = rotations.axis_angle_to_matrix(rotations.matrix_to_axis_angle(matrices))
    assert back.dtype == kind and np.abs(back - matrices).max() < 4 * most
    told = rotation.matrix_to_axis_angle(wanted).numpy()
    half = np.linalg.norm(told, axis=-1) < 3.1  # beyond, rounding decides to which side an axis points
    assert np.abs(rotations.matrix_to_axis_angle(matrices) - told)[half].max() < 100 * most


def test_nearly_rotations(axis_angles: np.ndarray) -> None:
    exact = rotations.axis_angle_to_matrix(axis_angles)
    noise = np.random.default_rng(1).normal(size=exact.shape)
    for share in (1e-9, 1e-3, 3e-3, 0.1):
        matrices = exact + share * noise
        wanted = rotation.orthonormal(torch.from_numpy(matrices)).numpy()
        np.testing.assert_allclose(rotations.orthonormal(matrices), wanted, atol=1e-12)
        np.testing.assert_array_equal(rotations.are_crooked(matrices), are_crooked(torch.from_numpy(matrices)))
    assert rotations.are_crooked(-exact).all() and rotations.are_crooked(np.full((3, 3), np.nan))
    assert rotations.are_crooked(exact + 0.1 * noise).all() and not rotations.are_crooked(exact).any()


def test_the_shortest_turn(axis_angles: np.ndarray) -> None:
    start, end = (x / np.linalg.norm(x, axis=-1, keepdims=True) for x in (axis_angles[5], axis_angles[5][::-1]))
    found = rotations.shortest_turn(start, end)
    np.testing.assert_allclose(rotations.turned(found, start), end, atol=1e-12)
    wanted = rotation.shortest_turn(torch.from_numpy(start), torch.from_numpy(end)).numpy()
    np.testing.assert_allclose(found, wanted, atol=1e-12)
    np.testing.assert_array_equal(rotations.shortest_turn(start, -start), np.broadcast_to(np.eye(3), found.shape))


def test_slerp(axis_angles: np.ndarray) -> None:
    turn_X3 = axis_angles[:5].astype(np.float32)  # further round, the shortest way is another one
    start_X33 = np.broadcast_to(rotations.axis_angle_to_matrix(np.float32([0.3, -1.0, 2.0])), (*turn_X3.shape, 3))
    end_X33 = start_X33 @ rotations.axis_angle_to_matrix(turn_X3)
    for share in (0.0, 0.3, 1.0):
        found = rotations.slerp(start_X33, end_X33, np.full(turn_X3.shape[:-1], share))
        wanted = start_X33 @ rotations.axis_angle_to_matrix(np.float32(share) * turn_X3)
        assert found.dtype == np.float32 and np.abs(found - wanted).max() < 1e-5


def test_quaternions(axis_angles: np.ndarray) -> None:
    quaternions = rotation.matrix_to_quaternion(rotation.axis_angle_to_matrix(torch.from_numpy(axis_angles)))
    wanted = rotation.quaternion_to_matrix(quaternions).numpy()
    np.testing.assert_allclose(rotations.quaternion_to_matrix(quaternions.numpy()), wanted, atol=1e-12)
