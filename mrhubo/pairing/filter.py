"""Which pairs are used: drop extreme ones, draw the rest by a Bernoulli trial on their reconstruction error phi.

MR.HuBo (IROS 2024), section III: phi > mean + k std (k = 1) is extreme and dropped; the probability of the rest falls
linearly with phi. Legend: P pairs.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class PairFilter:
    """Probability (P,) with which each pair takes part in a draw, and the threshold of phi it came from."""

    probability_P: Tensor
    threshold: float

    @property
    def kept_share(self) -> float:
        """Share of the pairs at or below the threshold."""
        return float((self.probability_P > 0).float().mean())

    def draw(self, generator: torch.Generator) -> Tensor:
        """One Bernoulli draw over all pairs: indices of the accepted ones, in random order."""
        accepted = (torch.rand(len(self.probability_P), generator=generator) < self.probability_P).nonzero()[:, 0]
        return accepted[torch.randperm(len(accepted), generator=generator)]


def make_filter(phi_P: Tensor, rule: str, k: float, reverse_P: Tensor | None = None) -> PairFilter:
    """The filter of a dataset.

    Args:
        phi_P: reconstruction errors.
        rule: `linear` (1 at the smallest phi, falling linearly to 0 at the threshold), `hard` (1 up to the
            threshold) or `none` (1 everywhere; the threshold is then only reported).
        k: the threshold is mean + k * standard deviation.
        reverse_P: pairs whose human pose was drawn from the prior and needs no judgement: they take part in every draw,
            and the filter is that of the others, if there are others.
    """
    if reverse_P is not None and bool(reverse_P.any()) and not bool(reverse_P.all()):
        forward = make_filter(phi_P[~reverse_P], rule, k)
        probability_P = torch.ones(len(phi_P))
        probability_P[~reverse_P] = forward.probability_P
        return PairFilter(probability_P, forward.threshold)
    if reverse_P is not None and bool(reverse_P.any()):
        rule = "none"
    phi_P = phi_P.double().cpu()
    threshold = float(phi_P.mean() + k * phi_P.std()) if len(phi_P) > 1 else float(phi_P.max())
    if rule == "none":
        return PairFilter(torch.ones(len(phi_P)), threshold)
    if rule == "hard":
        return PairFilter((phi_P <= threshold).float(), threshold)
    if rule != "linear":
        raise ValueError(f"rule must be linear, hard or none, not {rule!r}")
    lowest = float(phi_P.min())
    if threshold <= lowest:  # all alike, or a k that drops everything but the best
        return PairFilter((phi_P <= max(threshold, lowest)).float(), threshold)
    return PairFilter(((threshold - phi_P) / (threshold - lowest)).clamp(0.0, 1.0).float(), threshold)
