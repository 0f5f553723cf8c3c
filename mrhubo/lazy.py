"""What is imported when it is first asked for: names of a package, and packages that are installed on demand."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from typing import Any

from mrhubo.errors import UserError, first_line


def lazy_names(package: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """The `__getattr__` of a package (PEP 562, https://peps.python.org/pep-0562).

    Args:
        package: its name.
        homes: module of each name, in full or relative to the package: `.skeleton`.
    """

    def __getattr__(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        value = getattr(importlib.import_module(homes[name], package), name)
        setattr(sys.modules[package], name, value)  # so that it is asked for once
        return value

    return __getattr__


def import_optional(name: str, otherwise: str) -> Any:
    """A module of a package that mrhubo does without, until something asks for it. (Its types are not known to type
    checkers, as they differ between versions.)

    Args:
        name: of the module, in full.
        otherwise: the sentence where it is not installed, or is too old to have the module: what needs it, and how to
            get it.

    Raises:
        UserError: the sentence; or, where it is there and cannot be imported, for want of a library of the system for
            instance, why not.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        missing = error.name if isinstance(error, ModuleNotFoundError) else None
        if missing is not None and f"{name}.".startswith(f"{missing}."):
            raise UserError(otherwise) from error
        raise UserError(f"{name} is installed, but cannot be imported: {first_line(error)}") from error
