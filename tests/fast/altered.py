"""Descriptions of which one array is another, as they would be read from a file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from mrhubo.errors import UserError
from mrhubo.fast import description
from mrhubo.fast.description import Description
from mrhubo.files.arrays import read_arrays


class Altered:
    """A file of a description, of which arrays are exchanged as it is read."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self.arrays, self._metadata = read_arrays(file)

    def refused(self, name: str, array: np.ndarray) -> None:
        """It is no description with another array in the place of one."""
        with pytest.MonkeyPatch.context() as patch:
            found: Mapping[str, np.ndarray] = {**self.arrays, name: array}
            patch.setattr(description, "read_arrays", lambda file: (found, self._metadata))
            with pytest.raises(UserError, match="no description"):
                Description.read(self._file)

    def refused_with(self, name: str, value: float) -> None:
        """Nor with another number at the end of it."""
        changed = self.arrays[name].copy()
        changed.flat[-1] = value
        self.refused(name, changed)
