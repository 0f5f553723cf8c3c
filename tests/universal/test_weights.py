"""The weights as a file."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from mrhubo.config import SHIPPED_UNIVERSAL
from mrhubo.errors import UserError
from mrhubo.files.storage import write_tensors
from mrhubo.universal.network import UniversalNetwork
from mrhubo.universal.weights import SCHEMA, open_network, save_network


def test_a_file_gives_the_same_network(tmp_path: Path) -> None:
    network = UniversalNetwork(width=8, heads=2, hypotheses=5)
    save_network(network, tmp_path / "w.safetensors", {"name": "small"})
    again = open_network(tmp_path / "w.safetensors")
    assert again.hypotheses == 5
    assert all(torch.equal(a, b) for a, b in zip(network.parameters(), again.parameters(), strict=True))


def test_the_shipped_ones_are_small() -> None:
    assert SHIPPED_UNIVERSAL.stat().st_size < 5e6
    assert (SHIPPED_UNIVERSAL.parent / "MODEL_CARD.md").is_file()


@pytest.mark.parametrize(
    ("told", "sentence"),
    [
        ({"schema": "another"}, "expected"),
        ({"width": "16"}, "is no universal network"),
        ({"width": "1000000000"}, "are no network's"),
        ({"heads": "x"}, "is no universal network"),
        ({"heads": "3"}, "are no network's"),
    ],
)
def test_strange_files_are_refused(tmp_path: Path, told: dict[str, str], sentence: str) -> None:
    header = {"schema": SCHEMA, "width": "8", "heads": "2", "hypotheses": "4"} | told
    write_tensors(tmp_path / "w.safetensors", UniversalNetwork(8, 2, 4).state_dict(), header)
    with pytest.raises(UserError, match=sentence):
        open_network(tmp_path / "w.safetensors")


def test_nan_is_refused(tmp_path: Path) -> None:
    network = UniversalNetwork(8, 2, 4)
    network.norm.weight.data[0] = torch.nan
    save_network(network, tmp_path / "w.safetensors", {})
    with pytest.raises(UserError, match="NaN"):
        open_network(tmp_path / "w.safetensors")
