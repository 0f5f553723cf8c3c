"""The prior's training on a handful of made-up poses: it learns, it resumes, it refuses bad data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mlflow
import numpy as np
import pytest
import torch

from mrhubo import rotation
from mrhubo.body import POSED_JOINT_NAMES, BodyPrior
from mrhubo.body.prior_training import train as training
from mrhubo.body.prior_training.poses import load_training_poses, plausible_frames
from mrhubo.body.prior_training.train import PriorTraining, train
from mrhubo.config import PriorConfig
from mrhubo.errors import UserError
from mrhubo.files.storage import read_tensors
from mrhubo.prior import main

pytestmark = pytest.mark.usefixtures("light_records")


@pytest.fixture(autouse=True)
def _few_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    """The measures are tested elsewhere."""
    monkeypatch.setattr(training, "_MEASURED_HELD_OUT", 40)


@pytest.fixture
def data(tmp_path: Path) -> Path:
    draw = np.random.default_rng(0)
    base = draw.normal(0, 0.3, (40, 1, 66))
    poses = (base + draw.normal(0, 0.02, (40, 20, 66))).reshape(-1, 66).astype(np.float16)
    path = tmp_path / "poses.npz"
    np.savez(path, poses=poses, clip_starts=np.arange(0, 801, 20), clip_ids=np.array([f"{i:02}_01" for i in range(40)]))
    return path


def test_training_writes_a_prior_that_reconstructs(data: Path, tmp_path: Path) -> None:
    config = PriorConfig(
        data=data, output=tmp_path / "prior.safetensors", steps=150, batch_size=64, hidden=64, encoder_hidden=64,
        latent=16, lr=1e-2, tracking_dir=tmp_path / "mlruns",
    )  # fmt: skip
    trained = train(config)
    opened = BodyPrior.open(config.output)
    poses, clips, names = load_training_poses(data)
    assert len(clips) == len(names) == 40 and poses.shape == (800, 21, 6)
    error = float(opened.reconstruction_error(poses).mean())
    assert error == pytest.approx(float(trained.reconstruction_error(poses).mean()), rel=1e-5)
    assert error < 0.8 * float(BodyPrior(64, 16).requires_grad_(False).reconstruction_error(poses).mean())


def test_stopped_it_resumes_to_the_same_weights(data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(training, "_EPOCH", 10)

    def config(folder: str) -> PriorConfig:
        return PriorConfig(
            data=data, output=tmp_path / f"{folder}.safetensors", steps=35, batch_size=32, hidden=16, encoder_hidden=16,
            latent=8, tracking_dir=tmp_path / folder,
        )  # fmt: skip

    train(config("whole"))
    step = PriorTraining.on_train_batch_end

    def stop(self: PriorTraining, *given: Any) -> None:
        step(self, *given)
        if self.trainer.global_step == 17:
            raise KeyboardInterrupt

    monkeypatch.setattr(PriorTraining, "on_train_batch_end", stop)
    with pytest.raises(KeyboardInterrupt):
        train(config("stopped"))
    assert not (tmp_path / "stopped.safetensors").exists()
    monkeypatch.setattr(PriorTraining, "on_train_batch_end", step)
    train(config("stopped"))
    (one, card), (other, other_card) = (read_tensors(tmp_path / f"{f}.safetensors") for f in ("whole", "stopped"))
    for name in one:
        torch.testing.assert_close(one[name], other[name], rtol=0, atol=0)
    assert card == other_card
    client = mlflow.MlflowClient(tracking_uri=f"sqlite:///{tmp_path / 'stopped' / 'mlflow.db'}")
    found = client.get_experiment_by_name("body-prior")
    assert found is not None
    (run,) = client.search_runs([found.experiment_id])
    assert {"held_out/joint_mm", "held_out/roc_bent", "train/loss", "val/joint_mm"} <= set(run.data.metrics)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"poses": np.zeros((10, 63), np.float32)}, "expected poses"),
        ({"poses": np.full((800, 66), np.nan, np.float32)}, "NaN"),
        ({"clip_starts": np.arange(3)}, "expected poses"),
        ({"poses": np.array([{"a": 1}], dtype=object)}, "pickled Python objects"),
        ({"poses": None}, "'poses' cannot be read"),
    ],
)
def test_bad_data_is_refused(data: Path, change: dict, message: str) -> None:
    arrays = {**np.load(data), **change}
    np.savez(data, **{k: v for k, v in arrays.items() if v is not None})
    with pytest.raises(UserError, match=message):
        load_training_poses(data)


def test_missing_and_truncated_files_are_refused(data: Path) -> None:
    (data.parent / "prior.yaml").write_text("data: none.npz")
    with pytest.raises(UserError, match="none.npz does not exist"):
        main(["--config", str(data.parent / "prior.yaml")])
    data.write_bytes(data.read_bytes()[:500])
    with pytest.raises(UserError, match="is not an .npz file"):
        load_training_poses(data)


def test_defects_of_the_recording_are_dropped(data: Path) -> None:
    poses, _, _ = load_training_poses(data)
    assert (
        0 < float(plausible_frames(poses, 20.0).float().mean()) <= float(plausible_frames(poses, 40.0).float().mean())
    )
    with pytest.raises(UserError, match="max_excess_deg: 0 leaves no frame"):
        training.Split.of(PriorConfig(data=data, max_excess_deg=0.0, held_out=0.001))


def test_named_clips_are_held_out_besides_those_drawn(data: Path) -> None:
    named = ["03_01", "17_01"]
    drawn = training.Split.of(PriorConfig(data=data)).held_out_clips
    assert training.Split.of(PriorConfig(data=data, held_out_clips=named)).held_out_clips == sorted({*drawn, *named})
    with pytest.raises(UserError, match=r"held_out_clips: .*poses.npz has no clip '3_01'"):
        training.Split.of(PriorConfig(data=data, held_out_clips=["17_01", "3_01"]))


def test_feet_are_level_by_what_all_clips_of_a_performer_show(tmp_path: Path) -> None:
    ankles = [3 * (1 + POSED_JOINT_NAMES.index(f"{side}_ankle")) + 2 for side in ("left", "right")]
    poses = np.zeros((800, 66), np.float32)
    poses[:, ankles] = np.where(np.arange(800)[:, None] < 500, [-0.3, 0.3], [-0.2, 0.2])  # of two performers
    poses[150:350, 3:6] = np.random.default_rng(0).normal(0, 0.5, (200, 3))  # one clip of kicks
    ids = np.array(["a_1", "a_2", "a_3", "b_1"])
    np.savez(path := tmp_path / "poses.npz", poses=poses, clip_starts=np.array([0, 150, 350, 500, 800]), clip_ids=ids)
    local_FJ33 = rotation.sixd_to_matrix(load_training_poses(path)[0])
    for side in ("left", "right"):
        ankle_F33 = local_FJ33[:, POSED_JOINT_NAMES.index(f"{side}_ankle")]
        torch.testing.assert_close(ankle_F33, torch.eye(3).expand(800, 3, 3), atol=1e-3, rtol=0)
