"""Muon: hidden layers step along the orthogonal matrix that is nearest to the running mean of their gradient.

So a step changes a layer as much in the directions that gradients seldom have as in those that they nearly always have.
K. Jordan et al., "Muon: an optimizer for hidden layers in neural networks" (2024),
https://kellerjordan.github.io/posts/muon/. Nearly orthogonal matrices are found by the first polynomials of N. Amsel et
al., "The Polar Express: Optimal Matrix Sign Methods and Their Application to the Muon Algorithm" (2025),
arXiv:2505.16932; more of them bring nothing here (docs/experiments/training.md).

First and last layers and all biases are AdamW's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, overload

import torch
from torch import Tensor, nn

POLYNOMIALS = (
    (8.28721201814563, -23.595886519098837, 17.300387312530933),
    (4.107059111542203, -2.9478499167379106, 0.5448431082926601),
    (3.9486908534822946, -2.908902115962949, 0.5518191394370137),
)
"""Factors of X, X X' X and X X' X X' X, one turn each."""
MOMENTUM = 0.95
_TINY = 1e-7


def nearly_orthogonal(matrix_HH: Tensor) -> Tensor:
    """A matrix (H, H) with the same singular vectors, whose singular values are between 0.2 and 1.9 where they were
    more than a hundredth of its norm.
    """
    found_HH = matrix_HH / (torch.linalg.matrix_norm(matrix_HH) + _TINY)
    for linear, cubic, quintic in POLYNOMIALS:
        square_HH = found_HH @ found_HH.mT
        bent_HH = torch.addmm(square_HH, square_HH, square_HH, beta=cubic, alpha=quintic)
        found_HH = torch.addmm(found_HH, bent_HH, found_HH, beta=linear)
    return found_HH


class Muon(torch.optim.AdamW):
    """Muon for some matrices, AdamW for all other weights."""

    def __init__(
        self,
        weights: Iterable[nn.Parameter],
        hidden: Sequence[nn.Parameter],
        lr: float,
        hidden_lr: float,
        weight_decay: float,
        pool: ThreadPoolExecutor | None = None,
    ) -> None:
        """An optimiser that has not made a step.

        Args:
            weights: all that learn.
            hidden: square matrices among them, Muon's; the others are AdamW's.
            lr: learning rate of the others.
            hidden_lr: how far the hidden matrices move in a step, as a share of an orthogonal matrix.
            weight_decay: AdamW's.
            pool: threads that find the hidden steps side by side, which does not change them; None: this one does.
        """
        chosen = {id(weight) for weight in hidden}
        others = [weight for weight in weights if id(weight) not in chosen]
        super().__init__([{"params": others}], lr, weight_decay=weight_decay, fused=True)
        self.add_param_group({"params": [*hidden], "lr": hidden_lr, "weight_decay": 0.0})
        self._pool = pool

    @overload
    def step(self, closure: None = None) -> None: ...
    @overload
    def step(self, closure: Callable[[], float]) -> float: ...
    def step(self, closure: Callable[[], Any] | None = None) -> Any:
        """One step of all weights that have a gradient; what the closure gives."""
        loss = None
        if closure is not None:
            with torch.enable_grad():
                loss = closure()
        groups = self.param_groups
        self.param_groups = groups[:1]
        try:
            super().step()
        finally:
            self.param_groups = groups
        hidden = groups[1]
        weights = [weight for weight in hidden["params"] if weight.grad is not None]
        for weight in weights:
            if not self.state[weight]:  # AdamW, when it is loaded, looks for the number of steps
                self.state[weight] = {"step": torch.tensor(0.0), "mean": torch.zeros_like(weight)}
            self.state[weight]["step"] += 1
        spread = map if self._pool is None else self._pool.map
        list(spread(lambda weight: self._move(weight, hidden["lr"]), weights))
        return loss

    @torch.no_grad()
    def _move(self, weight: nn.Parameter, rate: float) -> None:
        assert weight.grad is not None
        mean = self.state[weight]["mean"].mul_(MOMENTUM).add_(weight.grad)
        weight.sub_(nearly_orthogonal(torch.add(weight.grad, mean, alpha=MOMENTUM)), alpha=rate)
