"""Muon's steps are nearly orthogonal, AdamW's are AdamW's, and neither threads nor a pause change them."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
import torch
from torch import nn

from mrhubo.config import load_config
from mrhubo.fitting.muon import Muon, nearly_orthogonal
from mrhubo.retargeter import RetargetNetwork, build_network
from mrhubo.retargeter.networks import ResidualMLP
from mrhubo.robot import build_body_map

WIDE = 24


def network(seed: int = 0) -> ResidualMLP:
    torch.manual_seed(seed)
    return ResidualMLP(6, WIDE, 4, 3)


def hidden_of(net: ResidualMLP) -> list[nn.Parameter]:
    return [block.weight for block in net.blocks if isinstance(block, nn.Linear)]


def learn(net: nn.Module, optimizer: torch.optim.Optimizer, steps: int, seed: int = 0) -> list[float]:
    """Losses of steps towards a bent function."""
    generator, losses = torch.Generator().manual_seed(seed), []
    for _ in range(steps):
        x = torch.randn(128, 6, generator=generator)
        loss = (net(x) - torch.sin(2 * x[:, :3] + x[:, 3:])).abs().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(float(loss.detach()))
    return losses


def muon(net: ResidualMLP, hidden_lr: float = 0.01, pool: ThreadPoolExecutor | None = None) -> Muon:
    return Muon(net.parameters(), hidden_of(net), 0.008, hidden_lr, 1e-6, pool)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e4])
def test_a_matrix_becomes_nearly_orthogonal(scale: float) -> None:
    generator = torch.Generator().manual_seed(0)
    left, _ = torch.linalg.qr(torch.randn(WIDE, WIDE, generator=generator))
    right, _ = torch.linalg.qr(torch.randn(WIDE, WIDE, generator=generator))
    value = torch.logspace(0, -1.5, WIDE)
    found = nearly_orthogonal(scale * left @ torch.diag(value) @ right)
    turned = left.mT @ found @ right.mT
    across = turned - torch.diag(turned.diagonal())
    assert float(across.abs().max()) < 2e-3, "other singular vectors"
    assert 0.15 < float(turned.diagonal().min()) and float(turned.diagonal().max()) < 1.9
    assert bool((nearly_orthogonal(torch.zeros(4, 4)) == 0).all())


def test_hidden_matrices_move_by_their_rate_and_no_further() -> None:
    net = network()
    before = [weight.detach().clone() for weight in hidden_of(net)]
    learn(net, muon(net, 0.01), 1)
    for weight, last in zip(hidden_of(net), before, strict=True):
        values = torch.linalg.svdvals((weight.detach() - last) / 0.01)
        assert 0.5 < float(values.median()) and float(values.max()) < 2.0


def test_all_else_is_adamws() -> None:
    """Without hidden matrices all of it, and of a network with some the rest."""
    one, other = network(), network()
    learn(one, Muon(one.parameters(), [], 0.008, 0.01, 1e-3), 20)
    learn(other, torch.optim.AdamW(other.parameters(), 0.008, weight_decay=1e-3, fused=True), 20)
    for mine, theirs in zip(one.parameters(), other.parameters(), strict=True):
        assert torch.equal(mine, theirs)
    one, other = network(), network()
    learn(one, muon(one), 1)
    learn(other, torch.optim.AdamW(other.parameters(), 0.008, weight_decay=1e-6, fused=True), 1)
    assert torch.equal(one.first.weight, other.first.weight) and torch.equal(one.last.bias, other.last.bias)
    assert not torch.equal(hidden_of(one)[0], hidden_of(other)[0])


def test_threads_change_nothing() -> None:
    one, other = network(), network()
    learn(one, muon(one), 10)
    with ThreadPoolExecutor(2) as pool:
        learn(other, muon(other, pool=pool), 10)
    assert all(torch.equal(mine, theirs) for mine, theirs in zip(one.parameters(), other.parameters(), strict=True))


def test_it_goes_on_from_a_checkpoint() -> None:
    whole, first = network(), network()
    optimizer = muon(whole)
    learn(whole, optimizer, 10)
    learn(whole, optimizer, 10, seed=1)
    optimizer = muon(first)
    learn(first, optimizer, 10)
    later, saved = network(seed=5), optimizer.state_dict()
    later.load_state_dict(first.state_dict())
    optimizer = muon(later)
    optimizer.load_state_dict(saved)
    learn(later, optimizer, 10, seed=1)
    assert all(torch.equal(mine, theirs) for mine, theirs in zip(whole.parameters(), later.parameters(), strict=True))


def test_it_learns_more_in_as_many_steps() -> None:
    """What it is there for: of three networks each, the worst with it is better than the best without."""

    def last(seed: int, with_muon: bool) -> float:
        net = network(seed)
        hidden: list[nn.Parameter] = hidden_of(net) if with_muon else []
        return sum(learn(net, Muon(net.parameters(), hidden, 0.008, 0.01, 1e-6), 300)[-30:])

    assert max(last(seed, True) for seed in range(3)) < min(last(seed, False) for seed in range(3))


def test_who_gets_no_gradient_stays() -> None:
    net = network()
    weight = hidden_of(net)[0]
    before = weight.detach().clone()
    weight.requires_grad_(False)
    learn(net, muon(net), 2)
    assert torch.equal(weight, before)


@pytest.mark.parametrize("residual", ["true", "false"])
@pytest.mark.parametrize("layers", [1, 2, 4])
def test_which_matrices_are_hidden(root: Path, residual: str, layers: int) -> None:
    settings = [f"model.residual={residual}", f"model.layers={layers}", "model.hidden=13"]
    config = load_config(root / "conf" / "nao.yaml", settings)
    net = build_network(config, build_body_map(config.robot))
    assert isinstance(net, RetargetNetwork)
    # Two arms, two networks each.
    assert [tuple(weight.shape) for weight in net.hidden_weights()] == [(13, 13)] * 4 * (layers - 1)
