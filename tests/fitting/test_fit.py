"""A fit whose tracking server has a bad day; its steps are stood in for, as what they do does not matter here."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mlflow
import pytest
import torch
from mlflow.exceptions import MlflowException

from mrhubo.body import BodyPrior
from mrhubo.config import Config, load_config
from mrhubo.errors import UserError
from mrhubo.evaluation import Clip
from mrhubo.fitting import fit as fitting
from mrhubo.fitting.fit import FitResult, fit
from mrhubo.motion import Motion
from mrhubo.retargeter import Retargeter, build_network
from mrhubo.runtime import client as clients
from mrhubo.runtime.database import database_uri
from mrhubo.runtime.tracking import open_client
from tests.chain import cut_motion

pytestmark = pytest.mark.usefixtures("light_records")

SERVER = ("log_batch", "log_text", "log_artifact", "log_artifacts", "log_inputs", "set_tag", "set_terminated", "get_run",
          "search_runs", "search_model_versions", "create_logged_model", "create_run", "update_run")  # fmt: skip
"""What a server does."""


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clients, "_PAUSES", (0.0,))
    monkeypatch.setattr(clients, "_NEXT_TRY_SECONDS", 0.0)


@pytest.fixture
def config(root: Path, tmp_path: Path, empty_tracking: Path) -> Config:
    shutil.copytree(empty_tracking, tmp_path / "mlruns")
    for name in ("drinking", "wave"):
        cut_motion(name, tmp_path / "motions", (1, 2), every=4)
    changes = [
        f"tracking.dir={tmp_path / 'mlruns'}", f"pairs.dir={tmp_path / 'pairs'}", "model.hidden=8",
        f"evaluation.motions=[{tmp_path / 'motions'}]", "trainer.accelerator=cpu",
    ]  # fmt: skip
    return load_config(root / "conf" / "nao.yaml", changes)


class Server:
    """MLflow's client, which can be told to fail."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.down, self.refuses = False, {name: getattr(mlflow.MlflowClient, name) for name in SERVER}
        for name, method in self.refuses.items():
            patch.setattr(mlflow.MlflowClient, name, self._unless_down(method))

    def _unless_down(self, method: Callable[..., Any]) -> Callable[..., Any]:
        def call(client: Any, *given: Any, **named: Any) -> Any:
            if self.down:
                raise MlflowException("API request to http://a failed: [Errno 111] Connection refused")
            return method(client, *given, **named)

        return call


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Server:
    return Server(monkeypatch)


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> dict[str, Callable[[], None]]:
    """Stands in for the steps; what is in the mapping is done in the midst of each."""
    hooks: dict[str, Callable[[], None]] = {}
    clip = Clip(Motion("wave", torch.eye(3).expand(9, 21, 3, 3), 24.0), torch.zeros(9, 8))

    def train(prepared, report, validation, checkpoints, logger, *_: object) -> SimpleNamespace:
        checkpoints.mkdir(exist_ok=True)
        logger.log_metrics({"train/loss": 1.0}, 1)
        hooks.get("train", lambda: None)()
        logger.log_metrics({"train/loss": 2.0}, 2)
        best = checkpoints / "best.ckpt"
        best.write_bytes(b"weights")
        network = build_network(prepared.config, prepared.body_map)
        made = Retargeter(network, prepared.body_map, BodyPrior.open(), prepared.config, 0.01)
        return SimpleNamespace(prepared=prepared, retargeter=made, best_link_cm=1.0, best_checkpoint=best)

    score = SimpleNamespace(joint_rad=0.1, link_cm=0.2)
    measured = SimpleNamespace(predictions=[torch.zeros(9, 8)], over_clips=score, table="table", measures={})

    def registered(*_: object) -> str:
        hooks.get("register", lambda: None)()
        return "models:/mrhubo-nao/1"

    monkeypatch.setattr(fitting, "make_references", lambda *_: ([clip], [clip]))
    monkeypatch.setattr(fitting, "train", train)
    monkeypatch.setattr(fitting, "measure", lambda *_: measured)
    for name in ("log_pairs", "log_measures", "log_answers", "refuse_useless"):
        monkeypatch.setattr(fitting, name, lambda *_: None)
    monkeypatch.setattr("mrhubo.fitting.record.packages.register", registered)
    return hooks


def done(config: Config) -> FitResult:
    result = fit(config)
    assert result is not None
    return result


def the_run(config: Config) -> Any:
    assert config.tracking.dir is not None
    client = mlflow.MlflowClient(tracking_uri=database_uri(config.tracking.dir))
    (run,) = client.search_runs(["1"])
    return run


def losses(config: Config, run_id: str) -> list[int]:
    assert config.tracking.dir is not None
    client = mlflow.MlflowClient(tracking_uri=database_uri(config.tracking.dir))
    return sorted({metric.step for metric in client.get_metric_history(run_id, "train/loss")})


