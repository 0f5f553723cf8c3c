"""Tensors in PyTorch checkpoints of strangers (`torch.save`): a zip archive, and before 1.6 one pickle after another.

They are put together from the records that `mrhubo.files.unpickler` makes of a pickle, with their sizes checked before
anything of that size is made.
"""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.archive import check_member, open_archive
from mrhubo.files.records import RecordedObject
from mrhubo.files.regular import naming, open_regular
from mrhubo.files.safe_pickle import MAX_BYTES, bytes_of, shape_of
from mrhubo.files.unpickler import unpickle

if TYPE_CHECKING:
    from torch import Tensor

_TORCH_TYPES = {
    "DoubleStorage": "<f8",
    "FloatStorage": "<f4",
    "HalfStorage": "<f2",
    "LongStorage": "<i8",
    "IntStorage": "<i4",
    "ShortStorage": "<i2",
    "CharStorage": "<i1",
    "ByteStorage": "<u1",
    "BoolStorage": "<u1",
}
_CHECKPOINT_MODULES = (
    *("torch", "collections", "numpy", "copyreg", "copy_reg", "_codecs", "pathlib", "argparse", "types"),
    *("pytorch_lightning", "lightning", "lightning_fabric", "omegaconf", "dotmap", "yacs", "human_body_prior"),
)
_STORAGE_PARTS = 5
_OLD_MAGIC = bytes.fromhex("80028a0a6cfc9c46f9206aa850192e")
"""The pickled number that torch before 1.6 began its files with."""
_OLD_PICKLES = 3
"""Pickles before the content of such a file: that number, its version, and the machine's sizes of numbers."""


def read_checkpoint(path: Path) -> tuple[dict[str, Any], dict[str, bytes]]:
    """A PyTorch checkpoint (`torch.save`): nested dictionaries with records of tensors, and their storages.

    Unlike `torch.load(weights_only=True)` it reads files that hold other objects too, such as Lightning's callbacks,
    since those are neither imported nor made. `to_tensor` makes a tensor of both. Of a file that torch before 1.6 wrote
    it gives the records alone, and no storages.

    Raises:
        UserError: the file is missing, too large, no such checkpoint, or names a module that it has no use for.
    """
    with naming(path):
        content, storages = _read_old(path) or read_torch(path)
    if not isinstance(content, dict):
        raise UserError(f"{path}: expected a dictionary, found {type(content).__name__}")
    return content, storages


def _read_old(path: Path) -> tuple[Any, dict[str, bytes]] | None:
    """The records of a file of torch before 1.6, which is one pickle after another; None if it is none."""
    with open_regular(path, MAX_BYTES) as handle:
        start = handle.read(512)
        if start[257:262] == b"ustar":
            raise UserError(f"is a checkpoint of torch before 0.2; {SAVE_ANEW}")
        if not is_old_torch(start):
            return None
        handle.seek(0)
        for _ in range(_OLD_PICKLES):
            unpickle(handle, ())
        return unpickle(handle, _CHECKPOINT_MODULES), {}


SAVE_ANEW = "load it with a torch that you trust it with, and save it anew"


def is_old_torch(start: bytes) -> bool:
    """Whether a file that begins so was written by torch before 1.6."""
    return start.startswith(_OLD_MAGIC)


def read_torch(
    path: Path, modules: tuple[str, ...] = _CHECKPOINT_MODULES, max_steps: int | None = None
) -> tuple[Any, dict[str, bytes]]:
    """Records and storages of a zip archive, as torch writes since 1.6; arguments as for `unpickle`.

    Raises:
        UserError: it is no such archive, or `unpickle` refuses what is in it.
    """
    otherwise = "is truncated, damaged, or no PyTorch checkpoint (a zip archive, as torch.save writes since 1.6)"
    with open_archive(path, otherwise, MAX_BYTES) as archive:
        names = archive.namelist()
        pickles = [name for name in names if name.endswith("data.pkl") and name.count("/") == 1]
        if len(pickles) != 1:
            raise UserError("is no PyTorch checkpoint: it has no data.pkl")
        if any(name.endswith("constants.pkl") for name in names):
            raise UserError("is a TorchScript program, not a checkpoint of weights")
        folder = pickles[0].removesuffix("data.pkl") + "data/"
        try:
            storages = {
                name.removeprefix(folder): archive.read(check_member(archive, name))
                for name in names
                if name.startswith(folder)
            }
            content = archive.read(check_member(archive, pickles[0]))
        except Exception as error:  # whatever zipfile makes of a stranger's bytes
            raise UserError(otherwise) from error
        return unpickle(io.BytesIO(content), modules, max_steps), storages


