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


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_a_rotation_stays_and_an_oblique_matrix_becomes_one(dtype: torch.dtype) -> None:
    rounding = 4 * torch.finfo(dtype).eps + 1e-11  # 1e-12 keeps the square root of a column's length finite
    matrix = rotation.axis_angle_to_matrix(random_axis_angle(500)).to(dtype).unflatten(0, (20, 25))
    torch.testing.assert_close(rotation.orthonormal(matrix), matrix, atol=rounding, rtol=0)
    oblique = matrix + 0.1 * torch.randn(matrix.shape, generator=torch.Generator().manual_seed(1), dtype=dtype)
    mended = rotation.orthonormal(oblique)
    assert mended.shape == matrix.shape and mended.dtype == dtype
    identity = torch.eye(3, dtype=dtype).expand_as(mended)
    torch.testing.assert_close(mended.mT @ mended, identity, atol=rounding, rtol=0)
    torch.testing.assert_close(torch.linalg.det(mended), torch.ones(20, 25, dtype=dtype), atol=rounding, rtol=0)
    torch.testing.assert_close(rotation.orthonormal(mended), mended, atol=rounding, rtol=0)
    assert float((oblique.mT @ oblique - identity).abs().max()) > 0.1  # else the test shows nothing
    assert float(rotation.geodesic_distance(mended, matrix).max()) < 0.6  # it is near what was disturbed


def test_the_first_column_keeps_its_direction_and_the_second_its_plane() -> None:
    oblique = torch.randn(200, 3, 3, generator=torch.Generator().manual_seed(2), dtype=torch.float64)
    mended = rotation.orthonormal(oblique)
    first, second = torch.nn.functional.normalize(oblique, dim=-2).unbind(-1)[:2]
    torch.testing.assert_close(mended[..., 0], first, atol=1e-9, rtol=0)
    assert float((mended[..., 2] * second).sum(-1).abs().max()) < 1e-9
    assert bool(((mended[..., 1] * second).sum(-1) > 0).all())


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_stacked_columns_are_the_same_six_numbers(dtype: torch.dtype) -> None:
    """Bit for bit, rotation or not; where they are a rotation's, it is that rotation."""
    sixd = torch.randn(7, 40, 6, generator=torch.Generator().manual_seed(3), dtype=dtype)
    assert torch.equal(rotation.matrix_to_sixd(rotation.stack_columns(sixd)), sixd)
    matrix = rotation.axis_angle_to_matrix(random_axis_angle(200)).to(dtype)
    found = rotation.stack_columns(rotation.matrix_to_sixd(matrix))
    assert torch.equal(found[..., :2], matrix[..., :2])
    torch.testing.assert_close(found, matrix, atol=4 * torch.finfo(dtype).eps, rtol=0)


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


def test_the_shortest_turn_takes_one_vector_to_another_about_the_axis_across_both() -> None:
    start, end = (rotation.random_axes(200, generator=torch.Generator().manual_seed(seed)) for seed in (0, 1))
    turn = rotation.shortest_turn(start, end)
    torch.testing.assert_close((turn @ start[..., None])[..., 0], end, atol=1e-5, rtol=0)
    about = rotation.matrix_to_axis_angle(turn)
    torch.testing.assert_close((about * start).sum(-1), torch.zeros(200), atol=1e-4, rtol=0)
    torch.testing.assert_close(rotation.shortest_turn(start, start), torch.eye(3).expand(200, 3, 3))


def test_random_axes_are_unit_vectors_of_any_direction() -> None:
    found = rotation.random_axes(4_000, 2, generator=torch.Generator().manual_seed(0)).flatten(0, 1)
    torch.testing.assert_close(found.norm(dim=-1), torch.ones(8_000), atol=1e-6, rtol=0)
    torch.testing.assert_close(found.T @ found / 8_000, torch.eye(3) / 3, atol=0.02, rtol=0)
