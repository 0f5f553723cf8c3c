"""Anchors, and which of the detector's many boxes is taken."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.video.detector import SIDE, anchors, bodies, parts_of


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


def test_boxes_that_overlap_a_surer_one_are_averaged_and_others_are_other_bodies() -> None:
    boxes = (0.5, 0.5, 0.2, 1.5), (0.8, 0.8, 0.1, 1.2), (0.52, 0.5, 0.2, 1.0), (0.51, 0.5, 0.2, -3.0)
    found = bodies(*told(*boxes))
    first, second = 1 / (1 + np.exp(-1.5)), 1 / (1 + np.exp(-1))
    middle = (0.5 * first + 0.52 * second) / (first + second)
    assert len(found) == 2 and found[0] == pytest.approx(np.tile([middle, 0.5], (4, 1)), abs=1e-5)
    assert found[1] == pytest.approx(np.full((4, 2), 0.8), abs=1e-5)


def test_nobody_where_none_is_sure() -> None:
    assert bodies(*told((0.5, 0.5, 0.2, -0.1))) == []
    told_A12, logit_A, anchor_A2 = told((0.5, 0.5, 0.2, 3.0), (0.2, 0.2, 0.1, 500.0))
    told_A12[1, 5] = np.nan
    (found_42,) = bodies(told_A12, logit_A, anchor_A2)
    assert found_42 == pytest.approx(np.full((4, 2), 0.5), abs=1e-5)
    (found_42,) = bodies(*told((0.5, 0.5, 0.0, 3.0)))
    assert found_42 == pytest.approx(np.full((4, 2), 0.5), abs=1e-5), "a box without area"


def test_parts_cover_a_picture_and_half_of_each_other() -> None:
    parts = parts_of(200, 100, 50)
    assert len(parts) == 7 * 3 and {part.size for part in parts} == {50} and (parts[0].x, parts[0].y) == (25, 25)
    assert max(part.x for part in parts) == 175 and max(part.y for part in parts) == 75
    assert len(parts_of(100, 100, 100)) == 1 and len(parts_of(130, 100, 100)) == 2
