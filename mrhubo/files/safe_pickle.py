"""Reading pickles of strangers without executing anything.

A pickle names functions and classes and has them called. Here no name is ever imported: each becomes a class of our
own that records what it was called with, and arrays are put together afterwards from those records, with their sizes
checked. Names from modules that the kind of file has no business with are refused.
"""

from __future__ import annotations

import io
import math
import pickle
import zipfile
from collections import OrderedDict
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from mrhubo.errors import UserError

MAX_BYTES = 4 * 2**30
"""Largest file that is read."""
_ARRAYS = ("_reconstruct", "_frombuffer")
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


class RecordedObject:
    """What a pickled object was called, made with, and given as its state; it does nothing."""

    __slots__ = ("args", "state")
    module = ""
    args: tuple[Any, ...]
    state: Any

    def __new__(cls, *args: Any, **_: Any) -> RecordedObject:
        """Records what the pickle calls the class with."""
        self = object.__new__(cls)
        self.args, self.state = args, None
        return self

    def __setstate__(self, state: Any) -> None:
        self.state = state

    def __setitem__(self, key: Any, value: Any) -> None:
        """Entries of unknown mappings are passed over."""

    def append(self, value: Any) -> None:
        """So are those of unknown lists, and sets."""

    extend = add = append

    @property
    def kind(self) -> str:
        """Module and name."""
        return f"{self.module}.{type(self).__name__}"


class _RestrictedUnpickler(pickle.Unpickler):
    """Python's unpickler, that imports nothing: every name becomes a `RecordedObject` made for this one file."""

    def __init__(self, file: io.BufferedIOBase, modules: Iterable[str]) -> None:
        super().__init__(file, encoding="latin1")
        self.modules, self.names = tuple(modules), {}

    def find_class(self, module: str, name: str) -> Any:
        if module.partition(".")[0] not in self.modules:
            raise UserError(f"it asks for '{module}.{name}', which a file of this kind has no use for; nothing was run")
        if (module, name) == ("collections", "OrderedDict"):
            return OrderedDict
        if (module, name) not in self.names:
            self.names[module, name] = type(name, (RecordedObject,), {"module": module, "__slots__": ()})
        return self.names[module, name]

    def persistent_load(self, pid: Any) -> Any:
        """torch's reference to a storage."""
        return pid


def unpickle(file: io.BufferedIOBase, modules: Iterable[str]) -> Any:
    """What a pickle holds, with `RecordedObject` in place of every object that is not plain Python.

    Args:
        file: an open binary file.
        modules: top-level modules whose names the pickle may mention.

    Raises:
        UserError: it is no pickle, is truncated, or mentions another module.
    """
    try:
        return _RestrictedUnpickler(file, modules).load()
    except UserError:
        raise
    except Exception as error:  # whatever the unpickler makes of a stranger's bytes
        raise UserError(f"it is no readable pickle: {error or type(error).__name__}") from error


def to_array(value: Any) -> np.ndarray:
    """The array that a pickled ndarray, scipy sparse matrix (as a dense one) or chumpy object stands for.

    Raises:
        UserError: it stands for something else, or its parts do not fit together.
    """
    try:
        return _to_array(value)
    except UserError:
        raise
    except Exception as error:  # records that do not fit together
        raise UserError(f"its parts do not make an array: {error or type(error).__name__}") from error


def _to_array(value: Any) -> np.ndarray:
    if not isinstance(value, RecordedObject):
        raise UserError(f"expected an array, found {type(value).__name__}")
    made, root = type(value).__name__, value.module.partition(".")[0]
    if root == "copy_reg" or root == "copyreg":  # object.__reduce__ of protocol 0 and 1
        root, made = value.args[0].module.partition(".")[0], value.args[0].__name__
    if root == "numpy" and made in _ARRAYS:
        return _dense(value)
    if root == "scipy" and made in ("csc_matrix", "csr_matrix", "csc_array", "csr_array"):
        return _sparse(value.state, by_column=made.startswith("csc"))
    if root == "chumpy":
        return _chumpy(value.state, made)
    raise UserError(f"expected an array, found a {value.kind}")


def _dense(value: RecordedObject) -> np.ndarray:
    if type(value).__name__ == "_frombuffer":
        content, dtype, shape, order = value.args
    else:
        _, shape, dtype, is_fortran, content = value.state
        order = "F" if is_fortran else "C"
    # In old protocols Python 3 writes bytes as _codecs.encode(text, "latin1"), or as bytes().
    if isinstance(content, RecordedObject):
        content = content.args[0] if content.args else b""
    content = content.encode("latin1") if isinstance(content, str) else bytes(content)
    return np.frombuffer(content, dtype=_dtype(dtype)).reshape(tuple(int(n) for n in shape), order=order)


def _dtype(value: RecordedObject) -> np.dtype:
    name, order = str(value.args[0]), "<"
    if value.state is not None and value.state[1] == ">":
        order = ">"
    if name[:1] not in "fiub" or not name[1:].isdigit():
        raise UserError(f"expected an array of numbers, found one of type '{name}'")
    return np.dtype(order + name)


