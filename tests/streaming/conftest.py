"""A retargeter whose networks have learned nothing, and motions."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from mrhubo import rotation
from mrhubo.body import BodyPrior
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import load_config
from mrhubo.motion import Motion
from mrhubo.retargeter import Retargeter, build_network
from mrhubo.robot import build_body_map


@pytest.fixture(scope="module", autouse=True)
def _small_batches(one_thread: None) -> None:
    """Everything here."""


@pytest.fixture(scope="session")
def retargeter(root: Path) -> Retargeter:
    """NAO's: its answers are no more than another place to begin at."""
    config = load_config(root / "conf" / "nao.yaml", ["model.hidden=8"])
    body_map = build_body_map(config.robot)
    torch.manual_seed(0)
    return Retargeter(build_network(config, body_map), body_map, BodyPrior.open(), config, phi_threshold=0.01)


@pytest.fixture(scope="session")
def hanging() -> Callable[..., Motion]:
    """Function of noise [degrees], frames and rate: both arms hang down straight, seen with noise."""

    def make(noise_deg: float, frames: int, rate: float = 60.0) -> Motion:
        turns_TJ3 = torch.zeros(frames, len(POSED_JOINT_NAMES), 3)
        for side, sign in (("left", -1), ("right", 1)):
            turns_TJ3[:, POSED_JOINT_NAMES.index(f"{side}_shoulder"), 2] = sign * 1.45
        noise_TJ3 = torch.randn(turns_TJ3.shape, generator=torch.Generator().manual_seed(0)) * math.radians(noise_deg)
        local_TJ33 = rotation.axis_angle_to_matrix(turns_TJ3) @ rotation.axis_angle_to_matrix(noise_TJ3)
        return Motion("hanging", local_TJ33, rate)

    return make
