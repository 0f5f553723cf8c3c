"""Robot motions as tables: .csv with a header, for everything, and .parquet, which needs pyarrow.

Apache Parquet: https://parquet.apache.org/docs/file-format/
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, first_line, shortened
from mrhubo.files.atomic import atomic_path
from mrhubo.files.regular import open_regular, read_regular
from mrhubo.lazy import import_optional
from mrhubo.robot_motion.columns import from_columns, to_columns
from mrhubo.robot_motion.motion import FLAGS, RobotMotion, find_repeated
from mrhubo.robot_motion.plain import blocks, build, facts_of

MAX_TEXT = 2**29
"""Bytes of the largest text file that is read."""
_MAX_COLUMNS = 4_096
_MAX_NUMBERS = 2**28
_HEADER = b"mrhubo"
"""Key of a .parquet file's header under which the facts stand."""


def write_csv(motion: RobotMotion, path: Path) -> None:
    """Writes a header and a row a frame, atomically. Limits and sources have no place in it."""
    columns = to_columns(motion)
    buffer = io.StringIO(newline="")
    csv.writer(buffer, lineterminator="\n").writerow(columns)
    write_rows(path, list(columns.values()), buffer.getvalue())


def write_rows(path: Path, columns: list[np.ndarray], header: str = "") -> None:
    """Writes columns (T,) as lines of numbers with commas, each as short as tells it apart, atomically."""
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
        file.write(header)
        for block in blocks(len(columns[0]), len(columns)):
            parts = (column[block] for column in columns)
            texts = [(part.astype(np.int64) if part.dtype.kind in "biu" else part).astype(np.str_) for part in parts]
            file.writelines(",".join(row) + "\n" for row in zip(*texts, strict=True))


def read_csv(path: Path) -> RobotMotion:
    """A motion from a .csv file as `write_csv` writes it.

    Raises:
        UserError: the file is missing, too large, or holds no robot motion.
    """
    text = read_text(path)
    try:
        header = next(csv.reader(io.StringIO(text[: 2**20].partition("\n")[0])), [])
    except csv.Error as error:
        raise UserError(f"{path}: its header is none of a table: {error}") from error
    if len(header) > _MAX_COLUMNS:
        raise UserError(f"{path}: its header has too many names")
    if (repeated := find_repeated(header)) is not None:
        raise UserError(f"{path}: its header has {shortened(repeated)!r} twice")
    rows_TX = read_rows(path, text.partition("\n")[2], len(header))
    return _from_columns(path, dict(zip(header, rows_TX.T, strict=True)))


def read_text(path: Path) -> str:
    """The text of a file, UTF-8.

    Raises:
        UserError: it is missing, too large, or no text.
    """
    try:
        return read_regular(path, MAX_TEXT).decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise UserError(f"{path}: is no text (byte {error.start} is not UTF-8)") from error


def read_rows(path: Path, text: str, columns: int | None = None) -> np.ndarray:
    """Lines of numbers with commas, float64 (T, columns), one line or more.

    Raises:
        UserError: they are no numbers, of different lengths, or none.
    """
    if not text.strip():
        raise UserError(f"{path}: holds no frames")
    try:
        found = np.loadtxt(io.StringIO(text), np.float64, comments=None, delimiter=",", ndmin=2)
    except Exception as error:  # whatever NumPy makes of a stranger's text
        raise UserError(f"{path}: is no table of numbers: {shortened(first_line(error), 200)}") from error
    if columns is not None and found.shape[1] != columns:
        raise UserError(f"{path}: its header names {columns} columns, its rows have {found.shape[1]}")
    return found


def _from_columns(path: Path, columns: Mapping[str, np.ndarray], known: Mapping[str, Any] | None = None) -> RobotMotion:
    """The motion of columns; `known` are facts that the file tells besides, which win."""
    try:
        facts, frames = from_columns(columns)
    except UserError as error:
        raise UserError(f"{path}: {error}") from error
    frames |= {name: frames[name] != 0 for name in FLAGS if name in frames}
    return build({**facts, **(known or {})}, frames, path)


def write_parquet(motion: RobotMotion, path: Path) -> None:
    """Writes the columns of `write_csv`, and in the header all other facts, atomically."""
    arrow, parquet = import_pyarrow()
    columns = to_columns(motion)
    table = arrow.table({name: np.ascontiguousarray(column) for name, column in columns.items()})
    table = table.replace_schema_metadata({_HEADER: json.dumps(facts_of(motion))})
    with atomic_path(path) as temporary, open(temporary, "wb") as file:  # pyarrow takes no name that is not UTF-8
        parquet.write_table(table, file)


def read_parquet(path: Path) -> RobotMotion:
    """A motion from a .parquet file as `write_parquet` writes it.

    Raises:
        UserError: the file is missing, damaged, or holds no robot motion.
    """
    table, header = read_table(path)
    known: Any = {}
    if _HEADER in header:
        try:
            known = json.loads(header[_HEADER])
        except Exception as error:
            raise UserError(f"{path}: its header is no JSON") from error
    columns = {}
    for name in table.column_names:
        column = table.column(name)
        if column.null_count == 0 and str(column.type) in ("float", "double", "bool", "int64", "int32"):
            columns[name] = column.to_numpy()
    return _from_columns(path, columns, known if isinstance(known, dict) else {})


def read_table(path: Path) -> tuple[Any, Mapping[bytes, bytes]]:
    """A pyarrow table and its header's texts.

    Raises:
        UserError: the file is missing, damaged or too large.
    """
    _, parquet = import_pyarrow()
    try:
        # Neither memory maps nor threads: what is wrong with a stranger's file stays an exception.
        with open_regular(path) as opened, parquet.ParquetFile(opened, memory_map=False) as file:
            rows, columns = file.metadata.num_rows, file.metadata.num_columns
            if columns > _MAX_COLUMNS or rows * columns > _MAX_NUMBERS:
                raise UserError(f"{path}: claims {rows} rows of {columns} columns, which are not read")
            table = file.read(use_threads=False)
            return table, table.schema.metadata or {}
    except UserError:
        raise
    except Exception as error:  # whatever pyarrow makes of a stranger's bytes
        raise UserError(f"{path}: cannot be read as Parquet: {shortened(first_line(error), 200)}") from error


def import_pyarrow() -> tuple[Any, Any]:
    """pyarrow and pyarrow.parquet, which robots' computers may lack."""
    missing = "Parquet files need pyarrow: pip install pyarrow"
    return import_optional("pyarrow", missing), import_optional("pyarrow.parquet", missing)
