"""Reading pickles of strangers without executing anything, in bounded time and memory.

A pickle names functions and classes and has them called. Here no name is ever imported: each becomes a class of our
own that records what it was called with. Names from modules that the kind of file has no business with are refused.

Nor can a small file keep the reader busy or fill the memory: what it may do is counted, places in its memo are kept by
name, nothing is made that is larger than the file, and nothing is hashed whose parts the file repeats (a pair of a pair
of a pair ... is a few bytes, and takes for ever to hash).
"""

from __future__ import annotations

import io
import pickle
import sys
from collections import OrderedDict, defaultdict
from collections.abc import Callable, Iterable
from typing import Any, BinaryIO

from mrhubo.errors import UserError, shortened
from mrhubo.files.records import RecordedObject, Stream, UnreadablePickle

OTHERS = "*"
"""Among modules: all that are none of Python's own."""
MAX_STEPS = 500_000
"""Steps that a pickle may take, unless more are allowed; those of body models and checkpoints take some thousands."""
_PYTHONS = {*sys.stdlib_module_names, "__builtin__", "commands", "exceptions"}
"""Python's own modules, and those of Python 2 that are called otherwise there and may do harm."""
_MAX_NAMES = 1_000
"""Different functions and classes that it may name."""
_LARGEST_INT_KEY = 2**63
_MAX_TUPLE_KEY = 16
_DEEPEST = 3
"""Pickles inside a pickle's stream."""


_MAPPINGS: dict[tuple[str, str], type[Any]] = {
    ("collections", "OrderedDict"): OrderedDict,
    ("collections", "defaultdict"): defaultdict,
}
"""Mappings whose entries are kept; a `defaultdict` comes out as a plain dictionary, without what makes new entries."""


def unpickle(
    file: BinaryIO | io.BufferedIOBase,
    modules: Iterable[str],
    max_steps: int | None = None,
    replace: Callable[[RecordedObject, Stream], Any] | None = None,
) -> Any:
    """What a pickle holds, with `RecordedObject` in place of every object that is not plain Python; sets come out
    empty, as nothing here reads them.

    Args:
        file: an open binary file; what follows the pickle is left unread, or not, as it happens.
        modules: top-level modules whose names the pickle may mention, single names of others with their module
            (`builtins.dict`), and `OTHERS`.
        max_steps: how many steps it may take; default: `MAX_STEPS`.
        replace: is asked, when an object has been given its state, what shall stand in its place; formats that write
            raw bytes into a pickle's stream read them here.

    Raises:
        UnreadablePickle: it is no pickle, or is truncated.
        UserError: it mentions another module, or wants too much.
    """
    try:
        return _RestrictedUnpickler(_Reader(file), modules, max_steps or MAX_STEPS, replace).load()
    except UserError:
        raise
    except Exception as error:  # whatever the unpickler makes of a stranger's bytes
        raise UnreadablePickle("it is no readable pickle") from error


class _Reader:
    """Reads no more than there is: the unpickler asks for as many bytes as the file tells it to."""

    def __init__(self, file: BinaryIO | io.BufferedIOBase) -> None:
        self._file = file
        here = file.tell()
        self._end = file.seek(0, io.SEEK_END)
        self._left = self._end - here
        file.seek(here)
        self.readline = file.readline

    def read(self, size: int) -> bytes:
        return self._file.read(min(size, self._left)) if size >= 0 else b""

    def passed(self, size: int) -> int | None:
        here = self._file.tell()
        if not isinstance(self._file, io.BufferedReader) or not 0 <= size <= self._end - here:
            return None
        self._file.seek(size, io.SEEK_CUR)
        return here


