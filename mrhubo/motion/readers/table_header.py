"""Tables of text whose header is of several lines, or whose cells have a point each, as tables with one header.

DeepLabCut's tables have a line of names over a line of axes (https://deeplabcut.github.io/DeepLabCut, "output"), and so
have many that people export from spreadsheets, where a name may stand over the first of its axes alone. TotalCapture's
`gt_skel_gbl_pos.txt` has `x y z` in every cell under a line of names (https://cvssp.org/data/totalcapture).
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence

_AXIS = re.compile(r"([xyz])(?:\s*[\[(].*)?|(likelihood|visibility|confidence|score)", re.IGNORECASE)
_FEWEST, _DEEPEST = 5, 6
"""Points of a table, and lines of a header at most."""


def separator_of(text: str) -> str:
    """What stands between the columns of a table, by some of its lines."""
    return max("\t;,", key=text.count)


def with_one_header(lines: Sequence[str]) -> Sequence[str]:
    """The lines of such a table under a header `LeftArm_x`, `LeftArm_y` ...; any other lines as they are.

    Args:
        lines: all, or some from the beginning.
    """
    for change in (_of_triples, _of_rows):
        if (changed := change(lines)) is not None:
            return changed
    return lines


def _of_triples(lines: Sequence[str]) -> list[str] | None:
    if len(lines) < 2:
        return None
    separator = separator_of(lines[0])
    names, first = _cells(lines[0], separator), _cells(lines[1], separator)
    if (
        len(names) < _FEWEST
        or len(names) != len(first)
        or not all(map(_is_triple, first))
        or any(map(_is_number, names))
    ):
        return None
    header = _line([f"{name}_{axis}" for name in names for axis in "xyz"], separator)
    rest = [separator.join(part for cell in _cells(line, separator) for part in _parts(cell)) for line in lines[1:]]
    return [header, *rest]


def _of_rows(lines: Sequence[str]) -> list[str] | None:
    if not lines:
        return None
    separator = separator_of("\n".join(lines[:_DEEPEST]))
    rows = [_cells(line, separator) for line in lines[: _DEEPEST + 1]]
    for place, row in enumerate(rows[1:_DEEPEST], start=1):
        axes = {column: found for column, cell in enumerate(row) if (found := _AXIS.fullmatch(cell)) is not None}
        if sum(found[1] is not None for found in axes.values()) < 3 * _FEWEST:
            continue
        for names in rows[place - 1 :: -1]:
            header = _header(names, row, {column: found[1] or found[2] for column, found in axes.items()})
            if header is not None:
                after = place + 1
                has_units = after < len(rows) and not any(map(_is_number, rows[after]))
                return [_line(header, separator), *lines[after + has_units :]]
        return None
    return None


def _header(names: Sequence[str], row: Sequence[str], axes: dict[int, str]) -> list[str] | None:
    """Names of the columns by a line of names and one of axes; None where names are too few, or two points have one."""
    found, name = [], ""
    for column in range(len(row)):
        own = names[column] if column < len(names) else ""
        name = own or name
        if column in axes:
            found.append(f"{name}_{axes[column].lower()}" if name else "")
        else:
            found.append(own or row[column])
    told = [found[column] for column in axes if found[column]]
    points = {column_name.rpartition("_")[0] for column_name in told}
    return found if len(points) >= _FEWEST and len(set(told)) == len(told) else None


def _cells(line: str, separator: str) -> list[str]:
    """The cells of a line without empty ones at its end."""
    try:
        found = [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]
    except csv.Error:
        return []
    while found and not found[-1]:
        found.pop()
    return found


def _parts(cell: str) -> list[str]:
    parts = cell.split()
    return parts if len(parts) == 3 else [cell]


def _is_triple(cell: str) -> bool:
    parts = cell.split()
    return len(parts) == 3 and all(map(_is_number, parts))


def _is_number(word: str) -> bool:
    try:
        float(word.replace(",", "."))
    except ValueError:
        return False
    return True


def _line(cells: Sequence[str], separator: str) -> str:
    text = io.StringIO()
    csv.writer(text, delimiter=separator, lineterminator="").writerow(cells)
    return text.getvalue()
