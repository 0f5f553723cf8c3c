"""One rotation at a time is what functions of many say of it."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.fast.rotations import axis_angle_to_matrix, matrix_to_axis_angle, quaternion_to_matrix
from mrhubo.live.turns import quaternion_of, rotation_of, turn_of, turns_of

ANGLES = [0.0, 1e-13, 1e-10, 1e-6, 0.3, 3.0, np.pi - 1e-6, np.pi - 1e-10, np.pi]


@pytest.mark.parametrize("angle", ANGLES)
def test_one_by_one_as_many(angle: float) -> None:
    generator = np.random.default_rng(2)
    axis_R3 = generator.normal(size=(20, 3))
    turn_R3 = angle * axis_R3 / np.linalg.norm(axis_R3, axis=1, keepdims=True)
    matrix_R33 = axis_angle_to_matrix(turn_R3)
    for turn_3, matrix_33 in zip(turn_R3, matrix_R33, strict=True):
        np.testing.assert_allclose(rotation_of(turn_3), matrix_33, atol=1e-12)
        found_3, wanted_3 = turn_of(matrix_33), matrix_to_axis_angle(matrix_33)
        np.testing.assert_allclose(rotation_of(found_3), rotation_of(wanted_3), atol=1e-6)
        near_4 = generator.normal(size=4)
        wxyz_4 = quaternion_of(matrix_33, near_4)
        np.testing.assert_allclose(quaternion_to_matrix(wxyz_4[[1, 2, 3, 0]]), matrix_33, atol=1e-6)
        assert np.linalg.norm(wxyz_4) == pytest.approx(1, abs=1e-12) and wxyz_4 @ near_4 >= 0
        assert quaternion_of(matrix_33)[0] >= -1e-12
    np.testing.assert_array_equal(turns_of(matrix_R33)[3], turn_of(matrix_R33[3]))
