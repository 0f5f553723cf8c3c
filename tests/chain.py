"""What tests of the whole chain share: the ways into the package, all named here, and short motions."""

from __future__ import annotations

import contextlib
import importlib
import io
import json
import os
import resource
import signal
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

import mrhubo
from mrhubo import Motion, OptimizationRetargeter, Retargeter, read_motion
from mrhubo.body import BodyPrior
from mrhubo.config import load_config, run_command
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.fit import main as fit
from mrhubo.pair import main as pair
from mrhubo.retargeter import build_network
from mrhubo.robot import build_body_map
from tests.light import lighten, lighten_pairs

ROOT = Path(__file__).resolve().parent.parent
__all__ = [
    "ROOT", "Motion", "answer", "as_command", "as_notebook", "as_torchrun", "cut_motion", "fit", "killed_at", "load", "new_package", "optimise", "pair", "quietly", "read_motion",
    "read_tensors", "write_tensors",
]  # fmt: skip


def quietly(command: Callable[[list[str]], object], arguments: Sequence[str]) -> str:
    """Runs a command in this process; what it printed."""
    with contextlib.redirect_stdout(io.StringIO()) as output:
        command(list(arguments))
    return output.getvalue()


def as_command(
    name: str, arguments: Sequence[str], output: Path, environment: Mapping[str, str], largest: int | None = None
) -> None:
    """In a process of its own: what `python -m mrhubo.<name>` does, in a session of its own, its output in a file, but
    for what `lighten` and `lighten_pairs` say; no file can be larger than `largest` bytes.
    """
    lighten(patch := pytest.MonkeyPatch())
    lighten_pairs(patch)
    if largest is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))
    _go_apart(output, environment)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored below a shell's background job
    sys.argv = [f"mrhubo.{name}", *arguments]
    run_command(importlib.import_module(f"mrhubo.{name}").main)


def as_notebook(path: Path, output: Path) -> None:
    """In a process of its own: what Jupyter does with a notebook's cells, up to the first that fails."""
    from IPython.core.interactiveshell import InteractiveShell

    class Shell(InteractiveShell):
        def enable_gui(self, gui: str | None = None) -> None:
            """There is no window to wait for."""

    _go_apart(output, {})
    os.chdir(path.parent)
    sys.path.insert(0, str(path.parent))
    shell = Shell.instance()
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code" and not shell.run_cell("".join(cell["source"]), store_history=True).success:
            sys.exit(1)


def as_torchrun(arguments: Sequence[str], output: Path, environment: Mapping[str, str]) -> None:
    """In a process of its own: what `torchrun` does."""
    _go_apart(output, environment)
    importlib.import_module("torch.distributed.run").main(list(arguments))


def _go_apart(output: Path, environment: Mapping[str, str]) -> None:
    """Into a session of its own; what is printed goes to a file."""
    os.setsid()
    os.environ.update(environment)
    stream = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    for standard in (1, 2):
        os.dup2(stream, standard)


def killed_at(event: int, folder: Path, command: Callable[[list[str]], object], arguments: list[str]) -> None:
    """In a process of its own: a command that is killed as it is about to touch a folder for the n-th time (files and
    folders opened, made, renamed, removed), if it ever does; as `lighten_pairs` says.
    """
    lighten_pairs(pytest.MonkeyPatch())
    left = [event]

    def count(name: str, given: tuple[object, ...]) -> None:
        if name in ("open", "os.rename", "os.remove", "os.mkdir") and str(given[0]).startswith(str(folder)):
            left[0] -= 1
            if left[0] == 0:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(count)
    command(arguments)


def load(folder: Path) -> Retargeter:
    """A package's retargeter."""
    return mrhubo.load(folder)


def answer(retargeter: Retargeter, motion: Motion, **settings: int) -> dict[str, Tensor]:
    """Joint angles (T, N) and all that is said about them."""
    result = retargeter(motion, **settings)
    return {name: getattr(result, name) for name in ("q", "confidence", "direction_error_deg", "phi", "collision")}


def optimise(config: Path, motions: Iterable[Motion], smoothness: Iterable[float]) -> dict[float, list[Tensor]]:
    """The reference retargeter's joint angles (T, N) of each motion, by smoothness; with 0 each frame is on its own."""
    body_map, found = build_body_map(load_config(config).robot), {}
    for weight in smoothness:
        retargeter = OptimizationRetargeter(body_map, weight)
        found[weight] = [retargeter(motion).q for motion in motions]
    return found


def new_package(config: Path, folder: Path, *overrides: str, prior: BodyPrior | None = None) -> Path:
    """A package with random weights: what holds for them holds for trained ones; with the prior that ships or another."""
    settings = load_config(config, overrides)
    body_map = build_body_map(settings.robot)
    torch.manual_seed(0)
    network = build_network(settings, body_map)
    return Retargeter(network, body_map, prior or BodyPrior.open(), settings, phi_threshold=0.01).save(folder, {})


def cut_motion(name: str, folder: Path, seconds: tuple[float, float] = (0, 1e9), every: int = 1) -> Path:
    """A part of a shipped motion as a file of its own: from one second to another, every so many frames."""
    with np.load(ROOT / "data" / "motions" / f"{name}.npz") as data:
        arrays = dict(data)
    frames, rate = len(arrays["pose_body"]), float(arrays["mocap_frame_rate"])
    part = slice(int(seconds[0] * rate), int(min(seconds[1] * rate, frames)), every)
    arrays = {key: array[part] if array.ndim and len(array) == frames else array for key, array in arrays.items()}
    folder.mkdir(parents=True, exist_ok=True)
    np.savez(folder / f"{name}.npz", **{**arrays, "mocap_frame_rate": np.array(rate / every)})
    return folder / f"{name}.npz"