def test_a_server_that_is_away_for_a_while_misses_nothing(config: Config, server: Server, steps: dict) -> None:
    steps["train"] = lambda: setattr(server, "down", True)
    steps["register"] = lambda: None
    package = fitting.save_package

    def back(*given: Any) -> Path:
        server.down = False
        return package(*given)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fitting, "save_package", back)
        result = done(config)
    run = the_run(config)
    assert (
        run.info.run_id == result.run_id and run.info.status == "FINISHED" and losses(config, result.run_id) == [1, 2]
    )
    assert not list((config.tracking.dir or Path()).glob("fits/*/unsent.jsonl"))


def test_one_that_stays_away_ends_it_with_the_package_whole_and_the_same_command_sends_the_rest(
    config: Config, server: Server, steps: dict, capsys: pytest.CaptureFixture[str]
) -> None:
    steps["train"] = lambda: setattr(server, "down", True)
    with pytest.raises(UserError, match="the package is whole: .*the same command again, which sends") as error:
        fit(config)
    assert capsys.readouterr().err.count("warning: ") == 1
    (package,) = (config.tracking.dir or Path()).glob("packages/nao-*")
    assert str(package) in str(error.value)
    assert Retargeter.load(package).joint_names[0] == "LShoulderPitch"
    server.down, steps["train"] = False, lambda: None
    unfinished = the_run(config)
    assert unfinished.info.status == "RUNNING" and losses(config, unfinished.info.run_id) == [1]
    result = done(config)
    assert result.run_id == unfinished.info.run_id and the_run(config).info.status == "FINISHED"
    assert losses(config, result.run_id) == [1, 2]


def test_one_that_is_gone_at_the_very_end_is_not_taken_for_one_without_a_registry(
    config: Config, server: Server, steps: dict
) -> None:
    def gone() -> None:
        server.down = True
        raise MlflowException("no answer")

    steps["register"] = gone
    with pytest.raises(UserError, match="the run is not complete; the package is whole"):
        fit(config)
    server.down, steps["register"] = False, lambda: None
    assert done(config).model == "models:/mrhubo-nao/1" and the_run(config).info.status == "FINISHED"


def test_a_start_that_was_killed_at_any_point_has_all_parameters_in_the_end(
    config: Config, server: Server, steps: dict, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run's first second: its parameters come in several goes."""
    whole = mlflow.MlflowClient.log_batch
    calls = []

    def killed(*given: Any, **named: Any) -> None:
        calls.append(1)
        if len(calls) > 1:
            raise KeyboardInterrupt
        whole(*given, **named)

    monkeypatch.setattr("mrhubo.runtime.run_logger._AT_ONCE", 20)
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(mlflow.MlflowClient, "log_batch", killed)
        fit(config)
    stopped = the_run(config)
    assert stopped.info.status == "KILLED" and len(stopped.data.params) == 20
    done(config)
    run = the_run(config)
    assert run.info.run_id == stopped.info.run_id and run.data.params["trainer/max_steps"] == "6000"
    assert len(run.data.params) > 50 and len(run.inputs.dataset_inputs) == 3


def test_no_password_is_stored_or_printed(
    config: Config, steps: dict, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The database is the folder's own, under an address that has a password."""
    folder = config.tracking.dir
    assert folder is not None
    config.tracking.uri = "http://anna:s3cret@host:5000"
    monkeypatch.setattr("mrhubo.fitting.record.recording.open_client", lambda *_: open_client(folder, "mrhubo"))
    result = done(config)
    assert result.dashboard == "http://host:5000"
    assert the_run(config).data.params["tracking/uri"] == "http://anna:***@host:5000"
    for path in tmp_path.rglob("*"):
        assert not path.is_file() or b"s3cret" not in path.read_bytes(), path


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    [
        (["robot.name=../../../esc"], "robot.name: '../../../esc' begins with a dot"),
        (["robot.name=" + 300 * "n"], "robot.name: .* is longer than 64 bytes"),
        (["tracking.dir=TAKEN"], "tracking.dir: .*taken/fits cannot be used: .*taken is a file"),
        (["tracking.dir=TAKEN/a"], "tracking.dir: .*taken is a file"),
        (["pairs.dir=TAKEN"], "pairs.dir: .*taken is a file"),
        (["pairs.dir=" + "a/" * 3 + 300 * "n"], "pairs.dir: .*File name too long"),
    ],
)
def test_impossible_folders_are_refused_before_any_work(
    root: Path, tmp_path: Path, overrides: list[str], sentence: str
) -> None:
    (tmp_path / "taken").touch()
    changed = [text.replace("TAKEN", str(tmp_path / "taken")) for text in overrides]
    before = [f"tracking.dir={tmp_path / 'mlruns'}", f"pairs.dir={tmp_path / 'pairs'}"]
    motions = f"evaluation.motions=[{root / 'data' / 'motions'}]"
    with pytest.raises(UserError, match=rf"command line: {sentence}"):
        fit(load_config(root / "conf" / "nao.yaml", [motions, *before, *changed]))
    assert [path.name for path in tmp_path.iterdir()] == ["taken"], "nothing was begun"
