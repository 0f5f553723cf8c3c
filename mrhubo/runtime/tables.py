"""Tables of figures as text."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Mapping, Sequence
from typing import Any


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table with aligned columns."""
    lines = [list(heads), *map(list, rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(heads))]
    text = ["| " + " | ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)) + " |" for line in lines]
    text.insert(1, "|" + "|".join("-" * (width + 2) for width in widths) + "|")
    return "\n".join(text)


def aligned(first: str, rows: Sequence[Any], heads: Mapping[str, tuple[str, str]]) -> list[str]:
    """The lines of a table with aligned columns: a head, then a row each with its `name` and its figures. A figure that
    is not known (NaN) is a dash, and one that is known of no row has no column.

    Args:
        first: head of the names.
        rows: objects with a `name` and the figures.
        heads: head and format of each figure, by its attribute.
    """
    shown = {key: head for key, head in heads.items() if any(_known(getattr(row, key)) for row in rows)}
    lines = [[first, *(head for head, _ in shown.values())]]
    for row in rows:
        values = [(getattr(row, key), form) for key, (_, form) in shown.items()]
        lines.append([row.name, *(form.format(value) if _known(value) else "-" for value, form in values)])
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return ["  ".join([line[0].ljust(widths[0]), *map(str.rjust, line[1:], widths[1:])]) for line in lines]


def _known(value: float) -> bool:
    return value == value


def spread_of(values: Sequence[float]) -> float:
    """Standard deviation of several values, 0 of one."""
    return statistics.stdev(values) if len(values) > 1 else 0.0


def mean_and_spread(values: Sequence[float], digits: int) -> str:
    """Mean and standard deviation of several seeds, or the value of one."""
    spread = f" ± {spread_of(values):.{digits}f}" if len(values) > 1 else ""
    return f"{statistics.fmean(values):.{digits}f}{spread}"
