"""Tensors on disk that are either whole or absent: safetensors with a checksum, written aside, synced, renamed.

safetensors notices a truncated file but not a flipped bit, so the header carries an xxh3 checksum over metadata and
data.
"""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import torch
from filelock import FileLock, Timeout
from safetensors.torch import save
from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.files.arrays import CHECKSUM, begin_checksum, read_checked, reading
from mrhubo.files.atomic import atomic_path, checksum_file
from mrhubo.files.regular import read_regular


class Locked(UserError):
    """Another process holds the lock."""


@contextmanager
def locked(path: Path, wait: bool = False) -> Iterator[None]:
    """Holds a lock that one process at a time can have; it ends with the process, however that ends.

    Raises:
        Locked: another process has it, and `wait` is False.
        UserError: the folder refuses the file of the lock.
    """
    lock = FileLock(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock.acquire(blocking=wait)
    except Timeout as error:
        raise Locked(f"{path.parent}: another process is at work there; wait for it or stop it") from error
    except OSError as error:
        raise UserError(f"{path}: cannot be locked: {error.strerror or error}") from error
    try:
        yield
    finally:
        lock.release()


def remove_leftovers(folder: Path) -> None:
    """Removes the temporary files of `atomic_path` whose process has ended without removing them (kill -9)."""
    import psutil  # only who writes needs it

    for path in folder.glob(f".*.{platform.node()}.*.tmp"):
        process = path.name.split(".")[-2]
        if process.isdecimal() and (int(process) == os.getpid() or not psutil.pid_exists(int(process))):
            path.unlink(missing_ok=True)


@contextmanager
def checked_path(path: Path) -> Iterator[Path]:
    """As `atomic_path`, with a checksum of the content in a file beside it, which `matches_checksum` reads.

    That file is written first and holds the checksum of the former content too: whenever the process ends, it holds
    that of what is there.

    Raises:
        UserError: the folder or the disk refuses a file.
    """
    with atomic_path(path) as temporary:
        yield temporary
        known = [checksum_file(temporary), *([checksum_file(path)] if path.is_file() else [])]
        with atomic_path(_beside(path)) as aside:
            aside.write_text("\n".join(known))


def matches_checksum(path: Path) -> bool | None:
    """Whether a file holds what `checked_path` wrote; None if no checksum is beside it.

    Raises:
        UserError: the file, or the one with its checksum, is no regular one or may not be read.
    """
    if not _beside(path).exists():
        return None
    return checksum_file(path) in read_regular(_beside(path), 1_000).decode("ascii", "replace").split()


def _beside(path: Path) -> Path:
    return path.with_name(f"{path.name}.xxh3")


def checksum_tensors(tensors: Mapping[str, Tensor], metadata: Mapping[str, str]) -> str:
    """xxh3 of named tensors and metadata, 16 hex digits."""
    digest = begin_checksum(metadata)
    for name in sorted(tensors):
        tensor = tensors[name].detach().cpu().contiguous()
        digest.update(f"{name}{tuple(tensor.shape)}{tensor.dtype}".encode())
        if tensor.numel():
            digest.update(tensor.flatten().view(torch.uint8).numpy().data)
    return digest.hexdigest()


def write_tensors(path: Path, tensors: Mapping[str, Tensor], metadata: Mapping[str, str]) -> None:
    """Writes named tensors and string metadata as one safetensors file, atomically; the same input gives the same
    bytes.
    """
    whole = {name: tensor.detach().cpu().contiguous() for name, tensor in sorted(tensors.items())}
    header = {**metadata, CHECKSUM: checksum_tensors(whole, metadata)}
    content = save(whole, metadata=header)
    with atomic_path(path) as temporary:
        temporary.write_bytes(_sorted_header(content))


def _sorted_header(content: bytes) -> bytes:
    """safetensors writes its metadata in hash order, which changes from process to process; sort it."""
    size = int.from_bytes(content[:8], "little")
    header = json.loads(content[8 : 8 + size])
    metadata = header.pop("__metadata__", {})
    text = json.dumps({"__metadata__": dict(sorted(metadata.items())), **header}, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    return len(text).to_bytes(8, "little") + text + content[8 + size :]


def read_some_tensors(path: Path, names: Iterable[str]) -> tuple[dict[str, Tensor], dict[str, str]]:
    """Named tensors and the metadata of a file that `write_tensors` wrote, unchecked against the checksum.

    Raises:
        DamagedFile: the file is missing, truncated, no safetensors file, or holds no tensor of a name.
    """
    with reading(path, "pt") as handle:
        metadata = dict(handle.metadata() or {})
        tensors = {name: handle.get_tensor(name) for name in names}
    metadata.pop(CHECKSUM, None)
    return tensors, metadata


def read_tensors(path: Path) -> tuple[dict[str, Tensor], dict[str, str]]:
    """Tensors and metadata of a file that `write_tensors` wrote.

    Raises:
        DamagedFile: the file is missing, truncated, no safetensors file, or its checksum does not match.
    """
    return read_checked(path, "pt", checksum_tensors)
