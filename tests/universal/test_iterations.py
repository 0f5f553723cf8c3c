"""Five iterations: limits hold whatever the weights are, costs never rise, and the shipped weights are worth it."""

from __future__ import annotations

import torch
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mrhubo.universal.iterations import ITERATIONS, unroll
from mrhubo.universal.learning.random_chains import numbers, random_chains
from mrhubo.universal.learning.targets import HumanTargets, random_targets
from mrhubo.universal.network import UniversalNetwork
from mrhubo.universal.newton import minimise
from mrhubo.universal.problem import Problem
from mrhubo.universal.weights import open_network

HUMANS = HumanTargets(500, seed=0)


def draw(seed: int, count: int) -> Problem:
    generator = torch.Generator().manual_seed(seed)
    number = numbers(count, {"heads": 0.15, "legs": 0.25, "waists": 0.05})
    chains = random_chains(number, generator).canonical()
    return Problem.of_chains(chains, random_targets(chains, number, HUMANS, generator))


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31), size=st.floats(0.1, 30.0))
@example(seed=8388609, size=30.0)  # an angle and the way to its limit, rounded, sum up to more than the limit
def test_limits_hold_and_costs_never_rise(seed: int, size: float) -> None:
    torch.manual_seed(seed)
    network = UniversalNetwork(width=8, heads=2, hypotheses=4)
    for weights in network.parameters():
        weights.data.mul_(size)
    problem = draw(seed, 20)
    with torch.no_grad():
        trace = unroll(network, problem)
    bounds = problem.bounds
    assert bool(((trace.q_BN >= bounds.lower_BN) & (trace.q_BN <= bounds.upper_BN)).all())
    assert len(trace.best) == ITERATIONS
    costs = torch.stack([problem.at(bounds.middle_BN).model.cost_B, *trace.best])
    assert bool((costs.diff(dim=0) <= 0).all())
    torch.testing.assert_close(problem.at(trace.q_BN).model.cost_B, trace.cost_B)


def test_the_order_of_joints_does_not_matter_to_the_network() -> None:
    problem, network = draw(3, 30), open_network()
    place = problem.at(problem.bounds.middle_BN)
    step_BKN = place.steps(torch.tensor([[3e-3, 3e-2, 0.5]]))
    order = torch.randperm(8, generator=torch.Generator().manual_seed(4))

    def moved(x: torch.Tensor) -> torch.Tensor:
        return x[..., order] if x.shape[-1] == 8 else x

    def answer(change: bool) -> torch.Tensor:
        pick = moved if change else (lambda x: x)
        model = type(place.model)(*(pick(getattr(place.model, n)) for n in place.model.__dataclass_fields__))
        hessian_BNN = place.model.hessian_BNN
        model = type(model)(model.cost_B, model.gradient_BN,
                            hessian_BNN[:, order][..., order] if change else hessian_BNN,
                            model.miss_BS3, model.weight_BS, model.rows_BRN)  # fmt: skip
        axis_BN3 = place.local.axis_BN3[:, order] if change else place.local.axis_BN3
        local = type(place.local)(place.local.direction_BS3, pick(place.local.jacobian_BS3N), axis_BN3)
        bounds = type(problem.bounds)(*(pick(getattr(problem.bounds, n)) for n in problem.bounds.__dataclass_fields__))
        return network(local, model, pick(step_BKN), pick(place.q_BN), bounds, problem.target_BS3, True)

    torch.testing.assert_close(answer(True), moved(answer(False)), atol=1e-5, rtol=0)


@torch.no_grad()
def test_the_shipped_weights_beat_as_many_steps_from_the_middle() -> None:
    problem, network = draw(12345, 600), open_network()
    learnt_B = unroll(network, problem).cost_B
    _, middle_B = minimise(problem, problem.bounds.middle_BN, ITERATIONS)
    _, longer_B = minimise(problem, problem.bounds.middle_BN, 4 * ITERATIONS)
    assert float(learnt_B.mean()) < float(longer_B.mean()) - 0.01 < float(middle_B.mean())
    elsewhere = (learnt_B > torch.minimum(longer_B, learnt_B) + 0.01).float().mean()
    assert float(elsewhere) < 0.05
