"""Anchors, and which of the detector's many boxes is taken."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.video.detector import SIDE, anchors, best_of


def told(*boxes: tuple[float, float, float, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What the network tells of boxes (middle, side, logit), from anchors anywhere; their points lie at the middle."""
    anchor_A2 = np.random.default_rng(0).random((len(boxes), 2))
    told_A12 = np.zeros((len(boxes), 12), np.float32)
    for place, (x, y, side, _) in enumerate(boxes):
        told_A12[place] = np.tile((np.array([x, y]) - anchor_A2[place]) * SIDE, 6)
        told_A12[place, 2:4] = side * SIDE
    return told_A12, np.array([box[3] for box in boxes], np.float32), anchor_A2


def test_anchors_are_those_of_the_model() -> None:
    anchor_A2 = anchors()
    assert anchor_A2.shape == (2254, 2) and (anchor_A2 > 0).all() and (anchor_A2 < 1).all()
    assert anchor_A2[:3] == pytest.approx(np.array([[0.5, 0.5], [0.5, 0.5], [1.5, 0.5]]) / 28)
    assert anchor_A2[2 * 28 * 28] == pytest.approx(np.array([0.5, 0.5]) / 14)
    assert anchor_A2[-6:] == pytest.approx(np.full((6, 2), 6.5 / 7)), "six of three layers at one place"
    assert anchor_A2.mean(0) == pytest.approx([0.5, 0.5])


def test_boxes_that_overlap_the_surest_are_averaged_and_others_left_out() -> None:
    point_42 = best_of(*told((0.5, 0.5, 0.2, 2.0), (0.52, 0.5, 0.2, 1.0), (0.8, 0.8, 0.1, 1.5), (0.51, 0.5, 0.2, -3.0)))
    first, second = 1 / (1 + np.exp(-2)), 1 / (1 + np.exp(-1))
    assert point_42 == pytest.approx(np.tile([(0.5 * first + 0.52 * second) / (first + second), 0.5], (4, 1)), abs=1e-5)


def test_nobody_where_none_is_sure() -> None:
    assert best_of(*told((0.5, 0.5, 0.2, -0.1))) is None
    told_A12, logit_A, anchor_A2 = told((0.5, 0.5, 0.2, 3.0), (0.2, 0.2, 0.1, 500.0))
    told_A12[1, 5] = np.nan
    assert best_of(told_A12, logit_A, anchor_A2) == pytest.approx(np.full((4, 2), 0.5), abs=1e-5)
    assert best_of(*told((0.5, 0.5, 0.0, 3.0))) == pytest.approx(np.full((4, 2), 0.5), abs=1e-5), "a box without area"
