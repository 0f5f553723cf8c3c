"""The sweep command as a user runs it, small: two processes, one of them killed, and what is left behind."""

from __future__ import annotations

import contextlib
import json
import shutil
import sqlite3
import time
from multiprocessing.context import ForkServerContext
from pathlib import Path
from typing import Any

import mlflow
import optuna
import pytest

from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.sweep import main
from tests.chain import as_command, cut_motion

pytestmark = pytest.mark.usefixtures("light_records", "light_pairs")

SMALL = [
    "pairs.count=400", "pairs.shard_size=200", "pairs.amortiser_steps=10", "pairs.fine_steps=3", "trainer.max_steps=30",
    "trainer.batch_size=64", "trainer.validate_every=10", "trainer.accelerator=cpu",
]  # fmt: skip
SPACE = (
    "name: tiny\ntrials: 3\nspace:\n  model.hidden: [8, 16, 32]\n  trainer.lr: {low: 0.001, high: 0.01, log: true}\n"
)


@pytest.fixture()
def arguments(root: Path, tmp_path: Path) -> list[str]:
    for name in ("drinking", "wave"):
        cut_motion(name, tmp_path / "motions", (1, 2), every=4)
    (tmp_path / "sweep.yaml").write_text(SPACE)
    return [
        "--config", str(root / "conf" / "nao.yaml"), "--sweep", str(tmp_path / "sweep.yaml"), "--quiet", *SMALL,
        f"evaluation.motions=[{tmp_path / 'motions'}]", f"pairs.dir={tmp_path / 'pairs'}", f"tracking.dir={tmp_path / 'runs'}",
    ]  # fmt: skip


def studies_of(folder: Path) -> list[optuna.Study]:
    storage = f"sqlite:///{folder / 'studies.db'}"
    return [optuna.load_study(study_name=name, storage=storage) for name in optuna.get_all_study_names(storage)]


def at_work(folder: Path) -> list[int]:
    """Processes that have begun a trial."""
    try:
        with contextlib.closing(sqlite3.connect(f"file:{folder / 'studies.db'}?mode=ro", uri=True)) as database:
            rows = database.execute("SELECT value_json FROM trial_user_attributes WHERE key = 'owner'").fetchall()
    except sqlite3.OperationalError:  # not there yet
        return []
    return [int(json.loads(text).split()[1]) for (text,) in rows]


def runs_of(folder: Path) -> list[Any]:
    client = mlflow.MlflowClient(tracking_uri=f"sqlite:///{folder / 'mlflow.db'}")
    experiment = client.get_experiment_by_name("mrhubo")
    assert experiment is not None
    return client.search_runs([experiment.experiment_id])


def test_one_of_two_processes_dies(
    arguments: list[str],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    server: ForkServerContext,
    empty_tracking: Path,
) -> None:
    shutil.copytree(empty_tracking, tmp_path / "runs")
    outputs = [tmp_path / f"output{number}" for number in range(2)]
    two = [server.Process(target=as_command, args=("sweep", arguments, output, {})) for output in outputs]
    for process in two:
        process.start()
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and two[0].pid not in at_work(tmp_path / "runs"):
        assert two[0].is_alive(), outputs[0].read_text()
        time.sleep(0.05)
    two[0].kill()
    for process in two:
        process.join(400)
    assert two[1].exitcode == 0, outputs[1].read_text()
    main(arguments)  # started again: nothing is left to do, or the last trial
    output = capfd.readouterr().out
    (study,) = studies_of(tmp_path / "runs")
    states = [trial.state.name for trial in study.trials]
    assert states.count("COMPLETE") + states.count("PRUNED") == 3 and states.count("FAIL") == 1
    dead = next(trial for trial in study.trials if trial.state.name == "FAIL")
    later = [trial.params.items() for trial in study.trials if trial.number > dead.number]
    assert any(dead.params.items() <= params for params in later)  # it may have died before it had drawn all

    best = load_config(Path(output.split("--config ")[1].split()[0]))
    assert (
        str(best.model.hidden) == study.best_params["model.hidden"]
        and best.trainer.lr == study.best_params["trainer.lr"]
    )
    runs = runs_of(tmp_path / "runs")
    (parent,) = [run for run in runs if run.data.tags.get("sweep")]
    trials = [run for run in runs if run.data.tags.get("mlflow.parentRunId") == parent.info.run_id]
    assert parent.info.status == "FINISHED" and len(trials) + 1 == len(runs)
    assert parent.data.metrics["val/best_link_cm"] == pytest.approx(study.best_value, abs=1e-3)
    assert len(list((tmp_path / "pairs").glob("nao-*/*.safetensors"))) == 2  # a shard a direction, once
    artifacts = {path.name for path in (tmp_path / "runs" / "artifacts" / parent.info.run_id / "artifacts").iterdir()}
    assert artifacts >= {"base.yaml", "trials.md", f"{study.study_name}.yaml", f"{study.study_name}-history.png"}


