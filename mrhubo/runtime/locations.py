"""Where things lie by default: in the checkout, or, where mrhubo is installed without one, in the current folder.

What comes with mrhubo (its own motions) is in the checkout or in the installed package, see `config.shipped`.
"""

from __future__ import annotations

from pathlib import Path

from mrhubo.config.shipped import shipped_root


def project_root() -> Path:
    """The checkout that this package is part of, else the current folder: what runs leave behind goes there."""
    root = shipped_root()
    return root if (root / "pyproject.toml").is_file() else Path.cwd()


def default_pairs() -> Path:
    """Folder of generated pairs."""
    return project_root() / "data" / "pairs"


def default_motions() -> list[Path]:
    """Folders of evaluation motions, best first: the CMU clips of the paper if they are there, else our own motions."""
    return [project_root() / "data" / "external" / "cmu" / "evaluation", shipped_root() / "data" / "motions"]


def default_capture() -> Path:
    """File of human motion capture that the baseline learns from."""
    return project_root() / "data" / "external" / "cmu" / "training_poses.npz"


def default_tracking() -> Path:
    """Folder of the MLflow database, its artifacts, and unfinished runs."""
    return project_root() / "mlruns"
