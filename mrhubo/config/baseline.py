"""The settings of the baseline, S3LE."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from mrhubo.config.fields import bounded
from mrhubo.config.schema import Config


@dataclass
class S3LEConfig:
    """The baseline, Choi et al. 2021."""

    poses: Path | None = None
    """Human motion capture for the glue pairs: an .npz with `poses` (F, 66) axis-angle, `clip_starts` and `clip_ids`;
    default `data/external/cmu/training_poses.npz` in the project."""
    glue: int = bounded(10_000, 100, 10_000_000)
    """Glue pairs: frames of it that the reference retargeter answers."""
    random_poses: int = bounded(50_000, 100, 10_000_000)
    """Random robot poses; those that collide are left out."""
    self_made: int = bounded(20_000, 100, 10_000_000)
    """Self-made pairs."""
    beyond: float = bounded(0.35, 0.0, 2.0)
    """How far their robot poses go beyond the limits, as a share of the range."""
    latent: int = bounded(64, 1, 1_024)
    """Size of the shared latent space."""
    hidden: int = bounded(256, 1, 8_192)
    """Width of the two hidden layers of every encoder and decoder."""
    steps: int = bounded(6_000, 2, 1_000_000_000)
    """Optimiser steps, the first half without self-made pairs."""
    batch_size: int = bounded(256, 2, 1_000_000)
    """Pairs of each kind per step."""
    lr: float = bounded(0.00175, 1e-9, 1.0)
    """Learning rate of Adam, with cosine decay to 0."""
    normal_weight: float = bounded(0.263, 0.0)
    """Weight of the codes' distance from a normal distribution (maximum mean discrepancy)."""
    pair_weight: float = bounded(83.4, 0.0)
    """Weight of the squared distance between the codes of a pair."""
    projection_weight: float = bounded(0.739, 0.0)
    """Weight of the same for self-made pairs and their mixtures."""
    neighbours: int = bounded(30, 1, 10_000)
    """Feasible poses that an answer is a mean of; 1 = the nearest."""
    width: float = bounded(0.5, 1e-3, 100.0)
    """Width of the kernel, in distances of the farthest of them."""
    seed: int = bounded(0, 0, 2**32 - 1)
    """Seed of poses, weights and draws."""


@dataclass
class BaselineConfig(Config):
    """What `mrhubo.baseline` depends on: the robot, the evaluation, and S3LE's own settings."""

    s3le: S3LEConfig = field(default_factory=S3LEConfig)