def test_a_known_config_is_not_trained_again(arguments: list[str], tmp_path: Path) -> None:
    (tmp_path / "sweep.yaml").write_text(
        "name: two\ntrials: 4\nspace: {model.hidden: [8, 16]}\npruner: none\nfixed: {trainer.max_steps: 9999}\n"
    )
    main(arguments)
    assert len(runs_of(tmp_path / "runs")) <= 1 + 2
    (study,) = studies_of(tmp_path / "runs")
    values = {(trial.params["model.hidden"], trial.value) for trial in study.trials}
    assert len(study.trials) == 4 and len(values) <= 2
    (best,) = (tmp_path / "runs" / "sweeps").glob("*.yaml")
    assert load_config(best).trainer.max_steps == 30  # the command line's, not the file's


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("name: tiny\nspace: {}\n", "sweep.yaml, line 2: space: is empty"),
        ("name: tiny\nspace: {trainer.lrr: [1, 2]}\n", "sweep.yaml, line 2: space.trainer.lrr: key 'trainer.lrr'"),
        (
            "name: tiny\nspace: {model.hidden: [8, 9]}\nfixed: {model.stagges: 1}\n",
            "sweep.yaml, line 3: fixed.model.stagges: key 'model.stagges' .*'model.stages'",
        ),
        (
            "name: tiny\nspace:\n  model.hidden: [8, 9]\n  model.layers: {low: 1, hihg: 2}\n",
            "sweep.yaml, line 4: key .*layers.high'",
        ),
        (
            "name: tiny\nspace:\n  model.hidden: [8, 9]\n  model.layers: {low: 0, high: 2}\n",
            "line 4: space.model.layers: ",
        ),
        ("name: tiny\nspace: {model.hidden: [8, 9]}\nfixed:\n  model.stages: 3\n", "line 4: fixed.model.stages: "),
        (
            "name: tiny\nspace: {model.hidden: [8, 9]}\nfixed: {model.hidden: 8}\n",
            "line 2: space.model.hidden: is to vary, and model.hidden=8 is to hold for all trials",
        ),
        ("name: tiny\nspace: {trainer.max_steps: [8, 9]}\n", "line 2: space.trainer.max_steps: is to vary, and"),
        ("name: tiny\nspaces: {}\n", "'spaces' .*'space'"),
        ("name: tiny\nspace: {model.hidden: [8, 9]}\nstorage: nonsense\n", "sweep.yaml, line 3: storage: .*nonsense"),
    ],
)
def test_mistakes(arguments: list[str], tmp_path: Path, change: str, words: str) -> None:
    (tmp_path / "sweep.yaml").write_text(change)
    with pytest.raises(UserError, match=words):
        main(arguments)
    with pytest.raises(UserError, match="--sweep SWEEP is missing"):
        main([a for a in arguments if not a.endswith("sweep.yaml") and a != "--sweep"])
