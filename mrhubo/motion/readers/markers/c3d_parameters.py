"""What a C3D file says of itself: parameters in groups (`POINT:LABELS` ...), and how its processor's numbers lie in
bytes: in the order of Intel's, DEC's or MIPS's (The C3D File Format User Guide, https://www.c3d.org).
"""

from __future__ import annotations

import math
import mmap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError

BLOCK = 512
"""Bytes of a block; parts of a file begin at one."""
CUT = "was it cut off?"
_INTEL, _DEC, _MIPS = 84, 85, 86
_MAX_PARAMETERS, _MAX_VALUE = 20_000, 2**20


@dataclass(frozen=True)
class Numbers:
    """How a processor's numbers lie in bytes."""

    processor: int

    @property
    def _order(self) -> str:
        return ">" if self.processor == _MIPS else "<"

    def whole(self, data: bytes | memoryview | mmap.mmap, signed: bool = True) -> np.ndarray:
        """Numbers of 16 bits."""
        return np.frombuffer(data, f"{self._order}{'i' if signed else 'u'}2")

    def floating(self, data: bytes | memoryview) -> np.ndarray:
        """Numbers of 32 bits; DEC's have their halves exchanged and another bias of the exponent."""
        if self.processor != _DEC:
            return np.frombuffer(data, f"{self._order}f4")
        half_X2 = np.frombuffer(data, "<u2").reshape(-1, 2)
        return np.ascontiguousarray(half_X2[:, ::-1]).view("<f4")[:, 0] / np.float32(4.0)


@dataclass(frozen=True)
class Parameters:
    """The parameters of a file."""

    numbers: Numbers
    told: dict[tuple[str, str], bytes]
    """By their groups and names, in capitals: bytes, of texts after the length of one."""

    @classmethod
    def read(cls, path: Path, data: mmap.mmap) -> Parameters:
        """Those of a file.

        Raises:
            UserError: they are not where its header says, or of an unknown processor.
        """
        at = (data[0] - 1) * BLOCK
        if at < 0 or at + 4 > len(data):
            raise UserError(f"{path}: is a C3D file whose parameters are not where its header says; {CUT}")
        numbers = Numbers(data[at + 3])
        if numbers.processor not in (_INTEL, _DEC, _MIPS):
            raise UserError(
                f"{path}: is a C3D file of no processor that is known ({numbers.processor}); is it damaged?"
            )
        return cls(numbers, _told(data, at, numbers))

    def number(self, group: str, name: str, default: float) -> float:
        """A number that a parameter tells, whole or floating by its length; the default where it tells none."""
        data = self.told.get((group, name), b"")
        if len(data) == 2:
            return float(self.numbers.whole(data, signed=False)[0])
        if len(data) == 4 and math.isfinite(value := float(self.numbers.floating(data)[0])):
            return value
        return default

    def long_range(self) -> int | None:
        """How many frames Vicon's parameters tell, which count further than the header can."""
        start, end = (self.told.get(("TRIAL", f"ACTUAL_{name}_FIELD"), b"") for name in ("START", "END"))
        if len(start) < 4 or len(end) < 4:
            return None
        low, high = (self.numbers.whole(field[:4], signed=False).astype(np.int64) for field in (start, end))
        return int(high[0] + 65_536 * high[1] - low[0] - 65_536 * low[1]) + 1

    def labels(self, group: str, count: int) -> tuple[str, ...]:
        """The names of so many of what a group is of; empty for those that have none."""
        return tuple([*self._labels(group, count), *[""] * count][:count])

    def _labels(self, group: str, count: int) -> Iterator[str]:
        for number in range(1, count + 1):
            key = (group, f"LABELS{number}" if number > 1 else "LABELS")
            if key not in self.told:
                return
            size = self.told[key][0] if self.told[key] else 0
            text = self.told[key][1:]
            yield from (
                text[i : i + size].decode("latin1").strip(" \0") for i in range(0, len(text), size or 1) if size
            )


def _told(data: mmap.mmap, at: int, numbers: Numbers) -> dict[tuple[str, str], bytes]:
    """What parameters tell, by their groups and names, in capitals: bytes, of texts after the length of one."""
    groups: dict[int, str] = {}
    found: list[tuple[int, str, bytes]] = []
    place = at + 4
    for _ in range(_MAX_PARAMETERS):
        if place + 2 > len(data):
            break
        length, group = (int(value) for value in np.frombuffer(data[place : place + 2], np.int8))
        length = abs(length)
        name_end = place + 2 + length
        if not length or not group or name_end + 2 > len(data):
            break
        name = data[place + 2 : name_end].decode("latin1").strip(" \0").upper()
        step = int(numbers.whole(data[name_end : name_end + 2], signed=False)[0])
        if group < 0:
            groups[-group] = name
        else:
            found.append((group, name, _value(data, name_end + 2)))
        if not step:
            break
        place = name_end + step
    return {(groups.get(group, ""), name): value for group, name, value in found}


def _value(data: mmap.mmap, at: int) -> bytes:
    """A parameter's bytes; of texts, after the length of one."""
    if at + 2 > len(data):
        return b""
    kind, dimensions = np.frombuffer(data[at : at + 2], np.int8)
    dimensions = int(dimensions)
    sizes = list(data[at + 2 : at + 2 + max(0, dimensions)])
    begin = at + 2 + len(sizes)
    size = math.prod(sizes) * abs(int(kind))
    value = data[begin : begin + size] if size <= _MAX_VALUE else b""
    if len(value) < size:
        return b""
    return bytes([sizes[0] if sizes else 1]) + value if kind == -1 else value
