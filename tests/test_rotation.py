"""Round trips, group axioms, and gradients at the two angles where careless formulas give NaN."""

from __future__ import annotations

import math

import pytest
import torch
from scipy.spatial.transform import Rotation

from mrhubo import rotation


def random_axis_angle(count: int, angle: float | None = None) -> torch.Tensor:
    generator = torch.Generator().manual_seed(0)
    axis = torch.nn.functional.normalize(torch.randn(count, 3, generator=generator, dtype=torch.float64), dim=-1)
    size = torch.rand(count, 1, generator=generator, dtype=torch.float64) * 3.1 if angle is None else angle
    return axis * size


def test_conversions_agree_with_scipy() -> None:
    vectors = random_axis_angle(200)
    expected = Rotation.from_rotvec(vectors.numpy())
    matrix = rotation.axis_angle_to_matrix(vectors)
    torch.testing.assert_close(matrix, torch.tensor(expected.as_matrix()))
    torch.testing.assert_close(rotation.matrix_to_axis_angle(matrix), vectors)
    quaternion = rotation.matrix_to_quaternion(matrix)
    torch.testing.assert_close(quaternion.abs(), torch.tensor(expected.as_quat()).abs())
    torch.testing.assert_close(rotation.quaternion_to_matrix(3 * quaternion), matrix)


def test_sixd_is_the_first_two_columns_one_after_the_other() -> None:
    matrix = rotation.axis_angle_to_matrix(random_axis_angle(1))[0]
    expected = torch.cat((matrix[:, 0], matrix[:, 1]))
    torch.testing.assert_close(rotation.matrix_to_sixd(matrix), expected)


def test_sixd_round_trip_and_projection() -> None:
    matrix = rotation.axis_angle_to_matrix(random_axis_angle(100))
    torch.testing.assert_close(rotation.sixd_to_matrix(rotation.matrix_to_sixd(matrix)), matrix)
    projected = rotation.sixd_to_matrix(torch.randn(100, 6, dtype=torch.float64))
    identity = torch.eye(3, dtype=torch.float64).expand(100, 3, 3)
    torch.testing.assert_close(projected @ projected.mT, identity)
    torch.testing.assert_close(torch.linalg.det(projected), torch.ones(100, dtype=torch.float64))


@pytest.mark.parametrize("apart", [1e-1, 1e-2, 1e-3])
def test_nearly_parallel_halves_still_give_a_rotation_in_float32(apart: float) -> None:
    first, other = torch.randn(2, 500, 3, generator=torch.Generator().manual_seed(0))
    matrix = rotation.sixd_to_matrix(torch.cat((first, -2 * first + apart * other), dim=-1))
    oblique = (matrix[..., 0] * matrix[..., 1]).sum(-1).abs()
    assert float(oblique.max()) < 2e-6


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 0.5, 3.0, math.pi - 1e-7, math.pi])
def test_geodesic_distance_is_the_angle(angle: float) -> None:
    turn = rotation.axis_angle_to_matrix(random_axis_angle(50, angle))
    base = rotation.axis_angle_to_matrix(random_axis_angle(50).flip(0))
    expected = torch.full((50,), angle, dtype=torch.float64)
    torch.testing.assert_close(rotation.geodesic_distance(base, base @ turn), expected, atol=1e-7, rtol=0)


def test_geodesic_distance_is_a_metric() -> None:
    a, b, c = (rotation.axis_angle_to_matrix(random_axis_angle(60))[i::3] for i in range(3))
    distance = rotation.geodesic_distance
    torch.testing.assert_close(distance(a, b), distance(b, a))
    assert bool((distance(a, c) <= distance(a, b) + distance(b, c) + 1e-9).all())


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, math.pi - 1e-6, math.pi])
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_gradients_are_finite_at_zero_and_at_pi(angle: float, dtype: torch.dtype) -> None:
    vectors = random_axis_angle(20, angle).to(dtype).requires_grad_()
    matrix = rotation.axis_angle_to_matrix(vectors)
    there_and_back = rotation.matrix_to_axis_angle(matrix)
    distance = rotation.geodesic_distance(torch.eye(3, dtype=dtype).expand_as(matrix), matrix)
    for value in (matrix, there_and_back, distance, rotation.sixd_to_matrix(rotation.matrix_to_sixd(matrix))):
        (gradient,) = torch.autograd.grad(value.sum(), vectors, retain_graph=True)
        assert bool(torch.isfinite(gradient).all())


def test_geodesic_gradient_of_equal_rotations_is_zero() -> None:
    matrix = torch.eye(3).expand(4, 3, 3).clone().requires_grad_()
    rotation.geodesic_distance(torch.eye(3).expand(4, 3, 3), matrix).sum().backward()
    assert matrix.grad is not None and bool(torch.isfinite(matrix.grad).all())


def test_wrap_angle() -> None:
    angle = torch.linspace(-20, 20, 401, dtype=torch.float64)
    wrapped = rotation.wrap_angle(angle)
    assert float(wrapped.min()) >= -math.pi and float(wrapped.max()) < math.pi
    torch.testing.assert_close(torch.sin(wrapped), torch.sin(angle))
    torch.testing.assert_close(torch.cos(wrapped), torch.cos(angle))
