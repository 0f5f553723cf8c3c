"""Work in threads gives what it gives one after the other."""

from __future__ import annotations

import os
import threading
import time

import pytest

from mrhubo.fast.side_by_side import available_cores, in_parts, side_by_side


@pytest.fixture(autouse=True)
def _a_thread_a_core(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)  # which tests that run side by side set to 1


def test_the_users_number_of_threads_is_kept_to(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert set(side_by_side(lambda _: threading.get_ident(), range(50))) == {threading.get_ident()}
    assert in_parts(1000, lambda part: part) == [slice(0, 1000)]


def test_results_are_in_the_order_of_the_items() -> None:
    def work(number: int) -> int:
        time.sleep(0.001 * (7 * number % 5))
        return number * number

    assert side_by_side(work, range(40)) == [number * number for number in range(40)]
    assert side_by_side(work, []) == []


@pytest.mark.skipif(available_cores() < 2, reason="one core: nothing goes side by side")
def test_it_goes_in_threads_of_which_the_callers_is_one() -> None:
    both = threading.Barrier(2, timeout=120)

    def work(_: int) -> str:
        both.wait()  # is passed by two threads at a time alone
        return threading.current_thread().name

    names = side_by_side(work, range(2))
    assert len(set(names)) == 2 and threading.current_thread().name in names


def test_work_may_be_done_side_by_side_itself() -> None:
    def sums(number: int) -> int:
        return sum(side_by_side(lambda other: number * other, range(10)))

    def more(number: int) -> int:
        return sum(side_by_side(sums, range(number)))

    assert side_by_side(more, range(20)) == [45 * sum(range(number)) for number in range(20)]


def test_what_goes_wrong_is_raised_and_ends_the_work() -> None:
    begun: list[int] = []

    def work(number: int) -> None:
        begun.append(number)
        time.sleep(0.01)
        if number == 3:
            raise ValueError("three")

    with pytest.raises(ValueError, match="three"):
        side_by_side(work, range(1_000))
    assert len(begun) < 10 + available_cores()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own() -> None:
    side_by_side(abs, range(10))
    child = os.fork()
    if child == 0:
        os._exit(0 if side_by_side(abs, range(-9, 1)) == list(range(9, -1, -1)) else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
