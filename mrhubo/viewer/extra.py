"""What shows motions in a browser, and writes films, is installed on demand: the extra `view`."""

from __future__ import annotations

import importlib
from types import ModuleType

from mrhubo.errors import UserError


def import_extra(name: str, needed_by: str) -> ModuleType:
    """A library of the extra.

    Args:
        name: of its module.
        needed_by: what needs it, for the sentence.

    Raises:
        UserError: it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name:
            raise
        raise UserError(f"{needed_by} needs the package {name}: pip install 'mrhubo[view]'") from error
