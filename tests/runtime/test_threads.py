"""Threads are counted, and the user's number counts more."""

from __future__ import annotations

import threading

import pytest
import torch

from mrhubo.fast.side_by_side import available_cores, wanted_threads
from mrhubo.runtime.threads import each_in_a_thread, use_threads


@pytest.mark.parametrize(
    ("given", "threads"),
    [(None, available_cores()), ("", available_cores()), ("3", 3), ("4,2", 4), ("x", available_cores()), ("0", available_cores())],
)  # fmt: skip
def test_the_users_number_counts(monkeypatch: pytest.MonkeyPatch, given: str | None, threads: int) -> None:
    monkeypatch.delenv("TORCHELASTIC_RUN_ID", raising=False)
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    if given is not None:
        monkeypatch.setenv("OMP_NUM_THREADS", given)
    assert wanted_threads() == threads
    before = torch.get_num_threads()
    with use_threads():
        assert torch.get_num_threads() == threads
    with use_threads(2):
        assert torch.get_num_threads() == 2
    assert torch.get_num_threads() == before


def test_what_torchrun_sets_by_itself_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TORCHELASTIC_RUN_ID", "a")
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert wanted_threads() == available_cores()
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    assert wanted_threads() == 3


@pytest.mark.parametrize("threads", [2, 1, 3])  # what was wanted before does not count
def test_items_are_worked_on_side_by_side_with_one_thread_each(monkeypatch: pytest.MonkeyPatch, threads: int) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", str(threads))
    met = threading.Barrier(threads, timeout=120)

    def work(item: str) -> tuple[str, int]:
        if item != "cc" or threads != 2:  # two do not share three evenly
            met.wait()  # as many at once as there are threads, or nobody goes on
        return item.upper(), torch.get_num_threads()

    before = torch.get_num_threads()
    with use_threads(threads):
        assert each_in_a_thread(work, ["a", "bbb", "cc"]) == [("A", 1), ("BBB", 1), ("CC", 1)]
        assert torch.get_num_threads() == threads
    assert torch.get_num_threads() == before


def test_what_fails_in_a_thread_fails() -> None:
    def work(item: str) -> str:
        if item == "bb":
            raise ValueError(item)
        return item

    with use_threads(2), pytest.raises(ValueError, match="bb"):
        each_in_a_thread(work, ["a", "bb", "ccc"])
