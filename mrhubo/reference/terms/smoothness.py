"""A motion's joints move slowly:  pull * sum_t |q_t - q_(t-1)|^2

The one term that couples frames. Half of a step's cost is counted in each of its two frames.

Legend: T frames, N joints, C blocks.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.reference.terms.term import Quadratic


def add_pull(model: Quadratic, q_TN: Tensor, pull: float, joints_NC: Tensor) -> Quadratic:
    """The model of every frame with the term's cost and gradient, for joint angles (T, N) [rad].

    Its Hessian couples frames, so it is none of a frame's own: `pull_diagonal`, and -pull between a joint and the same
    joint of the next frame.
    """
    moved_TN = torch.nn.functional.pad(q_TN.diff(dim=0), (0, 0, 1, 1))
    pulls_TC = pull / 2 * moved_TN.square() @ joints_NC
    return Quadratic(
        model.cost_BC + pulls_TC[1:] + pulls_TC[:-1],
        model.gradient_BN + pull * (moved_TN[:-1] - moved_TN[1:]),
        model.hessian_BNN,
    )


def pull_diagonal(frames: int, pull: float, like: Tensor) -> Tensor:
    """Half of the diagonal (T, 1) of the term's Hessian: a frame has two neighbours, the first and the last one."""
    neighbours_T1 = like.new_full((frames, 1), 2.0)
    neighbours_T1[0], neighbours_T1[-1] = 1.0, 1.0
    return pull * neighbours_T1
