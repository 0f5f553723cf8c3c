"""The steps of a fit: what they leave as it was, and what they need."""

from __future__ import annotations

import copy
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from mrhubo.config import BaselineConfig, Config, load_config
from mrhubo.errors import UserError
from mrhubo.fast.short_weights import are_short
from mrhubo.fitting import datamodule
from mrhubo.fitting.datamodule import PairData
from mrhubo.fitting.fit import fit
from mrhubo.fitting.measurement import measure_package
from mrhubo.fitting.pairs import inspect_pairs, make_pairs, verify_pairs
from mrhubo.fitting.preparation import prepare, prepare_pairs
from mrhubo.fitting.references import make_references
from mrhubo.fitting.training import train
from mrhubo.retargeter import build_network
from mrhubo.runtime import locations
from mrhubo.runtime.progress import SILENT
from mrhubo.runtime.tracking import open_client
from tests.chain import cut_motion

pytestmark = pytest.mark.usefixtures("light_records", "light_pairs")

SMALL = [
    "pairs.count=200", "pairs.shard_size=100", "pairs.amortiser_steps=10", "pairs.fine_steps=3", "model.hidden=16",
    "trainer.max_steps=20", "trainer.batch_size=64", "trainer.accelerator=cpu",
]  # fmt: skip


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in which everything lies that no config places."""
    for name in ("drinking", "wave"):
        cut_motion(name, tmp_path / "data" / "motions", (1, 2), every=4)
    monkeypatch.setattr(locations, "project_root", lambda: tmp_path)
    monkeypatch.setattr(locations, "shipped_root", lambda: tmp_path)
    return tmp_path


@pytest.fixture
def config(root: Path) -> Config:
    return load_config(root / "conf" / "nao.yaml", SMALL, BaselineConfig)


def test_no_step_changes_the_config(home: Path, config: Config) -> None:
    """Places that the config leaves open are attributes of what `prepare` gives."""
    assert config.pairs.dir is None and not config.evaluation.motions and config.tracking.dir is None
    before = copy.deepcopy(config)

    def unchanged(step: Callable[[], object]) -> object:
        result = step()
        assert config == before
        return result

    unchanged(lambda: prepare_pairs(config))
    prepared = prepare(config)
    assert prepared.config == before
    assert prepared.store.folder.parent == home / "data" / "pairs"
    assert prepared.motions.folder == home / "data" / "motions" and prepared.tracking_dir == home / "mlruns"
    assert prepared.references_dir == home / "data" / "pairs" / "reference"
    unchanged(lambda: make_pairs(prepared, SILENT))
    unchanged(lambda: verify_pairs(prepared, SILENT))
    unchanged(lambda: inspect_pairs(prepared))
    validation, _ = make_references(prepared, SILENT)
    unchanged(lambda: train(prepared, SILENT, validation, home / "checkpoints"))
    result = fit(config, SILENT)
    assert config == before and result is not None and result.package.parent == home / "mlruns" / "packages"
    unchanged(lambda: measure_package(prepared, SILENT, result.package))


def test_the_training_makes_the_pairs_that_are_missing(home: Path, config: Config) -> None:
    prepared = prepare(config)
    validation, _ = make_references(prepared, SILENT)
    training = train(prepared, SILENT, validation, home / "first")
    assert training.pairing.made == 200 and len(training.pairs["phi"]) == 200 and prepared.store.missing() == []
    weights = [layer.weight for layer in training.network.modules() if isinstance(layer, torch.nn.Linear)]
    assert weights and all(are_short(weight.numpy()) for weight in weights)
    threads = torch.get_num_threads()
    torch.set_num_threads(3 - min(threads, 2))  # two after one, or one after more: branches side by side in one of them
    again = train(prepared, SILENT, validation, home / "again")
    torch.set_num_threads(threads)
    assert again.pairing.made == 0 and again.best_link_cm == training.best_link_cm
    local_TJ33 = validation[0].motion.local_TJ33
    assert torch.equal(again.retargeter.predict(local_TJ33), training.retargeter.predict(local_TJ33))


def test_a_filter_that_drops_every_pair_is_refused(home: Path, config: Config) -> None:
    config.pairs.filter, config.pairs.filter_k, config.pairs.reverse_share = "hard", -10.0, 0.0
    prepared = prepare(config)
    data = PairData(prepared, build_network(config, prepared.body_map).features)
    with pytest.raises(UserError, match=r"pairs.filter_k: -10.0 drops every pair"):
        data.setup("fit")


def test_pairs_wait_for_the_scale_factor(root: Path, home: Path) -> None:
    """Lightning calls the data module's `setup` before the callback that searches."""
    ranges = "robot.search={ranges: {factor: [1.0, 3.0]}}"
    config = load_config(
        root / "conf" / "paper" / "nao.yaml", ["robot.scale=search", ranges, "pairs.solver=fine", *SMALL]
    )
    prepared = prepare(config, search=True)
    data = PairData(prepared, build_network(config, prepared.body_map).features)
    data.setup("fit")
    with pytest.raises(RuntimeError, match="needs the callback ScaleFactorSearch"):
        data.train_dataloader()
    assert not (home / "data" / "pairs").exists()
    found = copy.deepcopy(config)
    found.robot.scale = "manual"
    data.use_config(found)
    assert data.prepared.config is found and len(data.train_dataloader()) == 20
    assert data.prepared.store.missing() == [] and prepared.store.missing() == [0, 1]


def test_stopped_while_pairs_are_made_it_goes_on(home: Path, config: Config, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are made inside Lightning's trainer, which has ways of its own to end."""
    handler, runs = signal.getsignal(signal.SIGINT), set()
    for error, status in ((UserError("the disk is full"), "FAILED"), (KeyboardInterrupt(), "KILLED")):

        def stop(*_: object, error: BaseException = error) -> None:
            raise error

        with monkeypatch.context() as patch, pytest.raises(type(error)):
            patch.setattr(datamodule, "make_pairs", stop)
            fit(config, SILENT)
        assert signal.getsignal(signal.SIGINT) is handler
        client = open_client(home / "mlruns", "mrhubo")
        experiment = client.get_experiment_by_name("mrhubo")
        assert experiment is not None
        (stopped,) = client.search_runs([experiment.experiment_id])
        assert stopped.info.status == status and "ended_by" in stopped.data.tags
        runs.add(stopped.info.run_id)
    result = fit(config, SILENT)
    assert result is not None and {result.run_id} == runs
    assert client.get_run(result.run_id).info.status == "FINISHED"
