"""Threads are counted, and the user's number counts more."""

from __future__ import annotations

import pytest
import torch

from mrhubo.fast.side_by_side import available_cores, wanted_threads
from mrhubo.runtime.threads import use_threads


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
