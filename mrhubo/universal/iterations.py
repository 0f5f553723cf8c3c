"""From the middle of all ranges to joint angles in five iterations.

1. The network answers K hypotheses.
2. The cheapest of them are refined by the network and, beside, by a Gauss-Newton step; the cheaper of the two goes on.
3. The cheapest three of these go by damped Gauss-Newton steps, the better of two dampings. A training has the network
   refine them too, so that it learns from there, and ends with what that answers.
4., 5. Likewise the cheapest one.

The answer is the cheapest of all angles that were come by, by the exact cost. Limits are never exceeded, as all steps
are clipped to them.

Legend: B branches, N joints, S slots, K hypotheses or dampings.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import torch
from torch import Tensor

from mrhubo.fast.plain.universal import DAMPINGS, FINAL_DAMPINGS, KEPT, REFINED
from mrhubo.universal.network import UniversalNetwork
from mrhubo.universal.problem import Place, Problem, choose

ITERATIONS = 1 + len(KEPT)
_LEARNT = 2
"""In how many iterations after the first a training has the network answer."""


@dataclass
class Trace:
    """What was come by: the best so far, and what a training looks at."""

    q_BN: Tensor
    cost_B: Tensor
    first_BKN: Tensor
    """The network's hypotheses [rad],"""
    learnt: list[Tensor] = field(default_factory=list)
    """and what its answers cost, (B, K) each iteration; with gradients."""
    best: list[Tensor] = field(default_factory=list)
    """The best cost (B,) after each iteration."""

    def see(self, q_BKN: Tensor, cost_BK: Tensor) -> None:
        """Keeps what is better."""
        best_B = cost_BK.detach().argmin(dim=1)
        row_B = torch.arange(len(best_B), device=best_B.device)
        q_BN, cost_B = q_BKN.detach()[row_B, best_B], cost_BK.detach()[row_B, best_B]
        better_B = cost_B < self.cost_B
        self.q_BN = torch.where(better_B[:, None], q_BN, self.q_BN)
        self.cost_B = torch.where(better_B, cost_B, self.cost_B)
        self.best.append(self.cost_B)


def unroll(network: UniversalNetwork, problem: Problem, learning: bool = False) -> Trace:
    """Five iterations from the middle of all ranges; or what a training learns from, which is the network's answers in
    three, and not the best of the last.
    """
    place = problem.at(problem.bounds.middle_BN)
    count = len(place.q_BN)
    first_BKN = _answer(network, place, place.steps(place.q_BN.new_tensor([DAMPINGS])), first=True)
    trace = Trace(place.q_BN, place.model.cost_B, first_BKN)
    place = _spread(problem, first_BKN)
    cost_BK = place.cost_B.unflatten(0, (count, -1))
    trace.learnt.append(cost_BK)
    trace.see(first_BKN, cost_BK)
    for turn, keep in enumerate(KEPT):
        place = place.rows(_best(cost_BK, keep))
        if learning or turn < REFINED:
            step_XKN = place.steps(place.q_BN.new_tensor([DAMPINGS]))
            answered = place.problem.at(_answer(network, place, step_XKN, first=False)[:, 0])
            trace.learnt.append(answered.cost_B.unflatten(0, (count, -1)))
            if learning and turn + 1 == _LEARNT:
                break  # nothing that could be come by from here on is learnt from
            tried = [answered, place.moved(step_XKN[:, 0])]
        else:
            tried = [place.moved(step_XN) for step_XN in place.steps(place.q_BN.new_tensor([FINAL_DAMPINGS])).unbind(1)]
        place = choose(*tried)
        cost_BK = place.cost_B.detach().unflatten(0, (count, -1))
        trace.see(place.q_BN.unflatten(0, (count, -1)), cost_BK)
    return trace


def _spread(problem: Problem, q_BKN: Tensor) -> Place:
    count, several = q_BKN.shape[:2]
    row_X = torch.arange(count, device=q_BKN.device).repeat_interleave(several)
    return problem.rows(row_X).at(q_BKN.flatten(0, 1))


def _best(cost_BK: Tensor, keep: int) -> Tensor:
    """The places (X,) of the cheapest of each row, in a list of all rows after each other."""
    best_BK = cost_BK.detach().topk(min(keep, cost_BK.shape[1]), dim=1, largest=False).indices
    first_B1 = torch.arange(len(cost_BK), device=cost_BK.device)[:, None] * cost_BK.shape[1]
    return (first_B1 + best_BK).flatten()


def _answer(network: UniversalNetwork, place: Place, step_BKN: Tensor, first: bool) -> Tensor:
    """The network's next angles (B, K, N)."""
    problem, bounds = place.problem, place.problem.bounds
    moved_BKN = network(place.local, place.model, step_BKN, place.q_BN.detach(), bounds, problem.target_BS3, first)
    next_BKN = place.q_BN[:, None] + moved_BKN
    return torch.clamp(next_BKN, bounds.lower_BN[:, None], bounds.upper_BN[:, None])
