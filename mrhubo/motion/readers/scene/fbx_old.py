"""FBX files of version 6 (FBX 2006 to 2010), as records of version 7: what has a name there gets a number.

Properties, connections and curves are told otherwise in them: a curve's keys stand in one list, in which letters say
how it goes on from each.

Legend: K keys.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mrhubo.motion.readers.scene.fbx_curves import CONSTANT, CUBIC, HEAVY_LEFT, HEAVY_RIGHT, LIGHT, LINEAR, NEXT, USER
from mrhubo.motion.readers.scene.fbx_file import Array, BadFbx, Record
from mrhubo.motion.readers.scene.fbx_nodes import MOVED, SCALED, TURNED

_WHAT = {"T": MOVED, "R": TURNED, "S": SCALED}
_AXES = ("X", "Y", "Z")
_KINDS = {"L": LINEAR, "C": CONSTANT, "U": CUBIC}
_WEIGHTS = {"n": 0, "c": 0, "a": 2, "l": 1, "r": 1}
"""How many lengths of tangents follow a letter."""


def modernised(root: Record) -> Record:
    """The records of a file as one of version 7 has them.

    Raises:
        BadFbx: keys of a curve are damaged.
    """
    new = _New()
    for record in root.first("Objects").children:
        if record.text(0):
            inside = [*record.named("TransformLink"), *(new.posed(row) for row in record.named("PoseNode"))]
            parts = [*inside, _properties(record)]
            new.add(record.name, new.number(record.text(0)), record.text(0), record.values[1:], parts)
    for row in root.first("Connections").named("Connect"):
        if row.text(1) and row.text(2):
            new.link(row.text(0), new.number(row.text(1)), new.number(row.text(2)))
    for take in root.first("Takes").named("Take"):
        _read_take(take, new)
    settings = Record("GlobalSettings", [], [_properties(root.first("Objects").first("GlobalSettings"))])
    parts = [Record("Objects", [], new.objects), Record("Connections", [], new.links)]
    return Record("", [], [root.first("FBXHeaderExtension"), settings, *parts])


@dataclass
class _New:
    """What is made."""

    objects: list[Record] = field(default_factory=list)
    links: list[Record] = field(default_factory=list)
    numbers: dict[str, int] = field(default_factory=dict)
    last: int = 0

    def number(self, name: str = "") -> int:
        """The number of an object of a name; a new one where it has none."""
        if name in self.numbers:
            return self.numbers[name]
        self.last += 1
        if name:
            self.numbers[name] = self.last
        return self.last

    def add(self, kind: str, number: int, name: str, values: list[Any], inside: list[Record]) -> int:
        """Adds an object."""
        self.objects.append(Record(kind, [number, name, *values], inside))
        return number

    def link(self, kind: str, child: int, parent: int, what: str = "") -> None:
        """Connects two objects."""
        self.links.append(Record("C", [kind, child, parent, what]))

    def posed(self, row: Record) -> Record:
        """A node in a pose."""
        name = row.first("Node").text(0)
        return Record("PoseNode", [], [Record("Node", [self.number(name)] if name else []), row.first("Matrix")])


def _properties(record: Record) -> Record:
    """The properties of an object."""
    rows = [_property(row) for row in record.first("Properties60").named("Property")]
    return Record("Properties70", [], [row for row in rows if row is not None])


def _property(row: Record) -> Record | None:
    """A property: a name, a kind, flags, and values, which stand one place later in version 7."""
    return Record("P", [row.values[0], row.values[1], "", *row.values[2:]]) if len(row.values) > 2 else None


def _read_take(take: Record, new: _New) -> None:
    """Adds an animation."""
    stack = new.add("AnimationStack", new.number(), take.text(0), [""], [])
    layer = new.add("AnimationLayer", new.number(), "", [""], [])
    new.link("OO", layer, stack)
    for model in take.named("Model"):
        moving = next((row for row in model.named("Channel") if row.text(0) == "Transform"), Record(""))
        for channel in moving.named("Channel"):
            axes = [row for row in channel.named("Channel") if row.text(0) in _AXES]
            if channel.text(0) not in _WHAT or not axes:
                continue
            three = new.add("AnimationCurveNode", new.number(), "", [""], [])
            new.link("OO", three, layer)
            new.link("OP", three, new.number(model.text(0)), _WHAT[channel.text(0)])
            for row in axes:
                if row.first("Key").values:
                    curve = new.add("AnimationCurve", new.number(), "", [""], _read_keys(row.first("Key").values))
                    new.link("OP", curve, three, f"d|{row.text(0)}")


def _read_keys(values: list[Any]) -> list[Record]:
    """The keys of a curve as version 7's arrays.

    Raises:
        BadFbx: something is missing, or is no number.
    """
    ticks, numbers, kinds, data = [], [], [], []
    words = iter(values[0].numbers().tolist() if isinstance(values[0], Array) else values)
    try:
        for tick in words:
            ticks.append(int(tick))
            numbers.append(float(next(words)))
            kind, told = _read_way(words)
            kinds.append(kind)
            data.append(told)
    except StopIteration as error:
        raise BadFbx("has a curve whose last key is cut off") from error
    except (ValueError, TypeError, OverflowError, KeyError) as error:
        raise BadFbx(f"has a curve with a key that is none: {error}") from error
    arrays = {
        "KeyTime": np.array(ticks, np.int64),
        "KeyValueFloat": np.array(numbers, np.float64),
        "KeyAttrFlags": np.array(kinds, np.int32),
        "KeyAttrRefCount": np.ones(len(kinds), np.int32),
        "KeyAttrDataFloat": np.array(data, np.float64).reshape(-1),
    }
    return [Record(name, [Array(x.dtype.str, len(x), x.tobytes())]) for name, x in arrays.items()]


def _read_way(words: Iterator[Any]) -> tuple[int, tuple[float, float, float, float]]:
    """How a curve goes on from a key: bits, and slopes and lengths of tangents as version 7 has them."""
    kind = _letter(words)
    bits = _KINDS[kind]
    if kind == "C":
        return bits | NEXT * (_letter(words) == "n"), (0.0, 0.0, 0.0, 0.0)
    if kind == "L":
        return bits, (0.0, 0.0, 0.0, 0.0)
    way = _letter(words)
    slopes, letters = [0.0, 0.0], 1
    if way in "sb":
        slopes, bits = [float(next(words)) for _ in range(2)], bits | USER
    elif way in "pt":  # of these nobody knows what their numbers are
        for _ in range(2 if way == "p" else 3):
            next(words)
        letters = 2 if way == "p" else 0
    elif way != "a":
        raise ValueError(f"'{way}' is no kind of slope")
    lengths = 0
    for _ in range(letters):
        letter = _letter(words)
        told = [round(min(max(float(next(words)), 0.0), 1.0) / LIGHT) for _ in range(_WEIGHTS[letter])]
        if letter in "ar":
            bits, lengths = bits | HEAVY_RIGHT, lengths | told[0]
        if letter in "al":
            bits, lengths = bits | HEAVY_LEFT, lengths | told[-1] << 16
    packed = float(np.array([lengths], np.uint32).view(np.float32)[0])
    return bits, (slopes[0], slopes[1], packed, 0.0)


def _letter(words: Iterator[Any]) -> str:
    """A letter, which binary files have as its number."""
    word = next(words)
    return word if isinstance(word, str) else chr(int(word))
