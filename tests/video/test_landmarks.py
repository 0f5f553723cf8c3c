"""Points are moved to where the heat map has them, where it is sure."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.video.landmarks import refined


def test_a_heat_map_that_is_sure_moves_a_point() -> None:
    heat_YXP = np.full((64, 64, 4), -50.0, np.float32)
    heat_YXP[20, 31, 0], heat_YXP[20, 33, 0] = 8.0, 8.0
    heat_YXP[20, 40, 1] = 8.0  # beyond the reach
    heat_YXP[20, 33, 2] = -0.1  # not sure
    heat_YXP[0, 0, 3] = 8.0
    share_P2 = np.array([[30.2, 20.9], [30.2, 20.9], [30.2, 20.9], [-1.5, -2.0]]) / 64
    moved_P2 = refined(share_P2, heat_YXP) * 64
    assert moved_P2[0] == pytest.approx([32.0, 20.0], abs=1e-3)
    assert moved_P2[1:3] == pytest.approx(share_P2[1:3] * 64)
    assert moved_P2[3] == pytest.approx([0.0, 0.0], abs=1e-3)


def test_nonsense_stays_nonsense() -> None:
    share_P2 = np.array([[np.nan, 0.5], [1e30, -1e30]])
    assert np.array_equal(refined(share_P2, np.zeros((64, 64, 2), np.float32)), share_P2, equal_nan=True)
