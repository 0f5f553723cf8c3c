"""Where things lie by default: in the checkout, or in the current folder where mrhubo is installed without one."""

from __future__ import annotations

from pathlib import Path

_CHECKOUT = Path(__file__).resolve().parents[2]


def project_root() -> Path:
    """The checkout that this package is part of, else the current folder."""
    return _CHECKOUT if (_CHECKOUT / "pyproject.toml").is_file() else Path.cwd()


def default_pairs() -> Path:
    """Folder of generated pairs."""
    return project_root() / "data" / "pairs"


def default_motions() -> list[Path]:
    """Folders of evaluation motions, best first: the CMU clips of the paper if they are there, else our own motions."""
    data = project_root() / "data"
    return [data / "external" / "cmu" / "evaluation", data / "motions"]


def default_capture() -> Path:
    """File of human motion capture that the baseline learns from."""
    return project_root() / "data" / "external" / "cmu" / "training_poses.npz"


def default_tracking() -> Path:
    """Folder of the MLflow database, its artifacts, and unfinished runs."""
    return project_root() / "mlruns"
