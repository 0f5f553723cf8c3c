"""Training settings of a fit that tunes the universal network, which starts next to its goal: far fewer steps."""

from __future__ import annotations

import dataclasses

from mrhubo.config.places import where
from mrhubo.config.schema import Config, TrainerConfig

TUNING = TrainerConfig(max_steps=200, batch_size=32, lr=1e-3, validate_every=100)
"""What `docs/universal.md` measures."""


def usual_trainer(config: Config) -> TrainerConfig:
    """The training settings that hold where nobody gives others."""
    return TUNING if config.model.start == "universal" else TrainerConfig()


def fill_in_trainer(config: Config) -> None:
    """Gives a loaded config, in place, those of `usual_trainer` that neither its file nor the command line sets."""
    usual = usual_trainer(config)
    for field in dataclasses.fields(TrainerConfig):
        if where(config, f"trainer.{field.name}") is None:
            setattr(config.trainer, field.name, getattr(usual, field.name))
