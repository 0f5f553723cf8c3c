"""Retargeters whose networks have learned nothing, and human poses of all kinds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo import rotation
from mrhubo.body import BodyPrior
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import load_config
from mrhubo.retargeter import Retargeter, RetargetNetwork, build_network
from mrhubo.robot import build_body_map
from tests.model_kinds import MODELS


@pytest.fixture(scope="session")
def make(root: Path) -> Callable[[str], Retargeter]:
    """Function of a shipped robot's name; each is made once."""
    made: dict[str, Retargeter] = {}

    def of(name: str) -> Retargeter:
        if name not in made:
            config = load_config(root / "conf" / f"{name}.yaml", MODELS[name])
            body_map = build_body_map(config.robot)
            torch.manual_seed(0)
            network = build_network(config, body_map)
            if name != "reachy" and isinstance(network, RetargetNetwork):
                network.round_weights()  # as those of trained ones are
            torch.manual_seed(1)
            prior = BodyPrior(hidden=20).eval()  # small, as compiled functions are no quicker for it, but tests are
            made[name] = Retargeter(network, body_map, prior, config, phi_threshold=0.01)
        return made[name]

    return of


@pytest.fixture(scope="session")
def poses() -> torch.Tensor:
    """Local rotations (T, 21, 3, 3): turned at random, a little and wildly; arms straight along every axis; at rest."""
    generator = torch.Generator().manual_seed(0)
    turns = torch.randn(44, len(POSED_JOINT_NAMES), 3, generator=generator)
    turns[:20] *= 0.4
    turns[40:] = 0
    for side in ("left", "right"):  # straight arms, some of them bent by a degree or two
        turns[24:34, POSED_JOINT_NAMES.index(f"{side}_elbow")] *= 0.01 * torch.arange(10)[:, None]
    turns[41:, POSED_JOINT_NAMES.index("left_shoulder"), 2] = torch.tensor([-1.5, 1.5, 3.1])
    return rotation.axis_angle_to_matrix(turns)


@pytest.fixture(scope="session", params=["nao", "coman", "reachy"])
def retargeter(make: Callable[[str], Retargeter], request: pytest.FixtureRequest) -> Retargeter:
    """Each robot that ships."""
    return make(request.param)


@pytest.fixture(scope="session")
def array(poses: torch.Tensor) -> np.ndarray:
    """The poses in NumPy."""
    return poses.numpy()
