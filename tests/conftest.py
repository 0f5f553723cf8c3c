"""Shared fixtures. `external_dir` is the development data (original URDFs, CMU clips), which a user does not have."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from torch import Tensor

    from mrhubo.body.latent import LatentProblem

# Tests share the cores with each other and with the processes that they start. Threads that spin while they wait make
# all of them many times slower; read when torch is imported, after this.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository root."""
    return ROOT


@pytest.fixture(scope="session")
def external_dir() -> Path:
    """`data/external`; tests that need it skip where it is missing, unless MRHUBO_REQUIRE_EXTERNAL=1 (as in CI)."""
    path = ROOT / "data" / "external"
    if not (path / "robots").is_dir() or not (path / "cmu").is_dir():
        message = "data/external (original URDFs and CMU clips, development only) is not here"
        if os.environ.get("MRHUBO_REQUIRE_EXTERNAL") == "1":
            pytest.fail(message + ", and MRHUBO_REQUIRE_EXTERNAL=1 asks for it")
        pytest.skip(message)
    return path


@pytest.fixture(scope="session")
def empty_tracking(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with MLflow's database, to be copied: making one takes seconds."""
    from mrhubo.runtime.tracking import open_client

    folder = tmp_path_factory.mktemp("tracking")
    open_client(folder, "mrhubo")
    return folder


@pytest.fixture(scope="session")
def latent_problem() -> Callable[..., tuple[LatentProblem, Tensor]]:
    """Makes a robot's problem of latent inverse kinematics, and keypoints (200, K, 3) [m] that random poses of the
    robot ask for: `latent_problem("nao", w_prior=0.01)`.
    """
    import torch

    from mrhubo.body import BodyPrior
    from mrhubo.body.latent import LatentProblem
    from mrhubo.config import load_config
    from mrhubo.robot import build_body_map

    def make(robot: str, w_prior: float = 0.01) -> tuple[LatentProblem, Tensor]:
        body_map = build_body_map(load_config(ROOT / "conf" / f"{robot}.yaml").robot)
        decoder = BodyPrior.open().decoder
        problem = LatentProblem(decoder, body_map.skeleton, body_map.keypoint_indices, w_prior=w_prior)
        q = body_map.robot.sample(200, torch.Generator().manual_seed(3))
        return problem, body_map.targets(body_map.robot.forward(q))

    return make
