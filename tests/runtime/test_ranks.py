"""How a job is recognised; how ranks really work together is tested where they do (test_pair, test_fit)."""

from __future__ import annotations

import pytest

from mrhubo.runtime.ranks import Ranks, _job_shape

VARIABLES = ("TORCHELASTIC_RUN_ID", "WORLD_SIZE", "LOCAL_WORLD_SIZE", "SLURM_NTASKS", "SLURM_NNODES", "SLURM_PROCID")


@pytest.mark.parametrize(
    ("environment", "expected"),
    [
        ({}, None),
        ({"TORCHELASTIC_RUN_ID": "none", "WORLD_SIZE": "8", "LOCAL_WORLD_SIZE": "4"}, (2, 4)),
        ({"TORCHELASTIC_RUN_ID": "none", "WORLD_SIZE": "1", "LOCAL_WORLD_SIZE": "1"}, None),
        ({"SLURM_NTASKS": "64", "SLURM_NNODES": "8", "SLURM_PROCID": "3", "SLURM_JOB_NAME": "pairs"}, (8, 8)),
        ({"SLURM_NTASKS": "4", "SLURM_NNODES": "1", "SLURM_PROCID": "0", "SLURM_JOB_NAME": "bash"}, None),
        ({"SLURM_NTASKS": "4", "SLURM_NNODES": "1"}, None),
    ],
)
def test_jobs_are_recognised(
    environment: dict[str, str], expected: tuple[int, int] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in (*VARIABLES, "SLURM_JOB_NAME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert _job_shape() == expected


def test_alone_there_is_nothing_to_wait_for() -> None:
    ranks = Ranks()
    ranks.wait()
    assert ranks.gather([4, 1], 6) == [1, 4] and ranks.gather([], 3) == []
