"""How warnings about a user's input look."""

from __future__ import annotations

import sys
import warnings
from typing import TextIO

from mrhubo.errors import InputWarning, printable


def print_warning(sentence: str) -> None:
    """One line on stderr, ``warning: ...``."""
    print(f"warning: {printable(sentence)}", file=sys.stderr, flush=True)


def show_warnings_plainly() -> None:
    """From now on an `InputWarning` is one line on stderr, ``warning: ...``, once, without the line of code that gave
    it. Others look as Python shows them.
    """
    shown: set[str] = set()
    show = warnings.showwarning

    def show_plainly(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        if not issubclass(category, InputWarning):
            show(message, category, filename, lineno, file, line)
            return
        sentence = " ".join(str(message).split())
        if sentence not in shown and sys.stderr is not None:
            shown.add(sentence)
            print_warning(sentence)

    warnings.simplefilter("always", InputWarning)
    warnings.showwarning = show_plainly
