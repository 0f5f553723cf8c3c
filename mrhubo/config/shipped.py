"""Where the configs, robots and motions that come with mrhubo are."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]


def shipped_root() -> Path:
    """The folder that holds `conf`, `data/robots` and `data/motions`: the checkout, or the installed package itself."""
    checkout = _PACKAGE.parent
    return checkout if (checkout / "pyproject.toml").is_file() else _PACKAGE
