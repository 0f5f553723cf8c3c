"""Accidents that happen to files, for tests of readers: whatever is left is read, or refused in one sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from hypothesis import strategies as st

import mrhubo
from mrhubo import UserError
from mrhubo.motion.readers.options import ReadOptions

Step = tuple[str, int, bytes]
accidents = st.lists(
    st.tuples(st.sampled_from(("flip", "cut", "splice", "repeat")), st.integers(0, 10**6), st.binary(max_size=12)),
    min_size=1,
    max_size=6,
)
"""Some accidents."""


def damaged(content: bytes, steps: list[Step]) -> bytes:
    """A file after them."""
    for kind, place, piece in steps:
        at = place % max(len(content), 1)
        if not content:
            return piece
        if kind == "flip":
            content = content[:at] + bytes([content[at] ^ (1 << place % 8)]) + content[at + 1 :]
        elif kind == "cut":
            content = content[:at]
        elif kind == "splice":
            content = content[:at] + piece + content[at + len(piece) // 2 :]
        else:
            content = content[:at] + content[at // 2 :]
    return content


def damaged_by(seed: int, content: bytes, other: bytes) -> bytes:
    """A file with some bytes changed, without its end, or with a piece of another good file in it."""
    generator = np.random.default_rng(seed)
    changed, kind = bytearray(content), generator.integers(3)
    if kind == 0:
        for place in generator.integers(len(changed), size=generator.integers(1, 6)):
            changed[place] = generator.integers(256)
    elif kind == 1:
        changed = changed[: generator.integers(len(changed))]
    else:
        start, size = generator.integers(len(other)), generator.integers(1, 200)
        place = generator.integers(len(changed))
        changed[place : place + generator.integers(200)] = other[start : start + size]
    return bytes(changed)


_WORDS = (b"nan", b"inf", b"-1", b"0", b"1e308", b"-9e999", b"99999999999999999999", b"1e-320", b"0x10", b"",
          b"\xff\xfe", b"\0", b"None", b"{", b"}", b"[", b'"', b"id", b"end", b"MOTION", b"1,5",
          b"\xe2\x88\x921")  # fmt: skip
"""What stands in broken text where a number or a name belongs."""


def altered_words(seed: int, content: bytes) -> bytes:
    """Text in which some words are exchanged, or lines are lost, doubled, or swapped."""
    generator = np.random.default_rng(seed)
    for _ in range(generator.integers(1, 5)):
        lines = content.split(b"\n")
        row, other = generator.integers(len(lines), size=2)
        kind = generator.integers(5)
        if kind <= 1:
            words = lines[row].split(b" ")
            words[generator.integers(len(words))] = _WORDS[generator.integers(len(_WORDS))]
            lines[row] = b" ".join(words)
        elif kind == 2:
            del lines[row : row + int(generator.integers(1, 4))]
        elif kind == 3:
            lines[row:row] = lines[other : other + int(generator.integers(1, 20))]
        else:
            lines[row], lines[other] = lines[other], lines[row]
        content = b"\n".join(lines)
    return content


def read_or_refused(path: Path, names: tuple[str, ...] = ()) -> None:
    """Either a motion of finite rotations, or one sentence that names the file, or has one of some other names."""
    try:
        found = mrhubo.read_motion(path, ReadOptions(rate=30.0))
    except UserError as error:
        assert "\n" not in str(error) and any(name in str(error) for name in names or (path.stem,))
        return
    assert bool(found.local_TJ33.isfinite().all())