# The pure Python one: the other, in C, makes room for as many places as the highest number in the memo says.
class _RestrictedUnpickler(pickle._Unpickler):
    """Python's unpickler, whose steps that call, set or hash something are ours."""

    dispatch: dict[int, Callable[[Any], None]] = {}
    stack: list[Any]
    append: Callable[[Any], None]
    read: Callable[[int], bytes]
    readline: Callable[[], bytes]
    pop_mark: Callable[[], list[Any]]

    def __init__(
        self,
        source: _Reader,
        modules: Iterable[str],
        max_steps: int,
        replace: Callable[[RecordedObject, Stream], Any] | None,
        depth: int = 0,
    ) -> None:
        super().__init__(source, encoding="latin1")
        self.source, self.modules, self.names, self.steps = source, tuple(modules), {}, 0
        self.max_steps, self.replace, self.depth = max_steps, replace, depth

    def find_class(self, module: str, name: str) -> type[Any]:
        """The class that records what a name is called with."""
        top = module.partition(".")[0]
        may_ask = top in self.modules or f"{module}.{name}" in self.modules
        if not may_ask and (OTHERS not in self.modules or top in _PYTHONS):
            asked = shortened(f"{module}.{name}")
            raise UserError(f"it asks for '{asked}', which a file of this kind has no use for; nothing was run")
        if (module, name) in _MAPPINGS:
            return _MAPPINGS[module, name]
        if (module, name) not in self.names:
            if len(self.names) >= _MAX_NAMES:
                raise UserError(f"it names more than {_MAX_NAMES:,} functions and classes")
            self.names[module, name] = type(name, (RecordedObject,), {"module": module, "__slots__": ()})
        return self.names[module, name]

    def persistent_load(self, pid: Any) -> Any:
        """torch's reference to a storage."""
        return pid

    def count(self) -> None:
        """One more step."""
        self.steps += 1
        if self.steps > self.max_steps:
            raise UserError(f"it takes more than {self.max_steps:,} steps, as no file of this kind does")

    def take(self, size: int) -> bytes:
        """See `Stream`."""
        return self.source.read(size)

    def passed(self, size: int) -> int | None:
        """See `Stream`."""
        return self.source.passed(size)

    def nested(self) -> Any:
        """See `Stream`."""
        if self.depth >= _DEEPEST:
            raise UserError(f"it has pickles in pickles, more than {_DEEPEST} deep")
        inner = _RestrictedUnpickler(self.source, self.modules, self.max_steps, self.replace, self.depth + 1)
        inner.names, inner.steps = self.names, self.steps
        found = inner.load()
        self.steps = inner.steps
        return found

    def _make(self, kind: Any, args: Any) -> None:
        """Puts what a name that `find_class` gave makes of its arguments onto the stack."""
        if kind is OrderedDict:
            made: Any = OrderedDict()
            _set(made, (tuple(pair) for pair in args[0]) if args else ())
        elif kind is defaultdict and isinstance(args, tuple):
            made = {}
        elif isinstance(kind, type) and issubclass(kind, RecordedObject) and isinstance(args, tuple):
            made = kind(*args)
        else:
            raise TypeError("a call of what is no name")
        self.append(made)

    def load_reduce(self) -> None:
        args, kind = self.stack.pop(), self.stack.pop()
        self._make(kind, args)

    def load_newobj_ex(self) -> None:
        _, args, kind = self.stack.pop(), self.stack.pop(), self.stack.pop()
        self._make(kind, args)

    def load_obj(self) -> None:
        kind, *args = self.pop_mark()
        self._make(kind, tuple(args))

    def load_inst(self) -> None:
        module, name = (self.readline()[:-1].decode("ascii") for _ in range(2))
        self._make(self.find_class(module, name), tuple(self.pop_mark()))

    def load_build(self) -> None:
        state, target = self.stack.pop(), self.stack[-1]
        if isinstance(target, RecordedObject):
            target.state = state
            if self.replace is not None:
                self.stack[-1] = self.replace(target, self)

    def load_append(self) -> None:
        value, target = self.stack.pop(), self.stack[-1]
        _extend(target, [value])

    def load_appends(self) -> None:
        values = self.pop_mark()
        _extend(self.stack[-1], values)

    def load_setitem(self) -> None:
        value, key, target = self.stack.pop(), self.stack.pop(), self.stack[-1]
        _set(target, [(key, value)])

    def load_setitems(self) -> None:
        items = self.pop_mark()
        _set(self.stack[-1], zip(items[::2], items[1::2], strict=True))

    def load_dict(self) -> None:
        items, made = self.pop_mark(), {}
        _set(made, zip(items[::2], items[1::2], strict=True))
        self.append(made)

    def load_additems(self) -> None:
        self.pop_mark()

    def load_frozenset(self) -> None:
        self.pop_mark()
        self.append(frozenset())

    def load_bytearray8(self) -> None:
        self.append(bytearray(self.read(int.from_bytes(self.read(8), "little"))))


def _set(target: Any, pairs: Iterable[tuple[Any, Any]]) -> None:
    """Entries of a dictionary; those of unknown mappings are passed over."""
    if isinstance(target, RecordedObject):
        return
    if not isinstance(target, dict):
        raise TypeError("entries of what is no dictionary")
    for key, value in pairs:
        simple = [key] if not isinstance(key, tuple) else key[: _MAX_TUPLE_KEY + 1]
        if len(simple) > _MAX_TUPLE_KEY or not all(map(_is_simple, simple)):
            raise UserError("it has a key that is neither text nor a number")
        target[key] = value


def _is_simple(key: Any) -> bool:
    """Whether a key is hashed at once, however often the file repeats it."""
    if isinstance(key, int):
        return abs(key) <= _LARGEST_INT_KEY
    return key is None or isinstance(key, str | bytes | float | RecordedObject | type)


def _extend(target: Any, values: list[Any]) -> None:
    """More items of a list; those of unknown lists and sets are passed over."""
    if isinstance(target, list):
        target.extend(values)
    elif not isinstance(target, RecordedObject):
        raise TypeError("items of what is no list")


def _counted(step: Callable[[Any], None]) -> Callable[[Any], None]:
    def take(unpickler: _RestrictedUnpickler) -> None:
        unpickler.count()
        step(unpickler)

    return take


def _dispatch() -> dict[int, Callable[[Any], None]]:
    """The unpickler's table of steps, with ours in place of those of the same name."""
    steps = {
        code: getattr(_RestrictedUnpickler, step.__name__, step) for code, step in pickle._Unpickler.dispatch.items()
    }
    steps[pickle.NEWOBJ[0]] = _RestrictedUnpickler.load_reduce
    return {code: _counted(step) for code, step in steps.items()}


_RestrictedUnpickler.dispatch = _dispatch()
