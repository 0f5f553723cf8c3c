"""Values that are not known in some frames."""

from __future__ import annotations

import torch

from mrhubo.motion.gaps import Neighbours, fill_directions, fill_numbers, fill_rotations
from mrhubo.rotation import axis_angle_to_matrix, geodesic_distance


def test_numbers_go_evenly_from_one_known_frame_to_the_next_and_stay_at_the_ends() -> None:
    known = torch.tensor([False, True, False, False, True, False])
    value = torch.tensor([9.0, 1.0, 9.0, 9.0, 4.0, 9.0])[:, None]
    assert fill_numbers(value, known)[:, 0].tolist() == [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]
    assert bool(fill_numbers(value, torch.zeros(6, dtype=torch.bool)).isnan().all())


def test_neighbours_of_known_frames_are_themselves() -> None:
    near = Neighbours.of(torch.tensor([True, False, True]))
    assert near.before_T.tolist() == [0, 0, 2] and near.after_T.tolist() == [0, 2, 2]
    assert near.share_T.tolist() == [0.0, 0.5, 0.0]


def test_rotations_turn_evenly_about_one_axis() -> None:
    axis = torch.tensor([0.0, 0.6, 0.8], dtype=torch.float64)
    turn = axis_angle_to_matrix(torch.linspace(0, 2, 9, dtype=torch.float64)[:, None] * axis)
    known = torch.tensor([True] + [False] * 7 + [True])
    spoiled = torch.where(known[:, None, None], turn, torch.zeros_like(turn))
    assert float(geodesic_distance(fill_rotations(spoiled, known), turn).max()) < 1e-7
    nothing = fill_rotations(spoiled, torch.zeros(9, dtype=torch.bool))
    assert bool((nothing == torch.eye(3)).all())


def test_directions_stay_unit_vectors() -> None:
    way = torch.tensor([[1.0, 0, 0], [0, 0, 0], [0, 1.0, 0]])
    filled = fill_directions(way, torch.tensor([True, False, True]))
    torch.testing.assert_close(filled[1], torch.tensor([1.0, 1.0, 0.0]) / 2**0.5)
