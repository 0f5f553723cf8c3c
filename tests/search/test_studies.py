"""Studies: reproducible draws, exact numbers of trials, dead and interrupted processes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import optuna
import pytest

from mrhubo.errors import Unreachable, UserError
from mrhubo.search import open_study, open_trials, remaining, work_on


def objective(trial: optuna.Trial) -> float:
    return trial.suggest_float("x", -1, 1) ** 2 + trial.suggest_int("n", 0, 3)


@pytest.mark.parametrize("sampler", ["random", "tpe", "cmaes"])
def test_a_stopped_study_goes_on_as_it_would_have(tmp_path: Path, sampler: str) -> None:
    found = []
    for folder, parts in (("whole", [14]), ("stopped", [3, 12, 14])):
        for trials in parts:
            study = open_study(tmp_path / folder, None, "s", sampler, 5)
            work_on(study, objective, trials)
        found.append([trial.params for trial in study.trials])
    assert found[0] == found[1] and len(found[0]) == 14
    assert len({params["x"] for params in found[0]}) == 14


def test_an_interrupted_trial_is_drawn_again(tmp_path: Path) -> None:
    def stop(trial: optuna.Trial) -> float:
        value = objective(trial)
        if trial.number == 2:
            raise KeyboardInterrupt
        return value

    study = open_study(tmp_path, None, "s", "random", 0)
    with pytest.raises(KeyboardInterrupt):
        work_on(study, stop, 4)
    assert remaining(study, 4) == 2
    work_on(study, objective, 4)
    assert study.trials[3].params == study.trials[2].params
    assert [trial.state.name for trial in study.trials] == ["COMPLETE", "COMPLETE", "FAIL", "COMPLETE", "COMPLETE"]


@pytest.fixture(scope="module")
def deaths(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folders whose names are how many parameters a process had drawn when it was killed: of one interpreter, which
    takes seconds to start, there is a process for each.
    """
    folder = tmp_path_factory.mktemp("deaths")
    code = (
        "import os, sys; from pathlib import Path; from mrhubo.search import open_study, work_on\n"
        "def die(trial):\n"
        "    draws = lambda: trial.suggest_float('x', -1, 1), lambda: trial.suggest_int('n', 0, 3)\n"
        "    [draw() for draw in draws[:drawn]]\n"
        "    os.kill(os.getpid(), 9)\n"
        "for drawn in range(3):\n"
        "    if not (child := os.fork()):\n"
        "        work_on(open_study(Path(sys.argv[1]) / str(drawn), None, 's', 'random', 0), die, 2)\n"
        "    assert os.waitpid(child, 0)[1] == 9, 'killed'"
    )
    subprocess.run([sys.executable, "-c", code, str(folder)], timeout=300, check=True)
    return folder


@pytest.mark.parametrize("drawn", [["x", "n"], ["x"], []], ids=len)
def test_a_dead_process_trial_is_drawn_again_at_once(deaths: Path, drawn: list[str]) -> None:
    study = open_study(deaths / str(len(drawn)), None, "s", "random", 0)
    assert len(open_trials(study)) == 1
    work_on(study, objective, 2)
    assert [trial.state.name for trial in study.trials] == ["FAIL", "COMPLETE", "COMPLETE"] and not open_trials(study)
    assert list(study.trials[0].params) == drawn
    assert study.trials[0].params.items() <= study.trials[1].params.items()


def test_a_failing_trial_counts_and_three_in_a_row_end_it(tmp_path: Path) -> None:
    def sometimes(trial: optuna.Trial) -> float:
        if trial.number % 2:
            raise UserError("pairs.filter_k: drops every pair")
        return objective(trial)

    study = open_study(tmp_path, None, "s", "random", 0)
    work_on(study, sometimes, 6)
    assert len(study.trials) == 6 and study.trials[1].user_attrs["error"].startswith("pairs.filter_k")

    def always(trial: optuna.Trial) -> float:
        raise UserError("the disk is full")

    with pytest.raises(UserError, match="3 trials failed.*the disk is full"):
        work_on(study, always, 20)
    assert len(study.trials) == 9


def test_time_is_up(tmp_path: Path) -> None:
    study = open_study(tmp_path, None, "s", "random", 0)
    work_on(study, objective, 5, lambda: len(study.trials) >= 2)
    assert len(study.trials) == 2


@pytest.mark.parametrize(
    "url", ["postgresql://nobody:secret@127.0.0.1:1/none", "nonsense", "sqlite:////proc/none/studies.db"]
)
def test_a_database_that_cannot_be_opened(tmp_path: Path, url: str) -> None:
    with pytest.raises(UserError, match="storage: the study's database") as error:
        open_study(tmp_path, url, "s", "random", 0)
    assert "secret" not in str(error.value)


def test_a_server_that_is_away_fails_no_trial(tmp_path: Path) -> None:
    """It ends this process's work, and the trial is drawn again."""

    def away(trial: optuna.Trial) -> float:
        objective(trial)
        raise Unreachable("nobody answers")

    study = open_study(tmp_path, None, "s", "random", 0)
    with pytest.raises(Unreachable, match="nobody answers"):
        work_on(study, away, 3)
    assert len(study.trials) == 2 and remaining(study, 3) == 3
    work_on(study, objective, 3)
    assert study.trials[1].params == study.trials[0].params and remaining(study, 3) == 0


def test_a_database_that_goes_away_is_named_without_its_password(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from sqlalchemy.exc import OperationalError

    study = open_study(tmp_path, None, "s", "random", 0)

    def gone(*_: object, **__: object) -> None:
        raise OperationalError("SELECT", {}, Exception("no connection to postgresql://anna:s3cret@host/db"))

    monkeypatch.setattr(study._storage, "get_all_trials", gone)
    with pytest.raises(
        Unreachable, match=r"^storage: the study's database does not answer any more: .*\*\*\*"
    ) as error:
        work_on(study, objective, 3)
    assert "s3cret" not in str(error.value)


def test_a_study_lies_in_a_folder_of_any_name(tmp_path: Path) -> None:
    folder = tmp_path / "q?x #5%41"
    folder.mkdir()
    work_on(open_study(folder, None, "s", "random", 0), objective, 1)
    assert {path.name for path in folder.iterdir()} == {"studies.db", "studies.lock"}
    assert [path.name for path in tmp_path.iterdir()] == [folder.name]
