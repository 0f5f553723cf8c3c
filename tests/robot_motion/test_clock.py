"""Frame rates of times as files write them: rounded, cut off, or to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrhubo.robot_motion import read_robot_motion
from mrhubo.robot_motion.clock import find_rate, in_full, nanoseconds, rate_of_step, rate_of_times, seconds, usual_rates

NTSC = [rate * 1000 / 1001 for rate in (24, 30, 60)]
USUAL = [12, 15, 24, 25, 30, 48, 50, 60, 90, 100, 120, 144, 200, 240, *NTSC]


@given(rate=st.one_of(st.integers(1, 240), st.sampled_from(NTSC)), places=st.integers(7, 12), cut=st.booleans())
def test_a_usual_rate_comes_back_from_its_step(rate: float, places: int, cut: bool) -> None:
    step = f"{1 / rate:.{places}f}" if not cut else f"{1 / rate:.15f}"[: places - 15]
    assert rate_of_step(step) == rate_of_step(f" {Decimal(step):e} ") == rate


@pytest.mark.parametrize(
    ("step", "rate"),
    [
        ("0.033", 30), ("0.017", 60), ("0.0083", 120), ("0.0417", 24), ("0.041666", 24), ("0.0111111", 90),
        ("0.03333333507180214", 30), ("0.0333333351", 30),  # float32
        ("0.00418392536", 239.01), ("0.016", 62.5), ("0.0256", 39.0625), ("0.008", 125), ("0.03", 1 / 0.03), ("4", 0.25),
        ("0", None), ("-1", None), ("nan", None), ("inf", None), ("1e-400", None), ("1e300", 1e-300), ("1e-300", 1e300),
    ],
)  # fmt: skip
def test_steps(step: str, rate: float | None) -> None:
    assert rate_of_step(step) == rate


@given(digits=st.integers(1, 10**7), places=st.integers(0, 9))
def test_a_rate_has_the_step_that_is_written(digits: int, places: int) -> None:
    """To half a unit of the last digit, or to one where it is cut off; or as float32."""
    step = Decimal(digits).scaleb(-places)
    rate = rate_of_step(str(step))
    assert rate is not None
    unit = max(10**-places, float(step) * 2**-22)
    assert -0.500001 < (1 / rate - float(step)) / unit < 1


def test_what_is_no_number_is_refused() -> None:
    with pytest.raises(ValueError):
        rate_of_step("x")


def rounded(places: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda time_T: np.round(time_T, places)


def cut(places: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda time_T: np.floor(time_T * 10**places + 1e-6) / 10**places


CLOCKS = [
    lambda time_T: time_T,
    lambda time_T: time_T + 1.7e9,  # since 1970
    lambda time_T: time_T.astype(np.float32),
    lambda time_T: time_T.astype(np.float32).astype(str).astype(float),
    lambda time_T: np.arange(len(time_T)) * round(time_T[1], 7),
    rounded(4), rounded(6), rounded(9), cut(4), cut(6), lambda time_T: rounded(4)(time_T) + 12.3456,
]  # fmt: skip


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("rate", USUAL)
def test_a_usual_rate_comes_back_from_times(rate: float, clock: Callable[[np.ndarray], np.ndarray]) -> None:
    assert find_rate(clock(np.arange(300) / rate), seconds) == pytest.approx(rate, rel=1e-14)


@pytest.mark.parametrize("rate", USUAL)
def test_a_usual_rate_comes_back_from_whole_nanoseconds(rate: float) -> None:
    frame_T = np.arange(300)
    exact_T = frame_T * (1e9 / rate)
    micro_T = np.rint(exact_T / 1000).astype(np.int64) * 1000
    for time_T in (exact_T.astype(np.int64), frame_T * int(exact_T[1]), micro_T, micro_T + 1_700_000_000_123_456_789):
        assert find_rate(time_T, nanoseconds) == rate


@pytest.mark.parametrize("rate", [29.97, 59.94, 239.01, 62.5, 1000 / 7, 100 / 3, 1000 / 12, 19.53125])
def test_an_odd_rate_stays_what_it_is(rate: float) -> None:
    assert find_rate(np.arange(300) / rate, seconds) == pytest.approx(rate, rel=1e-15)
    assert find_rate(nanoseconds(np.arange(300), rate), nanoseconds) == pytest.approx(rate, rel=1e-9)


def test_milliseconds_that_repeat_are_no_rounded_ones() -> None:
    assert find_rate(np.array([0.0, 0.033, 0.067, 0.1]), seconds) == 30
    assert find_rate(np.arange(4) * 0.033, seconds) == pytest.approx(1 / 0.033)
    assert rate_of_times(np.array([0, 17, 33, 50]) * 1_000_000, nanoseconds) == 60


def test_a_table_of_another_program_has_the_rate_that_it_means(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time [s],a [rad]\n0,0\n0.0333333,0\n0.0666667,0\n")
    assert read_robot_motion(path).frame_rate == 30


def test_a_rate_is_told_in_full() -> None:
    assert [in_full(rate) for rate in (30.0, 30.00003, 29.97, 1e-7)] == ["30", "30.00003", "29.97", "1e-07"]


@pytest.mark.parametrize(
    ("step", "rates"),
    [
        ("0.03", {30}), ("0.008", {120}), ("0.02", {50, 60}), ("0.04", {24, 25}), ("0.01", {100, 120}), ("0.033", set()),
        ("0.0083", set()), ("0.0333333", set()), ("0", set()), ("nan", set()), ("0.009", set()),
    ],
)  # fmt: skip
def test_a_single_digit_may_be_the_step_of_several_rates(step: str, rates: set[int]) -> None:
    assert rates <= set(usual_rates(step)) and (bool(rates) or not usual_rates(step))