def _sparse(state: dict[str, Any], by_column: bool) -> np.ndarray:
    rows, columns = (int(n) for n in state["_shape"])
    data, indices, starts = (_to_array(state[key]) for key in ("data", "indices", "indptr"))
    major, minor = (columns, rows) if by_column else (rows, columns)
    counts = np.diff(starts)
    fits = starts.shape == (major + 1,) and len(data) == len(indices) == starts[-1] and (counts >= 0).all()
    if not fits or rows * columns * 8 > MAX_BYTES or (len(indices) and not 0 <= indices.min() <= indices.max() < minor):
        raise UserError(f"a sparse matrix of shape ({rows}, {columns}) does not fit its entries")
    dense = np.zeros((major, minor))
    np.add.at(dense, (np.repeat(np.arange(major), counts), indices), data)
    return dense.T if by_column else dense


def _chumpy(state: dict[str, Any], made: str) -> np.ndarray:
    """chumpy keeps a plain array as `x`, and a selection as `a` (the whole), `idxs` and `preferred_shape`."""
    if "x" in state:
        return _to_array(state["x"])
    if {"a", "idxs", "preferred_shape"} <= set(state):
        chosen = _to_array(state["a"]).ravel()[_to_array(state["idxs"]).astype(np.int64)]
        return chosen.reshape(tuple(int(n) for n in state["preferred_shape"]))
    raise UserError(f"is a chumpy expression ({made}) that is not understood")


_CHECKPOINT_MODULES = (
    *("torch", "collections", "numpy", "copyreg", "copy_reg", "_codecs", "pathlib", "argparse", "types"),
    *("pytorch_lightning", "lightning", "lightning_fabric", "omegaconf", "dotmap", "yacs", "human_body_prior"),
)
_STORAGE_PARTS = 5


def read_checkpoint(path: Path) -> tuple[dict[str, Any], dict[str, bytes]]:
    """A PyTorch checkpoint (`torch.save`, since 1.6): nested dictionaries with records of tensors, and their storages.

    Unlike `torch.load(weights_only=True)` it reads files that hold other objects too, such as Lightning's callbacks,
    since those are neither imported nor made. `to_tensor` makes a tensor of both.

    Raises:
        UserError: the file is missing, too large, no such checkpoint, or names a module that it has no use for.
    """
    check_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
            pickles = [name for name in names if name.endswith("data.pkl") and name.count("/") == 1]
            if len(pickles) != 1:
                raise UserError("is no PyTorch checkpoint: it has no data.pkl")
            folder = pickles[0].removesuffix("data.pkl") + "data/"
            if sum(info.file_size for info in archive.infolist()) > MAX_BYTES:
                raise UserError(f"unpacks to more than {MAX_BYTES / 2**30:g} GiB")
            storages = {n.removeprefix(folder): archive.read(n) for n in names if n.startswith(folder)}
            content = unpickle(io.BytesIO(archive.read(pickles[0])), _CHECKPOINT_MODULES)
    except UserError as error:
        raise UserError(f"{path}: {error}") from error
    except Exception as error:  # whatever zipfile makes of a stranger's bytes
        raise UserError(
            f"{path}: is truncated, damaged, or no PyTorch checkpoint (a zip archive, as torch.save writes since 1.6): "
            f"{error or type(error).__name__}"
        ) from error
    if not isinstance(content, dict):
        raise UserError(f"{path}: expected a dictionary, found {type(content).__name__}")
    return content, storages


def to_tensor(value: Any, storages: dict[str, bytes]) -> Tensor:
    """The tensor that a pickled one stands for, float32.

    Raises:
        UserError: it stands for something else, or reaches beyond its storage.
    """
    if isinstance(value, RecordedObject) and type(value).__name__ == "_rebuild_parameter":
        value = value.args[0]
    if not isinstance(value, RecordedObject) or type(value).__name__ != "_rebuild_tensor_v2":
        kind = value.kind if isinstance(value, RecordedObject) else type(value).__name__
        raise UserError(f"expected a tensor, found {kind}")
    try:
        reference, offset, shape, stride = value.args[:4]
        kind, key = reference[1].__name__, str(reference[2])
        numbers = np.frombuffer(storages[key], dtype=_TORCH_TYPES[kind])
        last = offset + sum((n - 1) * s for n, s in zip(shape, stride, strict=True))
        if len(reference) != _STORAGE_PARTS or math.prod(shape) == 0 or min((*stride, offset, 0)) < 0:
            raise UserError(f"a tensor has shape {tuple(shape)} and stride {tuple(stride)}")
        if last >= len(numbers) or math.prod(shape) > len(numbers):
            raise UserError(f"a tensor of shape {tuple(shape)} reaches beyond its {len(numbers)} numbers")
        return torch.from_numpy(numbers.astype(np.float32)).as_strided(tuple(shape), tuple(stride), offset).clone()
    except UserError:
        raise
    except Exception as error:  # records that do not fit together
        raise UserError(f"its parts do not make a tensor: {error or type(error).__name__}") from error


def check_file(path: Path) -> None:
    """Refuses a file that is missing or absurdly large."""
    if not path.is_file():
        raise UserError(f"{path}: there is no such file")
    if path.stat().st_size > MAX_BYTES:
        raise UserError(f"{path}: has {path.stat().st_size / 2**30:.1f} GiB; at most {MAX_BYTES / 2**30:g} are read")
