"""The settings of the universal network's training."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from mrhubo.config.fields import bounded

SHIPPED_UNIVERSAL = Path(__file__).resolve().parents[1] / "universal" / "weights" / "universal.safetensors"
"""Weights of the universal network, which come with mrhubo."""


@dataclass
class UniversalConfig:
    """Training of the universal network."""

    output: Path = SHIPPED_UNIVERSAL
    """Where the weights go (.safetensors)."""
    start: Path | None = None
    """Weights to go on from (.safetensors), of the same width, heads and hypotheses; default: random ones."""
    problems: int = bounded(131_072, 1_024, 100_000_000)
    """Random chains with a target and the best answer that several starts find: made once, in shards of 1,024."""
    heads_share: float = bounded(0.15, 0.0, 1.0)
    """Share of the chains that are heads,"""
    legs_share: float = bounded(0.0, 0.0, 1.0)
    """legs,"""
    waists_share: float = bounded(0.0, 0.0, 1.0)
    """and waists; the others are arms."""
    human_share: float = bounded(0.4, 0.0, 1.0)
    """Share of the targets that are poses of the body prior; the others are what a chain reaches, or nearly."""
    poses: int = bounded(40_000, 1, 10_000_000)
    """Poses of the body prior to draw from."""
    steps: int = bounded(7_000, 1, 100_000_000)
    """Optimiser steps."""
    batch_size: int = bounded(320, 1, 1_000_000)
    """Problems per step."""
    lr: float = bounded(2e-3, 1e-9, 1.0)
    """Peak learning rate of AdamW; cosine decay to 0."""
    weight_decay: float = bounded(1e-4, 0.0, 1.0)
    """Weight decay of AdamW."""
    width: int = bounded(32, 4, 1_024)
    """Numbers per joint inside the network; a multiple of `attention_heads`."""
    attention_heads: int = bounded(2, 1, 64)
    """Heads of the attention among a branch's joints."""
    hypotheses: int = bounded(8, 4, 64)
    """Answers that the first iteration proposes."""
    seed: int = bounded(0, 0, 2**32 - 1)
    """Seed of weights, problems and draws."""
    tracking_dir: Path = field(default_factory=lambda: Path("mlruns"))
    """Folder of the MLflow database."""
