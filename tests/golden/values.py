"""What a small fit and some pairs come to, through the commands alone: figures that a refactor must keep to the bit.

Everything here runs on one core with one thread. `python -m tests.golden.record` writes the figures down.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import platform
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import mlflow
import numpy as np
import scipy
import torch
from safetensors.numpy import load_file

from tests.chain import ROOT, cut_motion, fit, pair, quietly

HERE = Path(__file__).resolve().parent
CLIPS = ("drinking", "boxing", "pointing", "wave")
"""Shipped motions, of which three seconds are used; the first chooses the checkpoint, the others are the test."""
PAIRS = ["pairs.amortiser_steps=40", "pairs.fine_steps=20", "pairs.workers=1", "trainer.accelerator=cpu"]
FIT = [
    "pairs.count=5000", "pairs.shard_size=500", *PAIRS, "model.hidden=48", "model.layers=2", "trainer.batch_size=128",
    "trainer.max_steps=1500", "trainer.validate_every=750",
]  # fmt: skip
LOSSES = 20
_FRAMES = slice(None, None, 20)
_REFERENCE = "wave"


def platform_key() -> str:
    """What decides how floating-point sums come out: processor, its instructions, and the libraries that use them.

    MKL chooses its code by the maker of the processor, torch by the instructions (`ATEN_CPU_CAPABILITY`); the
    reference's banded systems are scipy's. Threads and cores decide nothing (measured: one and two of each).
    """
    capability = torch.backends.cpu.get_cpu_capability().lower().replace(" ", "")
    libraries = [f"{library.__name__}{_minor(library.__version__)}" for library in (torch, scipy)]
    return "-".join((platform.machine().lower(), _cpu("vendor_id", "CPU implementer"), capability, *libraries)).lower()


def facts() -> dict[str, str]:
    """More about this machine, for whoever has to explain a difference."""
    versions = {library.__name__: library.__version__ for library in (torch, scipy, np)}
    return {"processor": _cpu("model name"), "python": platform.python_version(), **versions}


def measure(folder: Path) -> dict[str, Any]:
    """Runs a fit and makes pairs in a folder; the figures, `losses`, `shards` and `reference`.

    The fit leaves `mlruns` and `pairs` there.
    """
    with one_core():
        run_fit(folder)
        for solver in ("fine", "fast", "paper"):
            settings = [f"pairs.solver={solver}", "pairs.reverse_share=0", "pairs.count=100", "pairs.shard_size=100"]
            quietly(pair, [*_nao(), *PAIRS, *settings, f"pairs.dir={folder / solver}"])
    shards = {"direct": "pairs/nao-*/forward-000000", "reverse": "pairs/nao-*/reverse-000000"}
    shards |= {solver: f"{solver}/*/forward-000000" for solver in ("fine", "fast", "paper")}
    (reference,) = folder.glob(f"pairs/reference/*-{_REFERENCE}-*.safetensors")
    return {
        "losses": logged(folder, "train/loss")[:LOSSES],
        "shards": {name: _sum_up(*folder.glob(f"{pattern}.safetensors")) for name, pattern in shards.items()},
        "reference": load_file(reference)["q"][_FRAMES].astype(float).tolist(),
    }


def run_fit(folder: Path, *overrides: str) -> None:
    """The fit alone, on three seconds of each clip: all frames of the one whose reference is a golden value."""
    for name in CLIPS:
        cut_motion(name, folder / "motions", (1.5, 4.5), every=1 if name == _REFERENCE else 3)
    folders = [
        f"evaluation.motions=[{folder / 'motions'}]",
        f"pairs.dir={folder / 'pairs'}",
        f"tracking.dir={folder / 'mlruns'}",
    ]
    quietly(fit, [*_nao(), *FIT, *folders, *overrides])


def logged(folder: Path, name: str) -> list[float]:
    """A metric of the fit's only run, step by step."""
    client = mlflow.MlflowClient(tracking_uri=f"sqlite:///{folder / 'mlruns' / 'mlflow.db'}")
    experiment = client.get_experiment_by_name("mrhubo")
    assert experiment is not None
    (run,) = client.search_runs([experiment.experiment_id])
    found = client.get_metric_history(run.info.run_id, name)
    return [metric.value for metric in sorted(found, key=lambda metric: metric.step)]


def read_values() -> dict[str, dict[str, Any]]:
    """The recorded figures of every known platform."""
    return {path.stem: json.loads(path.read_text()) for path in sorted((HERE / "platforms").glob("*.json"))}


def write_values(key: str, values: Mapping[str, Any]) -> Path:
    """Writes down a platform's figures."""
    path = HERE / "platforms" / f"{key}.json"
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps({"recorded_on": facts(), **values}, indent=1) + "\n")
    return path


@contextlib.contextmanager
def one_core() -> Iterator[None]:
    """One core and one thread inside, whatever the machine has."""
    threads, cores = torch.get_num_threads(), os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()
    torch.set_num_threads(1)
    if cores:
        os.sched_setaffinity(0, {min(cores)})
    try:
        yield
    finally:
        torch.set_num_threads(threads)
        if cores:
            os.sched_setaffinity(0, cores)


def _nao() -> list[str]:
    return ["--config", str(ROOT / "conf" / "nao.yaml"), "--quiet"]


def _sum_up(shard: Path) -> dict[str, Any]:
    """Checksum of a shard's tensors (not of its header, which names settings), and the mean size of each."""
    digest, means = hashlib.sha256(), {}
    for name, array in sorted(load_file(shard).items()):
        digest.update(f"{name} {array.shape} {array.dtype}".encode() + array.tobytes())
        means[name] = float(np.abs(array.astype(float)).mean())
    return {"sha256": digest.hexdigest()[:16], "means": means}


def _minor(version: str) -> str:
    return ".".join(version.split(".")[:2])


def _cpu(*names: str) -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    pairs = [line.split(":", 1) for line in lines if ":" in line]
    return next((value.strip() for key, value in pairs if key.strip() in names), "unknown")
