"""Nested dictionaries and lists of arrays, from whatever container a stranger's program wrote them into.

.npz, .npy, pickles (plain, or joblib's, packed or not) and PyTorch files come out alike. Nothing in them is run, and
what is not asked for is not made: a node is put together when its array is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, listed, shortened
from mrhubo.files.array_pickle import MODULES, load_pickle, steps_of
from mrhubo.files.checkpoint import SAVE_ANEW, is_old_torch, read_torch
from mrhubo.files.joblib_stream import Later
from mrhubo.files.matlab import is_matlab, read_matlab
from mrhubo.files.npz import open_npz, read_member
from mrhubo.files.packed import is_packed, open_unpacked
from mrhubo.files.records import RecordedObject, UnreadablePickle
from mrhubo.files.regular import MAX_BYTES as MAX_FILE
from mrhubo.files.regular import check_regular, naming, open_regular
from mrhubo.files.safe_pickle import MAX_BYTES
from mrhubo.files.tree_source import Member, Source
from mrhubo.files.values import from_record, name_of, to_float, unwrapped

_DEEPEST = 4
"""Lists of lists of numbers."""
_NPY = b"\x93NUMPY"


class Tree:
    """A node: a dictionary, a list, or something that may be an array, a number or a text."""

    def __init__(self, value: Any, source: Source, where: str = "") -> None:
        self._given, self._source, self.where = value, source, where

    @cached_property
    def _value(self) -> Any:
        given = self._given
        return unwrapped(self._source.member(given.key) if isinstance(given, Member) else given)

    @property
    def path(self) -> Path:
        """The file."""
        return self._source.path

    @property
    def named(self) -> str:
        """The file and the place in it, for the beginning of a sentence."""
        return f"{self.path}: '{self.where}'" if self.where else str(self.path)

    @property
    def is_mapping(self) -> bool:
        """Whether it has keys."""
        return isinstance(self._value, dict)

    @property
    def is_list(self) -> bool:
        """Whether it is a list or a tuple, or an array of objects."""
        return isinstance(self._value, list | tuple)

    @property
    def is_none(self) -> bool:
        """Whether it is Python's `None`, JSON's `null`."""
        return self._value is None

    @property
    def keys(self) -> tuple[str, ...]:
        """Of a dictionary, as texts; none of anything else."""
        return tuple(name for name, _ in self._entries())

    def items(self) -> Iterator[tuple[str, Tree]]:
        """Keys and nodes of a dictionary; none of anything else."""
        for name, value in self._entries():
            yield name, self._child(name, value)

    def get(self, *names: str) -> Tree | None:
        """The node under the first of some keys that there is."""
        entries = dict(self._entries())
        return next((self._child(name, entries[name]) for name in names if name in entries), None)

    def __getitem__(self, name: str) -> Tree:
        """The node under a key; UserError where there is none."""
        found = self.get(name)
        if found is None:
            raise UserError(f"{self.named} is {self.described}; expected one with '{name}'")
        return found

    def renamed(self, names: Mapping[str, str], inner: Mapping[str, Mapping[str, str]] | None = None) -> Tree:
        """Some entries of a dictionary under other keys.

        Args:
            names: the other keys, and the dictionary's own.
            inner: the same of dictionaries that are put into it, by their keys.
        """
        entries = dict(self._entries())

        def under(chosen: Mapping[str, str], where: str) -> Tree:
            return Tree({name: self._child(own, entries[own]) for name, own in chosen.items()}, self._source, where)

        found = under(names, self.where)
        for name, chosen in (inner or {}).items():
            found._given[name] = under(chosen, f"{self.where}[{name}]" if self.where else name)
        return found

    def places(self, count: int) -> Iterator[Tree]:
        """Of a dictionary of lists, what stands at each of so many places: a dictionary of the entries that are lists
        as long.
        """
        lists = {name: list(child) for name, child in self.items() if len(child) == count and child.is_list}
        for place in range(count):
            at = {name: children[place] for name, children in lists.items()}
            yield Tree(at, self._source, f"{self.where}[{place}]" if self.where else f"[{place}]")

    def by_names(self, names: Sequence[str]) -> Tree:
        """The nodes of a list as a dictionary, under one name each."""
        return Tree(dict(zip(names, self, strict=True)), self._source, self.where)

    def __len__(self) -> int:
        return len(self._value) if isinstance(self._value, dict | list | tuple) else 0

    def __iter__(self) -> Iterator[Tree]:
        """The nodes of a list; none of anything else."""
        if self.is_list:
            for number, value in enumerate(self._value):
                yield Tree(value, self._source, f"{self.where}[{number}]")

    def array(self) -> np.ndarray:
        """The array of numbers that it is; lists of numbers, and of arrays of one shape, make one.

        Raises:
            UserError: it is none.
        """
        return self._array(_DEEPEST)

    def shape(self) -> tuple[int, ...] | None:
        """Of the array that it is; None where it is none."""
        if isinstance(self._value, Later):
            return self._value.shape
        try:
            return self.array().shape
        except UserError:
            return None

    def number(self) -> float:
        """The number that it is, or that an array of one number holds.

        Raises:
            UserError: it is none, or NaN or infinite.
        """
        array = self.array()
        if array.size != 1:
            raise UserError(f"{self.named} has shape {array.shape}; expected one number")
        number = float(array.reshape(()))
        if not math.isfinite(number):
            raise UserError(f"{self.named} is {number:g}; expected a number")
        return number

    def find_array(self, *names: str) -> np.ndarray | None:
        """The array under the first of some keys that there is; None where there is none, or it is no array."""
        found = self.get(*names)
        return None if found is None or found.shape() is None else found.array()

    def text(self) -> str | None:
        """The text that it is; None where it is none."""
        value = self._value
        if isinstance(value, np.ndarray) and value.dtype.kind == "U" and value.size == 1:
            value = str(value.reshape(()))
        return value if isinstance(value, str) else None

    def texts(self) -> list[str]:
        """The texts of a list or an array of such; none where it is neither."""
        value = self._value
        if isinstance(value, np.ndarray) and value.dtype.kind == "U" and value.ndim == 1:
            return value.tolist()
        return [text for node in self if (text := node.text()) is not None]

    @property
    def described(self) -> str:
        """In words."""
        if self.is_mapping:
            return f"a dictionary with {shortened(listed(self.keys), 200)}"
        if self.is_list:
            return f"a list of {len(self):,}"
        if isinstance(self._value, Later | np.ndarray):
            return f"an array of shape {self._value.shape}"
        if isinstance(self._value, RecordedObject):
            shape = self.shape()
            return f"an array of shape {shape}" if shape is not None else f"an object '{shortened(self._value.kind)}'"
        return "None" if self.is_none else f"a {type(self._value).__name__}"

    def _child(self, name: str, value: Any) -> Tree:
        if isinstance(value, Tree):  # of `renamed`: it is called by its own name
            return value
        return Tree(value, self._source, f"{self.where}[{shortened(name, 40)}]" if self.where else shortened(name, 40))

    def _entries(self) -> Iterator[tuple[str, Any]]:
        if isinstance(self._value, dict):
            for key, value in self._value.items():
                name = name_of(key)
                if name is not None:
                    yield name, value

    def _array(self, deepest: int) -> np.ndarray:
        value, made = self._value, self._source.made
        if id(value) not in made:
            made[id(value)] = self._make(value, deepest)
        return made[id(value)]

    def _make(self, value: Any, deepest: int) -> np.ndarray:
        if isinstance(value, bool):
            return np.array(value)
        if isinstance(value, int | float):
            return np.array(to_float(value, self.named))
        if isinstance(value, np.ndarray) and value.dtype.kind in "fiub":
            return value
        if isinstance(value, Later):
            return value.read(self.path)
        if isinstance(value, RecordedObject):
            return from_record(value, self._source.storages, self.named)
        if not self.is_list or not len(self):
            raise UserError(f"{self.named} is {self.described}; expected an array")
        self._source.count(len(value))
        if all(isinstance(number, int | float) for number in value):
            return np.array([to_float(number, self.named) for number in value])
        if deepest == 0:
            raise UserError(f"{self.named} is a list of lists, more than {_DEEPEST} deep")
        arrays = [child._array(deepest - 1) for child in self]
        shapes = {array.shape for array in arrays}
        if len(shapes) > 1:
            found = shortened(" and ".join(map(str, sorted(shapes)[:3])))
            raise UserError(f"{self.named} is a list of arrays of different shapes: {found}")
        self._source.count(len(arrays) * arrays[0].size)
        return np.stack(arrays)


def tree_of(value: Any, path: Path, where: str) -> Tree:
    """The node of something that was read of a file already, and where in that it is."""
    return Tree(value, Source(path), where)


def read_tree(path: Path) -> Tree:
    """What a file holds: a PyTorch file, an .npz or .npy file, a MATLAB file, or a pickle, packed or not.

    Raises:
        UserError: it is none of these, damaged, hostile, or too large.
    """
    with naming(path):
        with open_regular(path) as handle:
            start = handle.read(64)
        if start.startswith(b"PK"):
            return _read_zip(path)
        if is_matlab(start):
            return Tree(read_matlab(path), Source(path))
        if is_old_torch(start):
            raise UserError(f"was saved by torch before 1.6; {SAVE_ANEW}")
        with open_unpacked(path, MAX_BYTES, MAX_FILE) as handle:
            if start.startswith(_NPY):
                size = check_regular(path, MAX_BYTES)
                return Tree(read_member(handle, size, load_pickle), Source(path))
            try:
                return Tree(load_pickle(handle), Source(path))
            except UnreadablePickle as error:
                if not is_packed(start):
                    raise
                raise UserError("is packed, and what is in it is no pickle; unpack it first") from error


def _read_zip(path: Path) -> Tree:
    with open_npz(path) as file:
        keys = sorted(file.keys)
    if keys:
        return Tree({key: Member(key) for key in keys}, Source(path))
    content, storages = read_torch(path, MODULES, steps_of(check_regular(path)))
    return Tree(content, Source(path, storages))
