"""What the nodes of a tree (`mrhubo.files.tree`) share: the file, what was read of it, and how much may be made."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.array_pickle import load_pickle
from mrhubo.files.npz import open_npz
from mrhubo.files.safe_pickle import MAX_BYTES

_MAX_MADE = 2**26
"""Numbers that lists of arrays are put together to, in one file."""


@dataclass(frozen=True)
class Member:
    """An array of an .npz file that is read when it is asked for."""

    key: str


@dataclass
class Source:
    """What the nodes of a tree share. What it made arrays of lives as long as it does, so that each is made once."""

    path: Path
    storages: dict[str, bytes] = field(default_factory=dict)
    members: dict[str, Any] = field(default_factory=dict)
    made: dict[int, np.ndarray] = field(default_factory=dict)
    left: int = _MAX_MADE

    def member(self, key: str) -> Any:
        """What a member of the .npz file holds.

        Raises:
            UserError: it is damaged, hostile, or too large.
        """
        if key not in self.members:
            with open_npz(self.path) as file:
                self.members[key] = file.read_any(key, load_pickle, MAX_BYTES)
        return self.members[key]

    def count(self, numbers: int) -> None:
        """Some more numbers that lists are put together to."""
        self.left -= numbers
        if self.left < 0:
            raise UserError(
                f"{self.path}: its lists make arrays of more than {_MAX_MADE:,} numbers, as those of no motion do"
            )
