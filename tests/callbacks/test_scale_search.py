"""The search of the scale factor: it finds a known one, goes on where it stopped, and a fit goes on with what it found."""

from __future__ import annotations

import contextlib
import copy
import io
import math
import shutil
from pathlib import Path
from typing import Any

import lightning
import mlflow
import optuna
import pytest
import torch

from mrhubo import rotation
from mrhubo.body import BodyPrior
from mrhubo.callbacks import scale_search
from mrhubo.callbacks.scale_search import ScaleFactorSearch, ScaleResult
from mrhubo.config import Config, load_config
from mrhubo.errors import UserError
from mrhubo.evaluation import Clip
from mrhubo.fit import main
from mrhubo.fitting.preparation import prepare
from mrhubo.motion import Motion
from mrhubo.pairing import ScaleFactorObjective
from mrhubo.reference import angle_between
from mrhubo.retargeter import Retargeter
from mrhubo.robot import BodyMap, ManualScale, build_body_map, varied
from mrhubo.runtime.progress import Reporter
from mrhubo.runtime.runs import start_run
from mrhubo.runtime.tracking import open_client
from mrhubo.runtime.trainer import quiet_lightning
from tests.chain import cut_motion

pytestmark = pytest.mark.usefixtures("light_records", "light_pairs")

RANGES = "robot.search={ranges: {factor: [1.0, 3.0], upper_arm: [0.0, 0.8], shoulder.y: [-0.05, 0.05]}, trials: 14, poses: 12}"


@pytest.fixture(scope="module")
def config(root: Path) -> Config:
    return load_config(root / "conf" / "paper" / "nao.yaml", ["robot.scale=search", RANGES, "pairs.w_prior=0.001"])


@pytest.fixture(scope="module")
def body_map(config: Config) -> BodyMap:
    return build_body_map(config.robot)


@pytest.fixture(scope="module")
def prior() -> BodyPrior:
    return BodyPrior.open()


@pytest.fixture(scope="module")
def clip(config: Config, body_map: BodyMap, prior: BodyPrior) -> Clip:
    """Robot poses, and the human poses that the config's own numbers make of them: a theta without error exists."""
    q_PN = body_map.robot.sample(12, torch.Generator().manual_seed(0))
    assert config.robot.manual is not None
    objective = ScaleFactorObjective(body_map, prior, config.pairs, q_PN, torch.zeros(12, 21, 3, 3), "local")
    return Clip(Motion("made", objective.human_poses([config.robot.manual])[0], 24.0), q_PN)


