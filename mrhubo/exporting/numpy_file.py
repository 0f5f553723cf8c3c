"""The networks as a short Python file that needs NumPy alone, and their weights beside it."""

from __future__ import annotations

import io
import json
import os
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.exporting import standalone
from mrhubo.exporting.meaning import compared, describe_networks, meaning
from mrhubo.files.atomic import atomic_path
from mrhubo.files.npz import open_npz
from mrhubo.retargeter import Retargeter

_KEPT = ("human.", "features.", "pre.", "post.")
"""The arrays of a description that the file needs."""


def write_numpy(retargeter: Retargeter, path: Path) -> float:
    """Writes NAME.py and NAME.npz and returns how far their answers are from PyTorch's at most [rad].

    Args:
        retargeter: whose networks.
        path: NAME.py.

    Raises:
        UserError: the name has another ending, NAME.npz is there and holds something else, the network is the one for
            every robot, the answers are others than PyTorch's, or the disk refuses.
    """
    if path.suffix != ".py" or not path.stem.isidentifier():
        raise UserError(f"{path}: the name must be one of a Python module, such as nao.py")
    description = describe_networks(retargeter)
    if description.universal is not None:
        raise UserError(
            "the network for every robot is an optimiser on the robot's geometry, and too long for a file of its own;"
            " write an ONNX file, or let mrhubo.load_fast answer, which needs no PyTorch"
        )
    _refuse_foreign(path.with_suffix(".npz"))
    arrays = {name: array for name, array in description.arrays().items() if name.startswith(_KEPT)}
    arrays["meaning"] = np.array(json.dumps(meaning(description, "poses")))
    arrays["settings"] = np.array(description.metadata()["settings"])
    exported = standalone.Retargeter(arrays)
    off = compared(lambda local_BJ33: exported(local_BJ33.numpy()), retargeter, description)
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)  # pyright: ignore[reportArgumentType]
    for file, content in (
        (path.with_suffix(".npz"), buffer.getvalue()),
        (path, Path(standalone.__file__).read_bytes()),
    ):
        with atomic_path(file) as temporary:
            temporary.write_bytes(content)
    return off


def _refuse_foreign(weights: Path) -> None:
    """Refuses to replace a file that holds no weights: nobody has named it, and a motion often has such a name."""
    if not os.path.lexists(weights):
        return
    try:
        with open_npz(weights) as file:
            ours = {"meaning", "settings"} <= set(file.keys)
    except UserError:
        ours = False
    if not ours:
        raise UserError(
            f"{weights}: is there already and holds no weights of an export, which would be written there; name another"
            " file"
        )
