"""Threshold and probabilities against their definitions."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo.pairing import make_filter

errors = st.lists(st.floats(0, 10), min_size=2, max_size=200).map(torch.tensor)


@settings(max_examples=100, deadline=None)
@given(phi=errors, k=st.floats(-1, 3), rule=st.sampled_from(["linear", "hard", "none"]))
def test_probabilities(phi: torch.Tensor, k: float, rule: str) -> None:
    made = make_filter(phi, rule, k)
    p = made.probability_P
    assert p.shape == phi.shape and bool(((p >= 0) & (p <= 1)).all())
    order = phi.argsort()
    assert bool((p[order].diff() <= 1e-6).all()), "a larger error is never likelier"
    if rule == "none":
        assert bool((p == 1).all()) and made.kept_share == 1
    else:
        assert bool((p[phi.double() > max(made.threshold, float(phi.min()))] == 0).all())


def test_linear_is_linear_between_the_best_and_the_threshold() -> None:
    phi = torch.rand(1000, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    made = make_filter(phi, "linear", 1.0)
    assert made.threshold == pytest.approx(float(phi.mean() + phi.std()))
    kept = phi <= made.threshold
    expected = (made.threshold - phi[kept]) / (made.threshold - phi.min())
    torch.testing.assert_close(made.probability_P[kept], expected.float())


def test_draws_follow_the_probabilities() -> None:
    phi = torch.tensor([0.0, 1.0, 2.0, 3.0, 100.0])
    made = make_filter(phi, "linear", 0.0)
    counts = torch.zeros(5)
    for seed in range(4000):
        drawn = made.draw(torch.Generator().manual_seed(seed))
        assert len(drawn) == len(set(drawn.tolist()))
        counts[drawn] += 1
    torch.testing.assert_close(counts / 4000, made.probability_P, atol=0.04, rtol=0)
    assert counts[4] == 0


def test_equal_errors_all_stay() -> None:
    assert make_filter(torch.full((5,), 0.3), "linear", 1.0).kept_share == 1


def test_unknown_rule() -> None:
    with pytest.raises(ValueError, match="soft"):
        make_filter(torch.rand(3), "soft", 1.0)


def test_reverse_pairs_always_take_part_and_leave_the_filter_of_the_others_alone() -> None:
    phi = torch.rand(400, generator=torch.Generator().manual_seed(0))
    reverse = torch.arange(400) % 3 == 0
    phi[reverse] *= 100
    both, forward = make_filter(phi, "linear", 1.0, reverse), make_filter(phi[~reverse], "linear", 1.0)
    assert bool((both.probability_P[reverse] == 1).all()) and both.threshold == forward.threshold
    torch.testing.assert_close(both.probability_P[~reverse], forward.probability_P)
    assert make_filter(phi, "linear", 1.0, torch.ones(400, dtype=torch.bool)).kept_share == 1
    nothing = make_filter(phi, "linear", 1.0, torch.zeros(400, dtype=torch.bool))
    torch.testing.assert_close(nothing.probability_P, make_filter(phi, "linear", 1.0).probability_P)
