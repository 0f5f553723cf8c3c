"""Every form in which poses come means the same pose, and a bad one is named with its frame."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from mrhubo.errors import UserError
from mrhubo.motion import Motion, poses, read_poses
from mrhubo.rotation import axis_angle_to_matrix, matrix_to_axis_angle, matrix_to_sixd

LEADING = st.lists(st.integers(0, 3), max_size=3).map(tuple)


@st.composite
def axis_angles(draw: st.DrawFn) -> np.ndarray:
    shape = (*draw(LEADING), 63)
    return draw(arrays.arrays(np.float64, shape, elements=st.floats(-6.0, 6.0, width=32)))


@given(axis_angles(), st.sampled_from([np.float32, np.float64]), st.booleans())
def test_the_three_forms_agree_for_any_leading_axes(turns: np.ndarray, dtype: type, as_torch: bool) -> None:
    matrices = axis_angle_to_matrix(torch.from_numpy(turns).unflatten(-1, (21, 3)))
    forms = [turns, matrices.numpy(), matrix_to_sixd(matrices).numpy()]
    for array in (form.astype(dtype) for form in forms):
        found = read_poses(torch.from_numpy(array) if as_torch else array)
        assert found.shape == turns.shape[:-1] and found.frame_rate is None
        assert found.local_TJ33.shape == (math.prod(found.shape), 21, 3, 3)
        assert found.local_TJ33.dtype == torch.float32
        expected = matrices.reshape(-1, 21, 3, 3).float()
        torch.testing.assert_close(found.local_TJ33, expected, atol=2e-5, rtol=0)


def test_a_motion_is_taken_as_it_is() -> None:
    motion = Motion("turn", axis_angle_to_matrix(torch.linspace(0, 3, 4 * 63).reshape(4, 21, 3)), 30.0)
    found = read_poses(motion)
    assert found.frame_rate == 30.0 and found.shape == (4,) and torch.equal(found.local_TJ33, motion.local_TJ33)


def test_views_and_whole_numbers_do_too() -> None:
    turns = np.zeros((5, 63), dtype=np.int64)
    turns[:, 0] = np.arange(5)
    turns.flags.writeable = False
    assert torch.equal(read_poses(turns[::-1]).local_TJ33, read_poses(turns).local_TJ33.flip(0))


@pytest.mark.parametrize("dtype", [">f4", np.float16, np.longdouble, np.uint16, "<i2"])
def test_any_type_of_number_and_lists_do_too(dtype: object) -> None:
    turns = np.zeros((5, 63), dtype)
    turns[:, 0] = np.arange(5)
    expected = read_poses(np.asarray(turns, np.float64)).local_TJ33
    for array in (turns, turns.tolist(), list(turns), tuple(map(tuple, turns))):
        torch.testing.assert_close(read_poses(array).local_TJ33, expected)
    motion = Motion("a", expected.tolist(), 30)  # type: ignore[arg-type]
    assert torch.equal(read_poses(motion).local_TJ33, expected)


def test_many_frames_in_degrees_are_told_from_radians(root: Path) -> None:
    with np.load(root / "data" / "motions" / "wave.npz") as content:
        turns = content["pose_body"]
    read_poses(turns)
    small = turns * 15 / np.linalg.norm(turns.reshape(-1, 21, 3), axis=-1).max()
    with pytest.raises(UserError, match=r"no axis-angle in radians \(degrees\?\)"):
        read_poses(small)


@pytest.mark.parametrize("value", [1e200, 1e39, 3e38, 1e-200])
def test_numbers_beyond_single_precision_are_named(value: float) -> None:
    for array in (
        torch.full((3, 21, 3, 3), value, dtype=torch.float64),
        torch.full((3, 21, 6), value, dtype=torch.float64),
    ):
        with pytest.raises(UserError, match="human pose 0 holds"):
            read_poses(array)


@pytest.mark.parametrize("length", [3, 7, 8])
def test_long_arrays_are_read_part_by_part(monkeypatch: pytest.MonkeyPatch, length: int) -> None:
    matrices = axis_angle_to_matrix(torch.randn(2, 7, 21, 3, generator=torch.Generator().manual_seed(0)))
    forms = [matrices, matrix_to_sixd(matrices), matrix_to_axis_angle(matrices).flatten(2)]
    whole = [read_poses(form).local_TJ33 for form in forms]
    monkeypatch.setattr(poses, "_CHUNK", length)
    for form, expected in zip(forms, whole, strict=True):
        assert torch.equal(read_poses(form).local_TJ33, expected)
    bad = matrices.clone()
    bad[1, 5, 3] = torch.nan
    with pytest.raises(UserError, match=r"human pose \(1, 5\) holds NaN"):
        read_poses(bad)


def identity(*leading: int) -> torch.Tensor:
    return torch.eye(3).expand(*leading, 21, 3, 3).clone()


def bad(leading: tuple[int, ...], where: tuple[int, ...], value: torch.Tensor | float) -> torch.Tensor:
    made = identity(*leading)
    made[where] = torch.as_tensor(value)
    return made


MIRROR, STRETCH = torch.diag(torch.tensor([1.0, 1.0, -1.0])), 1.1 * torch.eye(3)


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (torch.zeros(5, 20, 6), r"\(\.\.\., 21, 3, 3\).*\(\.\.\., 63\).*\(\.\.\., 21, 6\).*found \(5, 20, 6\)"),
        (torch.zeros(5, 21, 3), r"found \(5, 21, 3\)"),
        (np.zeros(()), r"found \(\)"),
        (np.array([["a"] * 63]), "a NumPy or torch array of numbers, found an array of <U1"),
        (np.array([[None] * 63]), "found an array of object"),
        (np.zeros((2, 63), dtype=complex), "found an array of complex128"),
        (torch.zeros(2, 63, dtype=torch.bool), "found an array of torch.bool"),
        ([[0.0] * 63, [0.0] * 62], "expected a Motion.*found list"),
        ("wave.npz", "expected a Motion.*found str"),
        (torch.zeros(2, 63, device="meta"), "found an array of torch.float32"),
        (bad((9,), (4, 3), torch.nan), "human pose 4 holds NaN or infinite numbers"),
        (bad((2, 9), (1, 7, 3), torch.inf), r"human pose \(1, 7\) holds NaN"),
        (bad((), (3,), torch.nan), "human pose holds NaN"),
        (bad((9,), (5, 20), MIRROR), "human pose 5 holds a matrix that is no rotation"),
        (bad((9,), (6, 20), STRETCH), "human pose 6 holds a matrix that is no rotation"),
        (bad((9,), (7, 0), torch.zeros(3, 3)), "human pose 7 holds a matrix that is no rotation"),
        (matrix_to_sixd(bad((9,), (2, 1), 0.0)), "human pose 2 holds six numbers that are no rotation"),
        (matrix_to_sixd(bad((9,), (3, 1), torch.ones(3, 3))), "human pose 3 holds six numbers that are no rotation"),
        (np.full((3, 63), 90.0), "human pose 0 holds no axis-angle in radians"),
    ],
)
def test_what_is_no_pose_is_named(array: object, message: str) -> None:
    with pytest.raises(UserError, match=message):
        read_poses(array)  # type: ignore[arg-type]


@pytest.mark.parametrize("rate", [0.0, -24.0, math.nan, math.inf, "24", [24.0], True])
def test_a_frame_rate_is_positive(rate: float) -> None:
    with pytest.raises(UserError, match="frame rate must be a positive number"):
        read_poses(identity(2), rate)
