"""Values that are not known in some frames."""

from __future__ import annotations

import numpy as np
import torch

from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.motion.gaps import Neighbours, fill_directions, fill_numbers, fill_rotations
from mrhubo.rotation import geodesic_distance


def test_numbers_go_evenly_from_one_known_frame_to_the_next_and_stay_at_the_ends() -> None:
    known = np.array([False, True, False, False, True, False])
    value = np.array([9.0, 1.0, 9.0, 9.0, 4.0, 9.0])[:, None]
    assert fill_numbers(value, known)[:, 0].tolist() == [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]
    assert np.isnan(fill_numbers(value, np.zeros(6, bool))).all()


def test_neighbours_of_known_frames_are_themselves() -> None:
    near = Neighbours.of(np.array([True, False, True]))
    assert near.before_T.tolist() == [0, 0, 2] and near.after_T.tolist() == [0, 2, 2]
    assert near.share_T.tolist() == [0.0, 0.5, 0.0]


def test_rotations_turn_evenly_about_one_axis() -> None:
    turn = axis_angle_to_matrix(np.linspace(0, 2, 9)[:, None] * np.array([0.0, 0.6, 0.8]))
    known = np.array([True] + [False] * 7 + [True])
    spoiled = np.where(known[:, None, None], turn, 0.0)
    filled, wanted = torch.from_numpy(fill_rotations(spoiled, known)), torch.from_numpy(turn)
    assert float(geodesic_distance(filled, wanted).max()) < 1e-7
    assert (fill_rotations(spoiled, np.zeros(9, bool)) == np.eye(3)).all()


def test_directions_stay_unit_vectors() -> None:
    way = np.array([[1.0, 0, 0], [0, 0, 0], [0, 1.0, 0]])
    filled = fill_directions(way, np.array([True, False, True]))
    np.testing.assert_allclose(filled[1], np.array([1.0, 1.0, 0.0]) / 2**0.5)
