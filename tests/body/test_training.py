"""The prior's training on a handful of made-up poses: it learns, it resumes, it refuses bad data."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrhubo.body import BodyPrior
from mrhubo.body.dataset import load_training_poses
from mrhubo.body.training import PriorConfig, main, train
from mrhubo.errors import UserError


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
        data=data, output=tmp_path / "prior.safetensors", steps=300, batch_size=64, hidden=64, latent=16, lr=1e-2,
        tracking_dir=tmp_path / "mlruns",
    )  # fmt: skip
    trained = train(config)
    opened = BodyPrior.open(config.output)
    poses, clips, names = load_training_poses(data)
    assert len(clips) == len(names) == 40 and poses.shape == (800, 21, 6)
    error = float(opened.reconstruction_error(poses).mean())
    assert error == pytest.approx(float(trained.reconstruction_error(poses).mean()), rel=1e-5)
    assert error < 0.8 * float(BodyPrior(64, 16).requires_grad_(False).reconstruction_error(poses).mean())


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
