"""Capsules of a robot's meshes: found once, which takes a tenth of a second each, and kept in the user's cache."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import xxhash

from mrhubo.files.cache import keep_text, kept_text
from mrhubo.robot import capsules, hugging, hulls
from mrhubo.robot.capsules import Capsule

_LONGEST = 1_000_000
"""Bytes of a file that is one of ours."""
_SMALL, _SMALLER = 0.5, 0.25
"""Meshes smaller than these shares of the largest one get two capsules at most, and one: what those leave out is small
beside what more do of the large ones, and pairs grow with the square of their number."""

Mesh = tuple[np.ndarray, bool]
"""Vertices (V, 3) [m], and whether one capsule is to stand for it."""


def kept_capsules(meshes: Sequence[Mesh]) -> list[list[Capsule]]:
    """`capsules_of` each mesh; of meshes that it was asked for before, together, what it found then."""
    if not meshes:
        return []
    digest = xxhash.xxh3_128(_method())
    for vertices_V3, alone in meshes:
        digest.update(f"{vertices_V3.shape} {alone} ".encode() + np.ascontiguousarray(vertices_V3).tobytes())
    name = f"capsules-{digest.hexdigest()}.json"
    told = kept_text(name, _LONGEST)
    if told is not None and (known := _read(told, len(meshes))) is not None:
        return known
    sizes = [float(np.linalg.norm(np.ptp(vertices_V3, axis=0))) for vertices_V3, _ in meshes]
    found = [
        hulls.capsules_of(vertices_V3, 1 if alone else _most(size / max(*sizes, 1e-9)))
        for (vertices_V3, alone), size in zip(meshes, sizes, strict=True)
    ]
    rows = [[[*start_3.tolist(), *end_3.tolist(), radius] for start_3, end_3, radius in each] for each in found]
    keep_text(name, json.dumps(rows))
    return found


def _most(share: float) -> int:
    """Most capsules of a mesh, by its size as a share of the largest one."""
    return 1 if share < _SMALLER else 2 if share < _SMALL else hulls.MOST_CAPSULES


def _read(told: str, count: int) -> list[list[Capsule]] | None:
    """The capsules of a file; None where it is not one of ours, whole."""
    with contextlib.suppress(ValueError, TypeError, RecursionError):
        found = [np.array(rows, float).reshape(-1, 7) for rows in json.loads(told)]
        if len(found) == count and all(
            len(r_C7) and np.isfinite(r_C7).all() and (r_C7[:, 6] > 0).all() for r_C7 in found
        ):
            return [[(row_7[:3], row_7[3:6], float(row_7[6])) for row_7 in row_C7] for row_C7 in found]
    return None


@cache
def _method() -> bytes:
    """A checksum of how they are found."""
    digest = xxhash.xxh3_128()
    for file in (capsules.__file__, hugging.__file__, hulls.__file__, __file__):
        digest.update(Path(file or "").read_bytes())
    return digest.digest()
