"""The one exception that means "the user can fix this": printed as one sentence, exit code 2, no traceback."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class UserError(Exception):
    """A mistake in a config, a file or a command line: what is wrong, where, and what to do about it."""


def unknown_name(kind: str, name: str, available: Iterable[str]) -> str:
    """One sentence that names the nearest available name, for instance ``link 'Hed' does not exist; nearest:
    'Head'``.
    """
    names = sorted(available)
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    if near:
        return f"{kind} '{name}' does not exist; nearest: '{near[0]}'"
    shown = ", ".join(names[:30]) + (", ..." if len(names) > 30 else "")
    return f"{kind} '{name}' does not exist; available: {shown or 'none'}"


def was_interrupted(error: BaseException | None) -> bool:
    """Whether Ctrl-C is at the root of an error: libraries make errors of their own of an interrupt in their midst."""
    seen: list[BaseException] = []
    while error is not None and error not in seen:
        if isinstance(error, KeyboardInterrupt):
            return True
        seen.append(error)
        error = error.__cause__ or error.__context__
    return False
