"""The tuning of the universal network: it learns from a robot's pairs, and changes that network alone."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from mrhubo.config import load_config
from mrhubo.fitting.tuning import TuningModule
from mrhubo.retargeter import UniversalJoints, build_network
from mrhubo.robot import build_body_map

pytestmark = pytest.mark.usefixtures("one_thread")


def test_it_learns_from_pairs(root: Path) -> None:
    """Weights that were spoilt come back towards what the pairs say."""
    config = load_config(
        root / "conf" / "reachy.yaml", ["model.start=universal", "trainer.lr=0.002", "trainer.max_steps=15"]
    )
    body_map = build_body_map(config.robot)
    network = build_network(config, body_map)
    assert isinstance(network, UniversalJoints)
    generator = torch.Generator().manual_seed(0)
    q_BN = body_map.robot.sample(16, generator)
    features_BF = body_map.robot_directions(body_map.robot.forward(q_BN)).flatten(1)
    links_BM6 = q_BN.new_zeros(len(q_BN), 0, 6)
    module = TuningModule(network, config.trainer)
    learnt = {name for name, weights in module.named_parameters() if weights.requires_grad}
    assert learnt and all(name.startswith("network.optimiser.network.") for name in learnt)
    whole = float(module.losses(features_BF, links_BM6, q_BN)["loss"].detach())
    with torch.no_grad():
        for name, weights in module.named_parameters():
            if name in learnt:
                weights += 0.05 * torch.randn(weights.shape, generator=generator)
    spoilt = float(module.losses(features_BF, links_BM6, q_BN)["loss"].detach())
    made = module.configure_optimizers()
    for _ in range(15):
        made["optimizer"].zero_grad()
        module.losses(features_BF, links_BM6, q_BN)["loss"].backward()
        made["optimizer"].step()
        made["lr_scheduler"]["scheduler"].step()
    tuned = float(module.losses(features_BF, links_BM6, q_BN)["loss"].detach())
    assert whole < spoilt and tuned < spoilt - 0.5 * (spoilt - whole), (whole, spoilt, tuned)


def test_angles_go_apart_and_together_again(root: Path) -> None:
    config = load_config(root / "conf" / "reachy.yaml", ["model.start=universal"])
    network = build_network(config, body_map := build_body_map(config.robot))
    assert isinstance(network, UniversalJoints)
    branches = network.optimiser.branches
    q_BN = body_map.robot.sample(5, torch.Generator().manual_seed(1))
    assert bool(branches.known_N.all())
    torch.testing.assert_close(branches.joined(branches.apart(q_BN)), q_BN)
