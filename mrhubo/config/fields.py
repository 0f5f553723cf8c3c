"""How a schema's fields say what is allowed."""

from __future__ import annotations

from dataclasses import field
from typing import Any


def bounded(default: Any, low: float | None = None, high: float | None = None, left_out: bool = False) -> Any:
    """A field whose number must lie in [low, high]; None leaves that side open. `left_out`: as of the function of that
    name.
    """
    return field(default=default, metadata={"low": low, "high": high, "left_out": left_out})


def choice(default: str, *choices: str, left_out: bool = False) -> Any:
    """A field that takes one of the given words; `left_out`: as of the function of that name."""
    return field(default=default, metadata={"choices": choices, "left_out": left_out})


def left_out(default: Any = None) -> Any:
    """A field that YAML and fingerprints leave out where it has this default."""
    return field(default=default, metadata={"left_out": True})
