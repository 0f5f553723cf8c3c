"""What a run was made with: the commit of this project, the versions of the libraries that decide a result."""

from __future__ import annotations

import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from mrhubo.config.shipped import shipped_root

_LIBRARIES = ("torch", "lightning", "mlflow", "numpy", "pytorch-kinematics", "yourdfpy", "safetensors", "scipy")


def git_commit(folder: Path) -> str:
    """Commit of the checkout that holds `folder`, with "+changes" if files differ from it; "unknown" outside git.

    Where mrhubo is installed without its checkout: its version. A commit found there would be that of another project.
    """
    if not (shipped_root() / "pyproject.toml").is_file():
        return f"mrhubo {version('mrhubo')}"
    try:
        commit = subprocess.run(
            ["git", "-C", str(folder), "rev-parse", "HEAD"], capture_output=True, text=True, check=True, timeout=10
        ).stdout.strip()
        dirty = subprocess.run(
            ["git", "-C", str(folder), "status", "--porcelain", "--untracked-files=no"],
            capture_output=True,
            text=True,
            check=True,
            timeout=10,
        ).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return commit + ("+changes" if dirty else "")


def library_versions() -> dict[str, str]:
    """Versions of the libraries that decide the result."""
    versions = {}
    for name in _LIBRARIES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "absent"
    return versions
