"""The universal network's weights as a file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mrhubo.config import SHIPPED_UNIVERSAL
from mrhubo.errors import UserError, shortened
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.universal.network import UniversalNetwork

SCHEMA = "mrhubo.universal/1"
_LARGEST = 1024
"""Of the numbers in the header."""


def save_network(network: UniversalNetwork, path: Path, card: Mapping[str, Any]) -> None:
    """Writes the weights, and a model card (a JSON object in the header)."""
    sizes = {name: str(getattr(network, name)) for name in ("width", "heads", "hypotheses")}
    write_tensors(path, network.state_dict(), {"schema": SCHEMA, **sizes, "card": json.dumps(card)})


def open_network(path: Path | None = None) -> UniversalNetwork:
    """The shipped network, or the one of a file, for answers alone.

    Raises:
        UserError: the file is missing, damaged, or no universal network.
    """
    path = path or SHIPPED_UNIVERSAL
    tensors, told = read_tensors(path)
    if told.get("schema") != SCHEMA:
        raise UserError(f"{path}: schema is '{shortened(told.get('schema'))}', expected '{SCHEMA}'")
    try:
        sizes = [int(told[name]) for name in ("width", "heads", "hypotheses")]
        if not all(1 <= size <= _LARGEST for size in sizes) or sizes[0] % sizes[1]:
            raise ValueError(f"sizes {sizes} are no network's")
        network = UniversalNetwork(*sizes)
        network.load_state_dict(tensors)
    except (KeyError, ValueError, RuntimeError) as error:
        said = shortened(" ".join(str(error).split()), 300)
        raise UserError(f"{path}: is no universal network that this version reads: {said}") from error
    if not all(bool(tensor.isfinite().all()) for tensor in network.state_dict().values()):
        raise UserError(f"{path}: its weights hold NaN or infinite numbers")
    return network.requires_grad_(False).eval()
