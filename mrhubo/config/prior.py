"""The settings of the body prior's training."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from mrhubo.config.fields import bounded, choice

SHIPPED_PRIOR = Path(__file__).resolve().parents[1] / "body" / "weights" / "open_prior.safetensors"
"""Weights of the open body prior, which come with mrhubo."""


@dataclass
class PriorConfig:
    """Training of the body prior."""

    data: Path
    """File of training poses: `poses` (F, 66) axis-angle, root first; `clip_starts`, one more than clips;
    `clip_ids`."""
    output: Path = SHIPPED_PRIOR
    """Where the weights go (.safetensors)."""
    steps: int = bounded(16_000, 1, 100_000_000)
    """Optimiser steps."""
    batch_size: int = bounded(1_024, 2, 1_000_000)
    """Poses per step."""
    lr: float = bounded(1e-3, 1e-9, 1.0)
    """Peak learning rate of AdamW; cosine decay to 0."""
    weight_decay: float = bounded(1e-4, 0.0, 1.0)
    """Weight decay of AdamW."""
    hidden: int = bounded(512, 8, 8_192)
    """Width of the decoder's two hidden layers."""
    encoder_hidden: int = bounded(1_024, 8, 8_192)
    """Width of the encoder's two hidden layers."""
    latent: int = bounded(48, 1, 1_024)
    """Size of the latent."""
    activation: str = choice("silu", "silu", "leaky_relu", "tanh")
    """Activation of the hidden layers; second-order solvers need a smooth one."""
    w_position: float = bounded(10.0, 0.0)
    """Weight of the keypoint distances, 1/m."""
    w_kl: float = bounded(2e-3, 0.0)
    """Weight of the Kullback-Leibler divergence from N(0, I)."""
    w_latent: float = bounded(10.0, 0.0)
    """Weight of the sliced Wasserstein distance between the batch's latents and N(0, I)."""
    w_anatomy: float = bounded(60.0, 0.0)
    """Weight of the squared excess [rad^2] over anatomical ranges of poses decoded from N(0, I)."""
    w_columns: float = bounded(0.2, 0.0)
    """Weight of the orthonormality penalty, which keeps the six raw numbers of every joint near two orthogonal unit
    vectors."""
    noise_share: float = bounded(0.3, 0.0, 1.0)
    """Share of the poses that the encoder sees with noise, and the decoder has to give clean."""
    max_excess_deg: float = bounded(20.0, 0.0)
    """Frames with a joint further outside its anatomical range than this are dropped."""
    missing_share: float = bounded(0.8, 0.0, 1.0)
    """Share of the poses whose wrists (and of those whose ankles, collars, toes) get random angles, which the data
    lacks."""
    rest_share: float = bounded(0.2, 0.0, 1.0)
    """Share of the poses whose legs, trunk and collars are put at rest, as a robot without them reads a pose."""
    held_out: float = bounded(0.05, 0.001, 0.5)
    """Share of the clips held out for validation, drawn at random."""
    held_out_clips: list[str] = field(default_factory=list)
    """Clips held out in any case, by their names in `clip_ids`."""
    seed: int = bounded(0, 0, 2**32 - 1)
    """Seed of weights, split and draws."""
    tracking_dir: Path = field(default_factory=lambda: Path("mlruns"))
    """Folder of the MLflow database."""
