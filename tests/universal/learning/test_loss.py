"""The loss takes the network's answers of three iterations, and nothing else is worked out for it."""

from __future__ import annotations

import pytest
import torch

from mrhubo.universal import iterations
from mrhubo.universal.learning import loss as learning
from mrhubo.universal.learning.random_chains import numbers, random_chains
from mrhubo.universal.learning.targets import HumanTargets, random_targets
from mrhubo.universal.network import UniversalNetwork
from mrhubo.universal.problem import Place, Problem


def _loss_and_gradients() -> list[torch.Tensor]:
    generator = torch.Generator().manual_seed(5)
    number = numbers(40, {"heads": 0.15, "legs": 0.25, "waists": 0.05})
    chains = random_chains(number, generator).canonical()
    problem = Problem.of_chains(chains, random_targets(chains, number, HumanTargets(100, seed=0), generator))
    torch.manual_seed(0)
    network = UniversalNetwork(width=8, heads=2, hypotheses=4)
    found = learning.loss(network, problem, problem.bounds.middle_BN)
    return [found.detach(), *torch.autograd.grad(found, list(network.parameters()))]


def test_what_comes_after_the_last_answer_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    found = _loss_and_gradients()

    def going_on(network: UniversalNetwork, problem: Problem, learning: bool) -> iterations.Trace:
        trace = iterations.unroll(network, problem, learning)
        assert len(trace.learnt) == 4
        del trace.learnt[3:]
        return trace

    monkeypatch.setattr(iterations, "_LEARNT", 3)
    monkeypatch.setattr(learning, "unroll", going_on)
    for part, longer in zip(found, _loss_and_gradients(), strict=True):
        assert torch.equal(part, longer)


def test_nothing_but_answers_is_looked_at_in_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    looks, at = [], Problem.at

    def counted(problem: Problem, q_BN: torch.Tensor) -> Place:
        looks.append(len(q_BN))
        return at(problem, q_BN)

    monkeypatch.setattr(Problem, "at", counted)
    _loss_and_gradients()
    middle, hypotheses, answers, moved, last = looks
    assert (middle, hypotheses, answers, moved, last) == (40, 160, 160, 160, 120)