def to_tensor(value: Any, storages: dict[str, bytes]) -> Tensor:
    """The tensor that a pickled one stands for, float32; raises what `numbers_of` does."""
    import torch

    with np.errstate(over="ignore"):
        return torch.from_numpy(numbers_of(value, storages).astype(np.float32))


def numbers_of(value: Any, storages: dict[str, bytes]) -> np.ndarray:
    """The numbers of the tensor that a pickled one stands for, of its type: times since 1970 are not exact in less.
    PyTorch, which takes a second to import, is not needed for that.

    Raises:
        UserError: it stands for something else, or reaches beyond its storage.
    """
    if isinstance(value, RecordedObject) and type(value).__name__ == "_rebuild_parameter" and value.args:
        value = value.args[0]
    if not isinstance(value, RecordedObject) or type(value).__name__ != "_rebuild_tensor_v2":
        kind = shortened(value.kind) if isinstance(value, RecordedObject) else type(value).__name__
        raise UserError(f"expected a tensor, found {kind}")
    try:
        reference, offset, shape, stride = value.args[:4]
        shape, stride = shape_of(shape), shape_of(stride)
        if isinstance(reference, RecordedObject):
            reference, storages = _inner_storage(reference)
        kind, key, parts = reference[1].__name__, reference[2], len(reference)
        if kind not in _TORCH_TYPES or not isinstance(key, str) or not isinstance(offset, int):
            raise UserError("a tensor's storage is of another type than numbers, or has no name")
        if key not in storages:
            raise UserError(
                f"the numbers of a tensor are not in the file, or were saved by torch before 1.6: {SAVE_ANEW}"
            )
        numbers = np.frombuffer(storages[key], dtype=_TORCH_TYPES[kind])
        last = offset + sum((n - 1) * s for n, s in zip(shape, stride, strict=True))
        if parts < _STORAGE_PARTS or math.prod(shape) == 0 or offset < 0:
            raise UserError(f"a tensor has shape {shape} and stride {stride}")
        if last >= len(numbers) or math.prod(shape) > len(numbers):
            raise UserError(f"a tensor of shape {shape} reaches beyond its {len(numbers)} numbers")
        numbers = numbers[offset : last + 1]
        strides = [step * numbers.itemsize for step in stride]
        return np.lib.stride_tricks.as_strided(numbers, shape, strides).copy()
    except UserError:
        raise
    except Exception as error:  # records that do not fit together
        raise UserError("its parts do not make a tensor") from error


def _inner_storage(value: RecordedObject) -> tuple[Any, dict[str, bytes]]:
    """A storage inside a pickle: its reference, and its numbers under its name.

    `pickle.dump` of a tensor puts a whole file of torch before 1.6 there: four pickles, the last of which is the
    reference, one more of the names of storages, then how many numbers the storage has (8 bytes), and the numbers
    (`torch.serialization._legacy_save`).
    """
    if value.kind != "torch.storage._load_from_bytes":
        raise UserError(f"expected a tensor's storage, found a {shortened(value.kind)}")
    content = bytes_of(value.args[0])
    if not is_old_torch(content):
        raise UserError("a tensor's storage is not one that torch pickles")
    handle = io.BytesIO(content)
    for _ in range(_OLD_PICKLES):
        unpickle(handle, ())
    reference, keys = unpickle(handle, ("torch",)), unpickle(handle, ())
    if not isinstance(reference, tuple) or keys != [reference[2]]:
        raise UserError("a tensor's storage does not have the name that its reference says")
    return reference, {reference[2]: content[handle.tell() + 8 :]}
