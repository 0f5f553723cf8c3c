"""The public face: what it offers, what it costs, and what retargeting with a package may load."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import torch

import mrhubo
from mrhubo.body import BodyPrior
from mrhubo.config import load_config
from mrhubo.retargeter import Retargeter, build_network
from mrhubo.robot import build_body_map
from tests.chain import cut_motion

TRAINING_ONLY = {"lightning", "mlflow", "matplotlib", "optuna", "cmaes", "omegaconf", "pandas", "torchmetrics"}
POSIX_ONLY = {"fcntl", "resource", "termios", "pwd", "grp"}


def run(code: str) -> set[str]:
    """Runs code in a process of its own; the modules that it had loaded at its end, and POSIX's that ours hold."""
    code += f"""
import sys
print(*sys.modules)
ours = [module for name, module in sys.modules.items() if name.startswith("mrhubo")]
print(*[f"POSIX:{{name}}" for module in ours for name in {sorted(POSIX_ONLY)} if hasattr(module, name)])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return {name.partition(".")[0] for name in done.stdout.split()}


@pytest.fixture(scope="module")
def package(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    config = load_config(root / "conf" / "nao.yaml", ["model.hidden=24"])
    body_map = build_body_map(config.robot)
    torch.manual_seed(0)
    made = Retargeter(build_network(config, body_map), body_map, BodyPrior.open(), config, phi_threshold=0.01)
    return made.save(tmp_path_factory.mktemp("front") / "package", {})


def test_every_public_name_is_there_and_lazy() -> None:
    for name in mrhubo.__all__:
        assert getattr(mrhubo, name) is not None and name in dir(mrhubo)
    assert mrhubo.Retargeter is Retargeter
    with pytest.raises(AttributeError, match="no attribute 'Retargetter'"):
        _ = mrhubo.Retargetter  # type: ignore[attr-defined]
    loaded = run("import mrhubo; dir(mrhubo); mrhubo.__version__; mrhubo.UserError")
    assert loaded.isdisjoint({"torch", "numpy", "yaml"} | TRAINING_ONLY)


def test_type_checkers_see_what_is_imported(root: Path) -> None:
    source = (root / "mrhubo" / "__init__.py").read_text()
    for name, home in mrhubo._HOMES.items():
        module, _, other = home.partition(":")
        pattern = rf"    from {re.escape(module)} import .*\b{f'{other} as {name}' if other else name}\b"
        assert re.search(pattern, source), name
        assert (other or name) in getattr(importlib.import_module(module), "__all__", [name])
    assert (root / "mrhubo" / "py.typed").is_file()


def test_the_version_stands_in_one_place(root: Path) -> None:
    stated = tomllib.loads((root / "pyproject.toml").read_text())["project"]["version"]
    assert mrhubo.__version__ == stated
    for file in (root / "mrhubo").rglob("*.py"):
        assert f'"{stated}"' not in file.read_text(), file


def test_a_package_answers_without_what_training_needs(package: Path, tmp_path: Path) -> None:
    wave = str(cut_motion("wave", tmp_path / "short", (0, 0.3)))
    loaded = run(f"""
import mrhubo
result = mrhubo.load({str(package)!r})(mrhubo.read_motion({wave!r}))
assert result.q.shape == (len(result.confidence), 8)
result.save({str(tmp_path / "wave.csv")!r})
from mrhubo.retarget import main
main(["--retargeter", {str(package)!r}, "--motion", {wave!r}, "--to", "0.2",
      "--out", {str(tmp_path / "wave.json")!r}])
""")
    assert {"torch", "pytorch_kinematics"} <= loaded
    assert loaded.isdisjoint(TRAINING_ONLY), loaded & TRAINING_ONLY
    assert not [name for name in loaded if name.startswith("POSIX")]
    assert "torch._dynamo" not in loaded  # PyTorch's compiler takes longer to import than PyTorch
    assert (tmp_path / "wave.csv").stat().st_size > 1000


def test_load_takes_a_path_too(package: Path) -> None:
    assert mrhubo.load(package).joint_names == mrhubo.load(str(package)).joint_names
    with pytest.raises(mrhubo.UserError, match="is no package of a retargeter"):
        mrhubo.load(package.parent)
