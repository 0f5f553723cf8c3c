"""Shared fixtures. `external_dir` is the development data (original URDFs, CMU clips), which a user does not have."""

from __future__ import annotations

import functools
import gc
import os
import sqlite3
from collections.abc import Callable, Iterator
from multiprocessing.context import ForkServerContext
from pathlib import Path
from typing import TYPE_CHECKING

import filelock
import hypothesis
import pytest

from tests.processes import new_server

if TYPE_CHECKING:
    from sqlalchemy import Engine
    from torch import Tensor

    from mrhubo.body.latent import LatentProblem

# Tests share the cores with each other and with the processes that they start. Threads that spin while they wait make
# all of them many times slower; read when torch is imported, after this.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
if "PYTEST_XDIST_WORKER" in os.environ:  # there is one for each core
    os.environ.setdefault("OMP_NUM_THREADS", "1")

# A slow machine is no fault of the program; in CI hypothesis has a profile of its own, without deadline too.
hypothesis.settings.register_profile("any machine", deadline=None)
if not os.environ.get("CI"):
    hypothesis.settings.load_profile("any machine")

ROOT = Path(__file__).resolve().parent.parent


_TOGETHER = (
    (
        "tests/test_fit.py",
        "tests/test_pair.py",
        "tests/test_sweep.py",
        "notebooks/",
    ),  # `server` imports everything once
    ("tests/fast/",),  # what numba compiles is compiled once
)
_LONGEST = (
    "tests/fast/", "tests/test_fit.py", "tests/golden/test_golden.py", "tests/pairing/test_generate.py",
    "tests/callbacks/test_scale_search.py", "tests/universal/learning/test_training.py", "tests/fitting/test_steps.py",
    "tests/body/test_quasi_newton.py", "tests/baselines/s3le/test_s3le.py", "tests/fitting/test_fit.py",
    "tests/benchmarks/test_benchmarks.py", "tests/test_examples.py", "tests/invariance/test_invariance.py",
    "tests/streaming/test_ground.py", "tests/retargeter/test_package.py", "tests/exporting/test_onnx_universal.py",
    "tests/paper/test_tables.py", "tests/search/test_studies.py",
)  # fmt: skip
"""Begun first: of several processes that share the files, none is left alone with a long one at the end. The first one
compiles for minutes in a clean clone; what uses that too (benchmarks, examples) comes late, or would compile it again.
"""


def _unit(file: str) -> str:
    """What a file is run together with, in one process: the first of its group, or itself."""
    return next((group[0] for group in _TOGETHER if file.startswith(group)), file)


def pytest_configure(config: pytest.Config) -> None:
    """A process that crashes ends the run with the name of its test. Another one in its place would begin that test again,
    and pytest-xdist does not hand whole files to it: the run would hang.
    """
    if getattr(config.option, "maxworkerrestart", "no xdist") is None:
        config.option.maxworkerrestart = "0"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The files that take longest come first."""
    order = {name: place for place, name in enumerate(_LONGEST)}
    items.sort(key=lambda item: order.get(_unit(item.nodeid.split("::")[0]), len(order)))


def pytest_collection_finish() -> None:
    """What has been imported stays, so Python's collector of garbage need not look through it again and again."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Whole files go to a process, some of them together, in the order of `_LONGEST`."""
    from xdist.scheduler import LoadScopeScheduling

    class InUnits(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return _unit(nodeid.split("::")[0])

    config.option.loadscopereorder = False  # not by the number of tests, which says nothing of their time
    return InUnits(config, log)


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository root."""
    return ROOT


@pytest.fixture(scope="session", autouse=True)
def no_power_cut() -> Iterator[None]:
    """Files that tests write in their own process do not wait until the disk has them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda handle: None)
        yield


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
def copied_database(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Engine], None]:
    """Stands in for what MLflow does to a new database: copies one that MLflow made, once for all processes (its
    migrations take three seconds).
    """
    import mlflow.store.db.utils as databases

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

    return copy


@pytest.fixture(scope="module")
def light_records(copied_database: Callable[[Engine], None]) -> Iterator[None]:
    """Runs in this process are recorded as ever, but for what takes most of a small fit's time (`lighten`), and a new
    database is a copy.
    """
    import mlflow.store.db.utils as databases

    from tests.light import lighten

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(databases, "_initialize_tables", copied_database)
        lighten(patch)
        yield


@pytest.fixture(scope="module")
def light_pairs() -> Iterator[None]:
    """Pairs are made as ever, but for a solver that learns from few poses (`lighten_pairs`)."""
    from tests.light import lighten_pairs

    with pytest.MonkeyPatch.context() as patch:
        lighten_pairs(patch)
        yield


@pytest.fixture(scope="session")
def server() -> ForkServerContext:
    """Starts processes that have imported everything already."""
    return new_server()


@pytest.fixture(scope="module")
def one_thread() -> Iterator[None]:
    """Small batches: threads cost more than they give, much more when the machine is busy."""
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.fixture(scope="module")
def few_poses() -> Iterator[None]:
    """Robots that nothing was trained for get their confidence of few poses, and it is not kept: to find it takes
    seconds, and anew whenever the program changes.
    """
    from mrhubo.retargeter import without_training
    from mrhubo.retargeter.calibration import calibrate

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(without_training, "calibrated", functools.partial(calibrate, poses=100))
        yield


@pytest.fixture(scope="session")
def empty_tracking(tmp_path_factory: pytest.TempPathFactory, copied_database: Callable[[Engine], None]) -> Path:
    """A folder with MLflow's database, to be copied."""
    import mlflow.store.db.utils as databases

    from mrhubo.runtime.tracking import open_client

    folder = tmp_path_factory.mktemp("tracking")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(databases, "_initialize_tables", copied_database)
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
