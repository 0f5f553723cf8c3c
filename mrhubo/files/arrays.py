"""Arrays on disk as `mrhubo.files.storage` writes them, read without PyTorch."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import xxhash
from safetensors import SafetensorError, safe_open

from mrhubo.errors import UserError
from mrhubo.files.regular import check_regular

CHECKSUM = "xxh3"
"""The header's entry with the checksum of metadata and data."""


class DamagedFile(UserError):
    """A file that is missing, truncated, altered, or not what its name says."""


def begin_checksum(metadata: Mapping[str, str]) -> xxhash.xxh3_64:
    """The checksum of named arrays and metadata, before the first array."""
    return xxhash.xxh3_64(json.dumps(dict(metadata), sort_keys=True).encode())


@contextmanager
def reading(path: Path, framework: str) -> Iterator[Any]:
    """An open file of safetensors, whose arrays are the framework's, `numpy` or `pt`.

    Raises:
        DamagedFile: the file is missing, truncated, or no safetensors file, or what is asked of it is not in it.
    """
    try:
        check_regular(path)
    except UserError as error:
        said = str(error).removeprefix(f"{path}: ")
        raise DamagedFile(f"{path}: cannot be read as safetensors: {said}") from error
    try:
        with safe_open(path, framework=framework) as handle:
            yield handle
    except Exception as error:  # whatever safetensors, NumPy and torch make of a stranger's bytes
        said = str(error) if isinstance(error, OSError | SafetensorError) else type(error).__name__
        raise DamagedFile(f"{path}: cannot be read as safetensors: {said}") from error


def read_checked(
    path: Path, framework: str, checksum: Callable[[dict[str, Any], dict[str, str]], str]
) -> tuple[dict[str, Any], dict[str, str]]:
    """Arrays of a framework and metadata of a file that `write_tensors` wrote, whose checksum is theirs.

    Raises:
        DamagedFile: the file is missing, truncated, no safetensors file, or its checksum does not match.
    """
    with reading(path, framework) as handle:
        metadata = dict(handle.metadata() or {})
        arrays = {name: handle.get_tensor(name) for name in handle.keys()}  # noqa: SIM118 (not a mapping)
    expected = metadata.pop(CHECKSUM, None)
    if expected is None:
        raise DamagedFile(f"{path}: carries no checksum, so it was not written by mrhubo")
    if checksum(arrays, metadata) != expected:
        raise DamagedFile(f"{path}: the content does not match its checksum; the file is damaged")
    return arrays, metadata


def read_arrays(path: Path) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Arrays and metadata of a file that `write_tensors` wrote.

    Raises:
        DamagedFile: as for `read_checked`.
    """
    return read_checked(path, "numpy", _checksum_arrays)


def _checksum_arrays(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, str]) -> str:
    """What `mrhubo.files.storage.checksum_tensors` gives for the same arrays as tensors."""
    digest = begin_checksum(metadata)
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name}{array.shape}torch.{array.dtype}".encode())
        if array.size:
            digest.update(array.reshape(-1).view(np.uint8).data)
    return digest.hexdigest()
