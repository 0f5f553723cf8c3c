"""The network for every robot with random weights."""

from __future__ import annotations

import torch

from mrhubo.universal.network import UniversalNetwork

SIZES = {"nao": (32, 2, 8), "coman": (10, 5, 3), "reachy": (12, 1, 5)}
"""Width, heads and hypotheses."""


def random_network(name: str) -> UniversalNetwork:
    """Of the sizes above, with weights that correct more than trained ones do."""
    torch.manual_seed(0)
    network = UniversalNetwork(*SIZES[name])
    with torch.no_grad():
        for layer in (network.first, network.later):
            layer.weight *= 5
    return network
