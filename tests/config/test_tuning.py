"""A fit that starts from the universal network has training settings of its own, where nobody gives others."""

from __future__ import annotations

from pathlib import Path

from mrhubo.config import TrainerConfig, load_config, to_yaml, usual_trainer
from mrhubo.config.tuning import TUNING
from mrhubo.fitting.record.naming import run_name


def test_what_nobody_gives_is_the_tunings(root: Path) -> None:
    tuned = load_config(root / "conf" / "nao.yaml", ["model.start=universal"])
    assert tuned.trainer == TUNING == usual_trainer(tuned)
    assert run_name(tuned) == "nao start=universal"
    scratch = load_config(root / "conf" / "nao.yaml")
    assert scratch.trainer == TrainerConfig() == usual_trainer(scratch)
    assert scratch.trainer != TUNING


def test_what_somebody_gives_stays(root: Path, tmp_path: Path) -> None:
    """From the command line and from a file, where it is the usual value of the other start too."""
    usual = TrainerConfig()
    changes = ["model.start=universal", f"trainer.lr={usual.lr}", f"trainer.max_steps={usual.max_steps}"]
    config = load_config(root / "conf" / "nao.yaml", changes)
    assert (config.trainer.lr, config.trainer.max_steps) == (usual.lr, usual.max_steps)
    assert (config.trainer.batch_size, config.trainer.validate_every) == (TUNING.batch_size, TUNING.validate_every)
    assert run_name(config) == f"nao start=universal lr={usual.lr} max_steps={usual.max_steps}"
    (tmp_path / "kept.yaml").write_text(to_yaml(config))
    assert load_config(tmp_path / "kept.yaml") == config
