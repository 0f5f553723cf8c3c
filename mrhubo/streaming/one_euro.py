"""The One-Euro filter, on the directions that robot and human share.

Casiez, Roussel, Vogel, "1 Euro Filter: A Simple Speed-based Low-pass Filter for Noisy Input in Interactive Systems",
CHI 2012. A first-order low pass whose time constant falls as the speed rises: noise is seen where a limb rests, lag
where it moves. Its parameters are written as times and speeds: 1 / tau = (1 + speed / half_speed) / rest_time is the
paper's f_c = f_min + beta speed, with tau = 1 / (2 pi f_c).

Directions are filtered in place of rotations, as they are all that the cost reads: files that share the same limbs out
among joints in other ways get the same answer.

Legend: B people, D directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import normalize

from mrhubo.fast import StreamSettings
from mrhubo.streaming.people import OfPeople


@dataclass(frozen=True)
class OneEuroState(OfPeople):
    """What a filter remembers."""

    raw_BD3: Tensor
    velocity_BD3: Tensor
    """Low-passed [1/s]."""
    filtered_BD3: Tensor

    @classmethod
    def at(cls, raw_BD3: Tensor) -> OneEuroState:
        """As if these directions had always been there."""
        return cls(raw_BD3, torch.zeros_like(raw_BD3), raw_BD3)


def one_euro(
    state: OneEuroState, raw_BD3: Tensor, passed_B: Tensor, unit_D1: Tensor, settings: StreamSettings
) -> OneEuroState:
    """The filter's next state.

    Args:
        state: the last one.
        raw_BD3: directions that are seen now.
        passed_B: time since the last ones [s], more than 0.
        unit_D1: 1 for directions that have length 1 (D, 1), 0 for those whose length is how much they count, which is
            filtered along.
        settings: the time constants.
    """
    passed_B11 = passed_B[:, None, None]
    velocity_BD3 = (raw_BD3 - state.raw_BD3) / passed_B11
    velocity_BD3 = state.velocity_BD3 + _share(passed_B11, settings.speed_time) * (velocity_BD3 - state.velocity_BD3)
    speed_BD1 = velocity_BD3.norm(dim=-1, keepdim=True)
    share_BD1 = _share(passed_B11, settings.rest_time / (1 + speed_BD1 / settings.half_speed))
    filtered_BD3 = state.filtered_BD3 + share_BD1 * (raw_BD3 - state.filtered_BD3)
    filtered_BD3 = torch.where(unit_D1 > 0, normalize(filtered_BD3, dim=-1), filtered_BD3)
    return OneEuroState(raw_BD3, velocity_BD3, filtered_BD3)


def _share(passed: Tensor, time_constant: Tensor | float) -> Tensor:
    """How much of the way a low pass goes in some time: the paper's alpha."""
    return passed / (passed + time_constant)
