"""What the universal network learns from.

Per problem, with hypotheses q_k after the first iteration, their distances d_k to the best known answer, r = softmax(
-d / 0.1), e(q) = sqrt(cost(q) + 0.001), which is about an angle, and r' = softmax(-e / 0.05) of the second iteration:

    L = 0.3 sum_k r_k (d_k + e(q_k)) + sum_k r'_k e(q'_k) + 0.1 mean_k e(q'_k) + mean_k e(q''_k)

q', q'' are the network's answers in the second and third iteration. What the network sees is taken as given (no second
derivatives); the cost's gradient is exact and runs back through all iterations that went on with the network's answer
(M. Andrychowicz et al., "Learning to learn by gradient descent by gradient descent", 2016).

Legend: B problems, N joints, K hypotheses.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.universal.iterations import unroll
from mrhubo.universal.network import UniversalNetwork
from mrhubo.universal.problem import Problem

BETAS = (0.9, 0.98)
"""Of AdamW, in a training and in a tuning."""


def loss(network: UniversalNetwork, problem: Problem, known_BN: Tensor) -> Tensor:
    """The mean of L over problems, whose best known answers [rad] are given."""
    trace = unroll(network, problem, learning=True)
    away_BKN = (trace.first_BKN - known_BN[:, None]) * problem.bounds.present_BN[:, None]
    distance_BK = (away_BKN.square().sum(-1) + 0.01).sqrt()
    first_BK, second_BK, third_BK = ((cost_BK.clamp_min(0.0) + 1e-3).sqrt() for cost_BK in trace.learnt)
    near_BK = torch.softmax(-distance_BK.detach() / 0.1, dim=1)
    good_BK = torch.softmax(-second_BK.detach() / 0.05, dim=1)
    found_B = 0.3 * (near_BK * (distance_BK + first_BK)).sum(1) + (good_BK * second_BK).sum(1)
    return (found_B + 0.1 * second_BK.mean(1) + third_BK.mean(1)).mean()
