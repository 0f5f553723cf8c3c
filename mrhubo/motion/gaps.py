"""What is not known in some frames, from the frames around in which it is.

Between two frames in which a value is known it goes from one to the other at an even rate; before the first and after
the last it stays.

Legend: T frames, X any further axes.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import normalize

from mrhubo.rotation import axis_angle_to_matrix, matrix_to_axis_angle


@dataclass(frozen=True)
class Neighbours:
    """The nearest frames in which a value is known, before and after each frame; a known frame is its own."""

    before_T: Tensor
    after_T: Tensor
    share_T: Tensor
    """How far between the two, 0 to 1, float64."""

    @classmethod
    def of(cls, known_T: Tensor) -> Neighbours:
        """For frames (T,) of bool, of which at least one is known."""
        frames, place_T = len(known_T), torch.arange(len(known_T))
        before_T = torch.where(known_T, place_T, -1).cummax(dim=0).values
        after_T = torch.where(known_T, place_T, frames).flip(0).cummin(dim=0).values.flip(0)
        before_T, after_T = (
            torch.where(before_T < 0, after_T, before_T),
            torch.where(after_T == frames, before_T, after_T),
        )
        share_T = (place_T - before_T).double() / (after_T - before_T).clamp(min=1)
        return cls(before_T, after_T, share_T.clamp(0.0, 1.0))


def fill_numbers(value_TX: Tensor, known_T: Tensor) -> Tensor:
    """Numbers (T, ...) on the straight line between known ones; NaN throughout where none is known."""
    if bool(known_T.all()):
        return value_TX
    if not bool(known_T.any()):
        return torch.full_like(value_TX, torch.nan)
    near = Neighbours.of(known_T)
    first, second = value_TX[near.before_T], value_TX[near.after_T]
    share_TX = near.share_T.to(value_TX).reshape(-1, *[1] * (value_TX.ndim - 1))
    return torch.where(known_T.reshape(share_TX.shape), value_TX, first + share_TX * (second - first))


def fill_directions(direction_T3: Tensor, known_T: Tensor) -> Tensor:
    """Unit vectors (T, 3); between two that are opposite, the first stays for half of the way."""
    filled_T3 = normalize(fill_numbers(direction_T3, known_T), dim=-1)
    return torch.where(known_T[:, None], direction_T3, filled_T3)


def fill_rotations(rotation_T33: Tensor, known_T: Tensor) -> Tensor:
    """Rotations (T, 3, 3) on the shortest way between known ones; the identity throughout where none is known."""
    if bool(known_T.all()):
        return rotation_T33
    if not bool(known_T.any()):
        return torch.eye(3).to(rotation_T33).expand_as(rotation_T33).clone()
    near = Neighbours.of(known_T)
    first_T33 = rotation_T33[near.before_T]
    turn_T3 = matrix_to_axis_angle(first_T33.mT @ rotation_T33[near.after_T])
    return first_T33 @ axis_angle_to_matrix(near.share_T.to(turn_T3)[:, None] * turn_T3)
