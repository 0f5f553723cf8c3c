"""Shared fixtures. `external_dir` is the development data (original URDFs, CMU clips), which a user does not have."""

from __future__ import annotations

import multiprocessing
import os
import sqlite3
from collections.abc import Callable, Iterator
from multiprocessing.context import ForkServerContext
from pathlib import Path
from typing import TYPE_CHECKING

import filelock
import pytest

if TYPE_CHECKING:
    from sqlalchemy import Engine
    from torch import Tensor

    from mrhubo.body.latent import LatentProblem

# Tests share the cores with each other and with the processes that they start. Threads that spin while they wait make
# all of them many times slower; read when torch is imported, after this.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

ROOT = Path(__file__).resolve().parent.parent


_LONGEST_FILES = (
    "tests/test_fit.py", "tests/test_pair.py", "tests/golden/test_golden.py", "tests/fitting/test_steps.py",
    "tests/callbacks/test_scale_search.py", "tests/test_sweep.py", "tests/baselines/s3le/test_s3le.py",
    "tests/invariance/test_invariance.py", "tests/body/prior_training/test_train.py", "tests/paper/test_tables.py",
)  # fmt: skip
"""Begun first: of several processes that share the files, none is left alone with a long one at the end."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The files that take longest come first."""
    order = {str(ROOT / name): place for place, name in enumerate(_LONGEST_FILES)}
    items.sort(key=lambda item: order.get(str(item.path), len(order)))


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


@pytest.fixture(scope="module")
def light_records(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Runs in this process are recorded as ever, but for what takes most of a small fit's time: a new database is a
    copy of one that MLflow made (its migrations take three seconds), MLflow does not compare the installed versions
    with those that it has just been told, and figures in pictures are blank.
    """
    import mlflow.store.db.utils as databases
    import mlflow.utils.environment as environment
    from PIL import Image

    from mrhubo.view import figures, pictures

    make = databases._initialize_tables
    shared = tmp_path_factory.getbasetemp()
    shared = shared.parent if "PYTEST_XDIST_WORKER" in os.environ else shared
    template = shared / "template.db"

    def copy(engine: Engine) -> None:
        path = engine.url.database
        if engine.url.get_backend_name() != "sqlite" or not path:
            make(engine)
            return
        with filelock.FileLock(f"{template}.lock"):
            if not template.exists():
                unfinished = template.with_suffix(".new")
                made = databases.create_sqlalchemy_engine_with_retry(f"sqlite:///{unfinished}")
                make(made)
                made.dispose()
                unfinished.rename(template)
        with sqlite3.connect(template) as source, sqlite3.connect(path) as target:
            source.backup(target)
        source.close()
        target.close()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(databases, "_initialize_tables", copy)
        patch.setattr(environment, "warn_dependency_requirement_mismatches", lambda requirements: None)
        patch.setattr(pictures, "GIF_RATE", 1.0)
        patch.setattr(figures, "render", lambda solids, size, *_, **__: Image.new("RGB", size))
        yield


@pytest.fixture(scope="session")
def server() -> ForkServerContext:
    """Starts processes that have imported everything already, which takes a fresh interpreter seconds."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(
        ["mrhubo.fit", "mrhubo.pair", "mrhubo.sweep", "mrhubo.fitting.sweeping", "mrhubo.fitting.fit", "tests.chain",
         "mlflow.store.tracking.sqlalchemy_store"]
    )  # fmt: skip
    return context


@pytest.fixture(scope="module")
def one_thread() -> Iterator[None]:
    """Small batches: threads cost more than they give, much more when the machine is busy."""
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


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