def test_distances_are_those_of_the_arms(config: Config, body_map: BodyMap, prior: BodyPrior, clip: Clip) -> None:
    manual = config.robot.manual
    assert manual is not None
    objective = ScaleFactorObjective(body_map, prior, config.pairs, clip.reference_TN, clip.motion.local_TJ33, "local")
    same, other = objective.measure([manual, varied(manual, {"factor": 2.6})]).tolist()
    assert same < 0.01 < 0.03 < other
    pose = clip.motion.local_TJ33.clone()
    quarter = torch.tensor([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # a turn by 90 degrees
    pose[:, [0, 1, 2, 11]] = quarter  # of hips, spine, neck
    assert float(objective.distances(pose).max()) < 1e-3
    turned = pose.clone()
    turn = rotation.axis_angle_to_matrix(torch.tensor([0.0, 0.5, 0.0]))
    turned[:, objective.arm_joints[0]] = turned[:, objective.arm_joints[0]] @ turn
    expected = torch.full((12,), 0.5 / len(objective.arm_joints))
    torch.testing.assert_close(objective.distances(turned), expected, atol=1e-3, rtol=0)
    settings = config.pairs, clip.reference_TN, clip.motion.local_TJ33, "directions"
    seen = ScaleFactorObjective(body_map, prior, *settings)
    collar = clip.motion.local_TJ33.clone()
    collar[:, 12] = collar[:, 12] @ turn  # carries shoulder and elbow along, as seen from the chest
    assert float(objective.distances(collar).max()) < 1e-3
    both = (body_map.human_directions(p)[:, seen.arm_directions] for p in (collar, clip.motion.local_TJ33))
    torch.testing.assert_close(seen.distances(collar), angle_between(*both).mean(dim=1), atol=1e-4, rtol=0)
    assert float(seen.distances(collar).min()) > 0.02 and float(seen.distances(clip.motion.local_TJ33).max()) < 1e-4


def test_only_reached_poses_are_measured_on(
    config: Config, body_map: BodyMap, prior: BodyPrior, clip: Clip, tmp_path: Path
) -> None:
    """The reference's answers to half of the frames are spoilt: none of them is taken."""
    with torch.no_grad():
        reached = ScaleFactorSearch(config, body_map, prior, [clip], tmp_path).local_PJ33
        local = clip.motion.local_TJ33
        q_FN, local_FJ33 = clip.reference_TN.repeat(2, 1), torch.cat((local, local.flip(0)))
    both = Clip(Motion("both", local_FJ33, 24.0), q_FN)
    search = ScaleFactorSearch(config, body_map, prior, [both], tmp_path)
    other = ScaleFactorSearch(config, body_map, prior, [Clip(both.motion, q_FN.flip(0))], tmp_path)
    assert other.name != search.name, "another reference set is another study"
    assert search.local_PJ33.shape == reached.shape and torch.equal(search.local_PJ33, clip.motion.local_TJ33)


@pytest.fixture()
def runs(tmp_path: Path, empty_tracking: Path) -> tuple[Any, str]:
    shutil.copy(empty_tracking / "mlflow.db", tmp_path)
    client = open_client(tmp_path, "mrhubo")
    return client, start_run(client, "mrhubo", "fit", {}).info.run_id


def test_it_comes_near_the_numbers_that_made_the_poses(
    config: Config, body_map: BodyMap, prior: BodyPrior, clip: Clip, tmp_path: Path, runs: tuple[Any, str]
) -> None:
    start = copy.deepcopy(config)
    assert start.robot.manual is not None and config.robot.manual is not None
    start.robot.manual.factor, start.robot.manual.upper_arm = 2.7, 0.7  # far off
    stream = io.StringIO()
    search = ScaleFactorSearch(start, body_map, prior, [clip], tmp_path, Reporter(stream=stream))
    found = search.search(*runs)
    assert found.distance_rad < 0.6 * found.start_distance_rad
    assert found.config.robot.scale == "manual" and found.config.robot.search is None
    manual = found.config.robot.manual
    assert manual is not None and manual.factor == found.values["factor"] and 1.0 <= manual.factor <= 3.0
    assert set(found.pictures) >= {"history", "poses"}
    assert stream.getvalue().splitlines()[-1].startswith("scale factor: 14 of 14 trials")
    nested = runs[0].search_runs(
        [runs[0].get_experiment_by_name("mrhubo").experiment_id], f"tags.`mlflow.parentRunId` = '{runs[1]}'"
    )
    assert len(nested) == 14 and all(run.info.status == "FINISHED" for run in nested)
    best = min(run.data.metrics["scale/distance_rad"] for run in nested)
    assert best == pytest.approx(found.distance_rad)
    assert start.robot.manual.factor == 2.7  # the config that was given stays as it was


def test_it_goes_on_where_it_stopped(
    config: Config,
    body_map: BodyMap,
    prior: BodyPrior,
    clip: Clip,
    tmp_path: Path,
    runs: tuple[Any, str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(scale_search, "_AT_ONCE", 11)  # the sampler learns from the eleventh trial on
    whole = ScaleFactorSearch(config, body_map, prior, [clip], tmp_path / "whole").search()
    stopped = ScaleFactorSearch(config, body_map, prior, [clip], tmp_path / "stopped")
    measured = []

    def measure(manuals: list[Any]) -> torch.Tensor:
        measured.append(len(manuals))
        if sum(measured) > 11:
            raise KeyboardInterrupt
        return ScaleFactorObjective.measure(stopped.objective, manuals)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(stopped.objective, "measure", measure)
        stopped.search()  # without MLflow
    assert sum(measured) == 14 and measured[0] < 14, "stopped on the way"
    assert stopped.search(*runs).values == whole.values
    databases = (f"sqlite:///{tmp_path / folder / 'studies.db'}" for folder in ("whole", "stopped"))
    one, other = (optuna.load_study(study_name=stopped.name, storage=storage).trials for storage in databases)
    assert [trial.params for trial in one] == [trial.params for trial in other] and len(one) == 14
    assert whole.distance_rad < 0.02  # it starts from the numbers that made the poses


class Searched(lightning.LightningDataModule):
    """A data module that notes when it gets the config, and needs it."""

    def __init__(self) -> None:
        super().__init__()
        self.events: list[Any] = []

    def setup(self, stage: str) -> None:
        self.events.append("setup")

    def use_config(self, config: Config) -> None:
        self.events.append(config)

    def train_dataloader(self) -> Any:
        self.events.append("loader")
        return torch.utils.data.DataLoader(torch.zeros(2, 1))  # pyright: ignore[reportArgumentType]


class OneWeight(lightning.LightningModule):
    def __init__(self) -> None:
        super().__init__()
        self.layer = torch.nn.Linear(1, 1)

    def training_step(self, batch: torch.Tensor, _: int) -> torch.Tensor:
        return self.layer(batch).sum()

    def configure_optimizers(self) -> Any:
        return torch.optim.SGD(self.parameters(), 0.1)


def test_as_a_callback_it_hands_what_it_finds_to_the_data_module(
    config: Config, body_map: BodyMap, prior: BodyPrior, clip: Clip, tmp_path: Path
) -> None:
    """`Trainer.fit` with the callback is all it takes."""
    config = copy.deepcopy(config)
    assert config.robot.search is not None
    config.robot.search.trials = 4
    seen: list[ScaleResult] = []
    search = ScaleFactorSearch(config, body_map, prior, [clip], tmp_path, found=seen.append)
    data = Searched()

    def trainer() -> lightning.Trainer:
        return lightning.Trainer(
            max_epochs=1, accelerator="cpu", logger=False, callbacks=[search], enable_checkpointing=False,
            enable_progress_bar=False, enable_model_summary=False,
        )  # fmt: skip

    with quiet_lightning():
        trainer().fit(OneWeight(), datamodule=data)
        assert search.result is not None and seen == [search.result]
        assert data.events == ["setup", search.result.config, "loader"]
        loader = torch.utils.data.DataLoader(torch.zeros(2, 1))  # pyright: ignore[reportArgumentType]
        with pytest.raises(TypeError, match="use_config"):
            trainer().fit(OneWeight(), loader)


def test_a_fit_goes_on_with_what_was_found(root: Path, tmp_path: Path) -> None:
    for name in ("drinking", "wave"):
        cut_motion(name, tmp_path / "motions", (1, 2), every=4)
    arguments = [
        "--config", str(root / "conf" / "paper" / "nao.yaml"), "--quiet", "robot.scale=search", RANGES.replace("14", "4"),
        "pairs.count=200", "pairs.shard_size=100", "pairs.amortiser_steps=10", "pairs.fine_steps=5", "pairs.solver=fine",
        "model.hidden=16", "trainer.max_steps=20", "trainer.batch_size=64", "trainer.accelerator=cpu",
        f"evaluation.motions=[{tmp_path / 'motions'}]", f"pairs.dir={tmp_path / 'pairs'}", f"tracking.dir={tmp_path / 'runs'}",
    ]  # fmt: skip
    with contextlib.redirect_stdout(io.StringIO()):
        main(arguments)
    client = mlflow.MlflowClient(tracking_uri=f"sqlite:///{tmp_path / 'runs' / 'mlflow.db'}")
    experiment = client.get_experiment_by_name("mrhubo")
    assert experiment is not None
    found = client.search_runs([experiment.experiment_id])
    (run,) = [run for run in found if "mlflow.parentRunId" not in run.data.tags]
    assert len(found) == 1 + 4 and run.info.status == "FINISHED"
    found, start = (run.data.metrics[f"scale/{name}"] for name in ("distance_rad", "start_distance_rad"))
    assert 0 < found < start + 1e-6 < math.pi  # where nothing better is found, both are the same but for rounding
    artifacts = tmp_path / "runs" / "artifacts" / run.info.run_id / "artifacts"
    assert {path.name for path in (artifacts / "scale").iterdir()} >= {"history.png", "poses.png"}
    written = load_config(artifacts / "config.yaml")
    assert written.robot.scale == "manual" and written.robot.manual is not None
    assert str(written.robot.manual.factor) == run.data.params["scale_factor/factor"]
    (package,) = (tmp_path / "runs" / "packages").iterdir()
    assert isinstance(Retargeter.load(package).body_map.scale, ManualScale)
    assert prepare(written).store.header["fingerprint"] == run.data.tags["pairs_fingerprint"]


def test_other_commands_refuse_it(config: Config) -> None:
    with pytest.raises(UserError, match=r"robot\.scale: 'search' is done by mrhubo\.fit alone"):
        prepare(copy.deepcopy(config))
