"""Reliability and receiver operating characteristics."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.metrics import roc_auc_score

from mrhubo.view.reliability import reliability_curve, reliability_sheet, roc_area

DRAW = np.random.default_rng(0)


@pytest.mark.parametrize("digits", [1, 8])
def test_the_area_is_the_one_that_others_find(digits: int) -> None:
    score_X = DRAW.random(2_000).round(digits)
    bad_X = DRAW.random(2_000) < 1 - score_X
    assert roc_area(score_X, bad_X) == pytest.approx(roc_auc_score(bad_X, -score_X), abs=1e-9)


def test_an_honest_promise_lies_on_the_diagonal() -> None:
    promised_X = DRAW.random(50_000)
    mean, share, count = reliability_curve(promised_X, DRAW.random(50_000) < promised_X)
    assert len(mean) == 10 and count.sum() == 50_000
    np.testing.assert_allclose(share, mean, atol=0.03)
    mean, share, count = reliability_curve(np.array([1.0, 0.0]), np.array([True, False]))
    assert mean.tolist() == share.tolist() == [0.0, 1.0] and count.tolist() == [1, 1]


def test_both_panels_are_drawn() -> None:
    promised_X, true_X = DRAW.random(100), DRAW.random(100) < 0.5
    sheet = reliability_sheet({"a": (promised_X, true_X)}, {"a": (promised_X, ~true_X)})
    pixels = np.asarray(sheet).astype(int)
    for half in (pixels[:, : sheet.width // 2], pixels[:, sheet.width // 2 :]):
        assert (np.abs(half - (59, 118, 175)).sum(-1) < 30).sum() > 100
