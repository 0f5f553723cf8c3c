"""The wheel: it holds configs, robots and motions, nothing that may not leave the checkout, and works from anywhere."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

DECOYS = ("data/external/robots/nao.urdf", "data/pairs/nao/shard.npz", "data/motions/pairs.txt", "mlruns/mlflow.db")
"""Beside the checkout's own files; the first two are what may never get out."""


@pytest.fixture(scope="module")
def built(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of wheel and source archive, built from a copy of the checkout in which pairs and foreign data lie."""
    copy, built = tmp_path_factory.mktemp("checkout"), tmp_path_factory.mktemp("built")
    for name in ("pyproject.toml", "README.md", "LICENSE", ".gitignore"):
        shutil.copy(root / name, copy)
    for name in ("mrhubo", "conf", "data/robots", "data/motions"):
        shutil.copytree(root / name, copy / name)
    for name in DECOYS:
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        (copy / name).write_text("not to be shipped")
    done = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-d", str(built)], cwd=copy, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return built


@pytest.fixture(scope="module")
def installed(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what pip would put into site-packages."""
    folder = tmp_path_factory.mktemp("site-packages")
    with zipfile.ZipFile(next(built.glob("*.whl"))) as wheel:
        wheel.extractall(folder)
    return folder


def files(folder: Path, pattern: str) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.glob(pattern)}


def test_it_holds_what_a_command_needs_and_nothing_else(root: Path, built: Path) -> None:
    with zipfile.ZipFile(next(built.glob("*.whl"))) as wheel:
        names = set(wheel.namelist())
    assert len(names) == len(set(map(str.lower, names)))
    found = {name.removeprefix("mrhubo/") for name in names if not name.endswith(".py") and ".dist-info/" not in name}
    shipped = files(root, "conf/**/*.yaml") | files(root, "data/robots/*/*.urdf") | files(root, "data/motions/*.npz")
    universal = files(root / "mrhubo", "universal/weights/*")
    page = files(root / "mrhubo", "live/page/**/*")
    assert found == shipped | {"py.typed", "body/weights/open_prior.safetensors", "viewer/page.js", *universal, *page}
    assert {name.removeprefix("mrhubo/") for name in names if name.endswith(".py")} == files(root / "mrhubo", "**/*.py")


def test_neither_archive_holds_pairs_or_foreign_data(built: Path) -> None:
    with zipfile.ZipFile(next(built.glob("*.whl"))) as wheel, tarfile.open(next(built.glob("*.tar.gz"))) as sources:
        names = [*wheel.namelist(), *sources.getnames()]
    assert any(name.endswith("data/motions/wave.npz") for name in names)
    assert not [name for name in names if "external" in name or "data/pairs" in name or "mlflow.db" in name]


def test_its_files_are_found_from_an_empty_folder(installed: Path, tmp_path: Path) -> None:
    code = f"""
import sys
from pathlib import Path
sys.path.insert(0, {str(installed)!r})
import mrhubo
from mrhubo.config import load_config
from mrhubo.config.shipped import shipped_root
from mrhubo.motion import find_motions
from mrhubo.runtime import locations
from mrhubo.runtime.provenance import git_commit

site, here = Path({str(installed)!r}), Path.cwd()
assert Path(mrhubo.__file__).is_relative_to(site)
configs = [path for path in (shipped_root() / "conf").glob("**/*.yaml") if "robot:" in path.read_text()]
assert len(configs) == 11
elsewhere = {{path.stem for path in configs if "data/external" in path.read_text()}}
assert elsewhere == {{f"{{name}}-whole-body" for name in ("g1", "pepper", "romeo")}}, "docs tell where their URDFs are to be had"
for config in map(load_config, (path for path in configs if path.stem not in elsewhere)):
    assert config.robot.urdf.is_file() and config.robot.urdf.is_relative_to(site), config.robot.urdf
assert find_motions(locations.default_motions()) == site / "mrhubo" / "data" / "motions"
assert locations.default_pairs() == here / "data" / "pairs" and locations.default_tracking() == here / "mlruns"
assert git_commit(locations.project_root()) == f"mrhubo {{mrhubo.__version__}}"
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert not list(tmp_path.iterdir())


def test_its_script_is_the_one_command(installed: Path) -> None:
    (points,) = installed.glob("*.dist-info/entry_points.txt")
    assert "mrhubo = mrhubo.cli:main" in points.read_text()


def test_a_robots_computer_needs_no_other_versions_than_everybody(root: Path) -> None:
    def bounds(lines: list[str]) -> dict[str, str]:
        return {line.partition(">=")[0]: line.partition(">=")[2] for line in lines if ">=" in line}

    whole = bounds(tomllib.loads((root / "pyproject.toml").read_text())["project"]["dependencies"])
    lines = [line.strip() for line in (root / "requirements" / "runtime.txt").read_text().splitlines()]
    runtime = bounds([line for line in lines if line[:1].isalpha()])
    both = runtime.keys() & whole.keys()
    assert {"torch", "numpy", "safetensors", "pytorch-kinematics", "yourdfpy", "filelock"} <= both
    assert {name: runtime[name] for name in both} == {name: whole[name] for name in both}
    assert runtime.keys().isdisjoint({"lightning", "mlflow", "optuna", "matplotlib", "psutil"})
