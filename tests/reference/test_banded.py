"""Banded systems by LAPACK: as NumPy's cyclic reduction solves them, also where rounding has taken their last bit of
definiteness."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.fast.together.banded import Banded, halve
from mrhubo.reference.banded import factor

FRAMES, JOINTS = 30, 3


def tied(own: float) -> Banded:
    """Frames that jerk ties to each other, and that cost `own` by themselves."""
    third = np.diff(np.eye(FRAMES), n=3, axis=0)
    jerk_TT = third.T @ third
    couplings = [np.stack([jerk_TT[t + lag, t] * np.eye(JOINTS) for t in range(FRAMES - lag)]) for lag in range(1, 4)]
    diagonal_TM = own + np.repeat(np.diag(jerk_TT)[:, None], JOINTS, axis=1)
    return Banded(np.zeros((FRAMES, JOINTS, JOINTS)), diagonal_TM, couplings)


def test_two_ways_agree() -> None:
    right_TM = np.random.default_rng(0).normal(size=(FRAMES, JOINTS))
    np.testing.assert_allclose(factor(tied(0.5))(right_TM), halve(tied(0.5))(right_TM), atol=1e-10)


@pytest.mark.parametrize("own", [0.0, -1e-9])
def test_a_system_that_is_no_more_definite_is_solved(own: float) -> None:
    """Moves that no frame minds may be anything; what they are is finite, and solves all the rest."""
    system, wanted_TM = tied(own), np.random.default_rng(1).normal(size=(FRAMES, JOINTS))
    right_TM = system.times(wanted_TM)
    found_TM = factor(system)(right_TM)
    assert np.isfinite(found_TM).all()
    np.testing.assert_allclose(np.diff(found_TM, n=3, axis=0), np.diff(wanted_TM, n=3, axis=0), atol=0.1)


def test_a_system_that_never_was_is_refused() -> None:
    with pytest.raises(np.linalg.LinAlgError):
        factor(tied(-50.0))
