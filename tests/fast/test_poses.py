"""What a retargeter without PyTorch is given: tensors and lists of all kinds, rates and numbers of steps."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch

from mrhubo.errors import UserError
from mrhubo.fast import FastRetargeter, FastStream
from mrhubo.fast.engines import FORMS
from mrhubo.retargeter import Retargeter
from mrhubo.streaming import Stream


@pytest.fixture(scope="module")
def fast(make: Callable[[str], Retargeter]) -> FastRetargeter:
    return FastRetargeter(make("nao").describe(), "numpy")


@pytest.mark.parametrize(
    "made", [lambda t: t.requires_grad_(), lambda t: t.double().requires_grad_(), lambda t: t.bfloat16()]
)
def test_tensors_that_numpy_does_not_take_as_they_are(
    fast: FastRetargeter, array: np.ndarray, made: Callable[[torch.Tensor], torch.Tensor]
) -> None:
    sixd = torch.from_numpy(array[:3, ..., :2].swapaxes(-1, -2).reshape(3, 21, 6).copy())
    given = made(sixd)
    wanted = fast(given.detach().float().numpy())
    np.testing.assert_array_equal(fast(given).q, wanted.q)
    np.testing.assert_array_equal(FastStream(fast)(given[0]).q, FastStream(fast)(given[0].detach().float().numpy()).q)


@pytest.mark.parametrize(
    "given", [[[1.0], [2.0, 3.0]], torch.zeros(2, 63, device="meta"), torch.zeros(2, 63).to_sparse()]
)
def test_what_is_no_array_is_refused(fast: FastRetargeter, given: Any) -> None:
    stream = FastStream(fast)
    for take in (fast, fast.predict, fast.directions, fast.imitate, stream, stream.reset):
        with pytest.raises(UserError, match="expected a Motion or an array of numbers, found (list|Tensor)"):
            take(given)
    with pytest.raises(UserError, match="directions must be numbers of the shape"):
        fast.imitate("up")


@pytest.mark.parametrize("rate", [1e-300, 1e-4, 2e6, 1e300, 10**400])
def test_a_rate_with_which_nobody_can_reckon_is_refused(
    make: Callable[[str], Retargeter], fast: FastRetargeter, array: np.ndarray, rate: float
) -> None:
    for take in (make("nao"), fast):
        with pytest.raises(UserError, match="the frame rate must be from 0.001 to 1,000,000 a second, found "):
            take(array, frame_rate=rate)
    for begin in (lambda: Stream(make("nao"), rate), lambda: FastStream(fast, rate)):
        with pytest.raises(UserError, match="the frame rate must be from 0.001 to 1,000,000 a second"):
            begin()


@pytest.mark.parametrize("rate", [1e-3, 1e6, np.float32(60), np.int64(60)])
def test_the_rates_at_the_ends_have_answers(
    make: Callable[[str], Retargeter], fast: FastRetargeter, array: np.ndarray, rate: float
) -> None:
    assert torch.isfinite(make("nao")(array[:6], frame_rate=rate).q).all()
    assert np.isfinite(fast(array[:6], frame_rate=rate).q).all()


def test_a_number_of_steps_may_be_numpys(
    make: Callable[[str], Retargeter], fast: FastRetargeter, array: np.ndarray
) -> None:
    for take in (make("nao"), fast):
        np.testing.assert_array_equal(np.asarray(take(array, np.int64(2)).q), np.asarray(take(array, 2).q))
        with pytest.raises(UserError, match="polish must be 0 or more steps, at most 1,000,000, found 10{20}"):
            take(array, 10**20)


def test_numbers_that_are_masked_are_missing(
    make: Callable[[str], Retargeter], fast: FastRetargeter, array: np.ndarray
) -> None:
    masked = np.ma.masked_array(array[:3], mask=np.zeros_like(array[:3], bool))
    for take in (make("nao"), fast):
        np.testing.assert_array_equal(np.asarray(take(masked).q), np.asarray(take(array[:3]).q))
    masked[1, 4] = np.ma.masked
    for take in (make("nao"), fast):
        with pytest.raises(UserError, match="human pose 1 holds NaN"):
            take(masked)
    for stream in (Stream(make("nao")), FastStream(fast)):
        assert np.all(np.asarray(stream(masked[0]).confidence) > 0) and not np.any(
            np.asarray(stream(masked[1]).confidence)
        )


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_numpys_matrices_are_arrays(fast: FastRetargeter) -> None:
    np.testing.assert_array_equal(fast(np.matrix(np.zeros((2, 63)))).q, fast(np.zeros((2, 63))).q)


@pytest.mark.parametrize("form", FORMS)
def test_retargeters_and_streams_go_to_other_processes(
    make: Callable[[str], Retargeter], array: np.ndarray, form: str
) -> None:
    if form == "compiled":
        pytest.importorskip("numba")
    retargeter = FastRetargeter(make("nao").describe(), form)
    wanted, stream = retargeter(array[:4], frame_rate=60.0), FastStream(retargeter)
    stream(array[0])
    there, streaming = pickle.loads(pickle.dumps((retargeter, stream)))
    np.testing.assert_array_equal(there(array[:4], frame_rate=60.0).q, wanted.q)
    np.testing.assert_array_equal(streaming(array[1]).q, stream(array[1]).q)


def test_what_an_answer_tells_of_the_robot_is_not_the_retargeters_own(
    make: Callable[[str], Retargeter], fast: FastRetargeter, array: np.ndarray
) -> None:
    for facts in (make("nao")(array[0]).robot_motion.robot, fast(array[0]).robot):
        for limit_N in (facts.lower, facts.upper, facts.velocity):
            assert limit_N is not None
            with pytest.raises(ValueError, match="read-only"):
                limit_N[:] = 0
    assert not np.shares_memory(make("nao").facts.lower, make("nao").body_map.robot.lower_N.numpy())


def test_what_is_no_floor_no_time_and_no_settings_is_refused_in_a_sentence(
    make: Callable[[str], Retargeter], fast: FastRetargeter, array: np.ndarray
) -> None:
    kinds: list[tuple[Any, Any]] = [(Stream, make("nao")), (FastStream, fast)]
    for of, given in kinds:
        assert of(given, floor=np.float32(0.5)).floor == 0.5
        wrong: list[tuple[str, Any]] = [("floor", True), ("floor", 10**400), ("floor", np.nan), ("settings", {"a": 1})]
        for name, value in wrong:
            with pytest.raises(UserError, match=f"stream: (the )?{name}('s height)? must be"):
                of(given, **{name: value})
        with pytest.raises(UserError, match="stream: expected a retargeter"):
            of("package")
        stream = of(given)
        for time in (10**400, True, "1", np.nan):
            with pytest.raises(UserError, match="the time of a frame must be a number"):
                stream(array[0], time=time)
