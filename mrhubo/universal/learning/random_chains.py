"""Random arms and heads, as real robots have them and beyond, made in batches from a seed.

Everything is planned as a person stands: a left arm hanging, in human axes (x left, y up, z forward) of the chest, its
upper arm one unit long; right arms are mirrored to left ones before anything is asked of the network. A robot's zero
pose does not matter, as chains are asked for nothing but what is so at their present angles.

Joints are drawn as a list of roles, of which some are left out: clavicle, three of the shoulder, elbow, forearm's
twist, two of the wrist, and the hand's twist. Axes are at right angles, tilted a little, or of any direction; limits
are those of people's robots, wider, or stingy.

Legend: B chains, N = 8 joints, S = 5 slots, R roles.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor
from torch.nn.functional import normalize

from mrhubo.robot.parts import PARTS, BendPart, LimbPart, OrientedPart
from mrhubo.universal.chains import Chains, random_units, rodrigues
from mrhubo.universal.slots import SLOTS

JOINTS = 8
"""Most joints of a random chain."""
_X, _Y, _Z = torch.eye(3)
_FREE = 0.12
"""Share of joints whose axes have any direction."""
_STINGY, _GENEROUS = 0.2, 0.15
"""Shares of joints with a range much narrower, or wider, than is usual."""
_NARROWEST = 0.15
"""Half of the narrowest range [rad]."""

_LIMB_WEIGHT = next(part.weight for part in PARTS if isinstance(part, LimbPart))
_BEND_WEIGHT = next(part.weight for part in PARTS if isinstance(part, BendPart))
_HAND_WEIGHT, _HEAD_WEIGHT = (
    next(part.weight for part in PARTS if isinstance(part, OrientedPart) and part.region == region)
    for region in ("hand", "head")
)


class Draw:
    """Seeded draws for a batch."""

    def __init__(self, count: int, generator: torch.Generator) -> None:
        self.count, self.generator = count, generator

    def maybe(self, share: float) -> Tensor:
        """1 in that share of the rows (B,), else 0."""
        return (torch.rand(self.count, generator=self.generator) < share).float()

    def between(self, low: float, high: float) -> Tensor:
        """Numbers (B,) between two."""
        return low + (high - low) * torch.rand(self.count, generator=self.generator)

    def either(self, *choices: Tensor) -> Tensor:
        """One of several (X,) for each row: (B, X)."""
        which = torch.randint(len(choices), (self.count,), generator=self.generator)
        return torch.stack(choices)[which]

    def tilt(self, share: float, most: float) -> Tensor:
        """Rotations (B, 3, 3) about any axis by up to `most` [rad], in a share of the rows."""
        axis_B3 = random_units(self.count, generator=self.generator)
        return rodrigues(axis_B3, self.maybe(share) * self.between(0.0, most))

    def offset(self, share: float, spread: float) -> Tensor:
        """Vectors (B, 3), in a share of the rows not 0."""
        return self.maybe(share)[:, None] * spread * torch.randn(self.count, 3, generator=self.generator)


def random_arms(count: int, generator: torch.Generator) -> Chains:
    """So many left arms."""
    draw = Draw(count, generator)
    fore_B1 = draw.between(0.6, 1.5)[:, None]
    elbow_B3 = -_Y + draw.offset(0.3, 0.06)
    wrist_B3 = elbow_B3 + fore_B1 * _rotate(draw.tilt(0.3, 0.25), -_Y)
    upper_B3, along_B3 = normalize(elbow_B3, dim=-1), normalize(wrist_B3 - elbow_B3, dim=-1)
    # The shoulder: swings in any order, then a turn about the upper arm.
    orders = [(_X, _Z), (_X, _Z), (_X, _Z), (_Y, _Z), (_Y, _X), (_Z, _X)]
    swing_B23 = draw.either(*(torch.stack(order) for order in orders))
    tilt_B33 = draw.tilt(0.5, 0.9)
    first_B3, second_B3 = (_rotate(tilt_B33, swing_B23[:, i]) for i in (0, 1))
    twist_B3 = _blend(draw.maybe(0.75), upper_B3, _rotate(draw.tilt(0.8, 0.3), -_Y))
    hinge_B3 = _rotate(draw.tilt(0.35, 0.35), -_X)
    wrist_B23 = draw.either(torch.stack((_X, _Z)), torch.stack((_Z, _X)))
    wrist_tilt_B33 = draw.tilt(0.3, 0.8)
    spread = 0.09
    roles = [
        (_rotate(draw.tilt(0.6, 0.6), draw.either(_Z, _Y, _X)), -0.5 * _X + draw.offset(1.0, 0.15), 0.12, (-0.5, 0.5)),
        (first_B3, draw.offset(0.4, spread), 0.98, (-2.6, 1.2)),
        (second_B3, draw.offset(0.4, spread), 0.97, (-0.5, 2.4)),
        (twist_B3, draw.offset(0.3, spread), 0.9, (-1.7, 1.7)),
        (hinge_B3, elbow_B3 + draw.offset(0.5, 0.05), 0.98, (0.0, 2.3)),
        (_blend(draw.maybe(0.8), along_B3, _rotate(draw.tilt(1.0, 0.4), -_Y)),
         elbow_B3 + draw.offset(0.3, 0.06), 0.75, (-1.7, 1.7)),
        (_rotate(wrist_tilt_B33, wrist_B23[:, 0]), wrist_B3 + draw.offset(0.4, 0.08), 0.6, (-0.9, 0.9)),
        (_rotate(wrist_tilt_B33, wrist_B23[:, 1]), wrist_B3 + draw.offset(0.4, 0.08), 0.5, (-0.9, 0.9)),
        (along_B3, wrist_B3 + draw.offset(0.4, 0.08), 0.15, (-1.8, 1.8)),
    ]  # fmt: skip
    axis_BR3 = torch.stack([axis for axis, *_ in roles], dim=1)
    point_BR3 = torch.stack([point for _, point, *_ in roles], dim=1)
    there_BR = torch.stack([draw.maybe(share) for *_, share, _ in roles], dim=1)
    # A swing about the forearm's own line is none: pitch of a hanging arm turns the other way for flexion.
    hand_B = draw.maybe(0.55) * (there_BR[:, 6:].sum(1) > 0)
    there_BR[:, 6:] *= hand_B[:, None]
    there_BR[:, 5] *= torch.maximum(hand_B, draw.maybe(0.15))
    there_BR[:, 8] *= (there_BR[:, :8].sum(1) < JOINTS).float()
    there_BR[:, 0] *= (there_BR[:, 1:].sum(1) < JOINTS).float()
    there_BR[:, 1] = torch.where(there_BR[:, :4].sum(1) == 0, 1.0, there_BR[:, 1])
    lower_BR, upper_BR = _limits(draw, [ends for *_, ends in roles])
    bent_B = there_BR[:, 4] * draw.maybe(0.93)
    fingers_B3 = _blend(draw.maybe(0.7), along_B3, _rotate(draw.tilt(1.0, 0.5), -_Y))
    thumb_B3 = _rotate(draw.tilt(0.4, 0.5), draw.either(_Z, _Z, -_X))
    thumb_B3 = normalize(thumb_B3 - fingers_B3 * (fingers_B3 * thumb_B3).sum(-1, keepdim=True), dim=-1)
    zero_B3 = torch.zeros(count, 3)
    ends = [elbow_B3, hinge_B3, wrist_B3, fingers_B3, thumb_B3]
    starts = [draw.offset(0.3, 0.03), zero_B3, elbow_B3 + draw.offset(0.2, 0.03), zero_B3, zero_B3]
    one_B = torch.ones(count)
    filled_BS = torch.stack((one_B, bent_B, one_B, hand_B, hand_B), dim=1)
    weight_S = torch.tensor([_LIMB_WEIGHT, _BEND_WEIGHT, _LIMB_WEIGHT, _HAND_WEIGHT, _HAND_WEIGHT])
    # After how many roles the ends come: the wrist may hang on the elbow or on the forearm's twist.
    wrist_B = torch.where(draw.maybe(0.5) > 0, 5, 6)
    end_role_BS = torch.stack([torch.full((count,), n) for n in (4, 5, 5, 9, 9)], dim=1)
    end_role_BS[:, 2] = wrist_B
    start_role_BS = torch.stack([torch.full((count,), n) for n in (4, 0, 4, 0, 0)], dim=1)
    start_role_BS[:, 0] = torch.where(draw.maybe(0.3) > 0, 2, 4)
    return _packed(axis_BR3, point_BR3, there_BR, lower_BR, upper_BR, torch.stack(starts, 1), torch.stack(ends, 1),
                   start_role_BS, end_role_BS, filled_BS, weight_S)  # fmt: skip


def random_heads(count: int, generator: torch.Generator) -> Chains:
    """So many heads of one to three joints."""
    draw = Draw(count, generator)
    orders = [(_Y, _X, _Z), (_Y, _X, _Z), (_X, _Y, _Z), (_Y, _Z, _X), (_Z, _X, _Y), (_X, _Z, _Y)]
    axis_BR3 = draw.either(*(torch.stack(order) for order in orders))
    axis_BR3 = (draw.tilt(0.4, 0.4)[:, None] @ axis_BR3[..., None])[..., 0]
    there_BR = torch.stack([draw.maybe(share) for share in (0.95, 0.85, 0.35)], dim=1)
    there_BR[:, 0] = torch.where(there_BR.sum(1) == 0, 1.0, there_BR[:, 0])
    lower_BR, upper_BR = _limits(draw, [(-1.0, 1.0)] * 3)
    rest_BS3 = torch.stack((_X, _X, _X, _Z, _Y)).expand(count, -1, -1)
    rest_BS3 = (draw.tilt(0.3, 0.3)[:, None] @ rest_BS3[..., None])[..., 0]
    filled_BS = torch.tensor([0.0, 0.0, 0.0, 1.0, 1.0]).expand(count, -1)
    weight_S = torch.full((len(SLOTS),), _HEAD_WEIGHT)
    roles_BS = torch.full((count, len(SLOTS)), 3)
    point_BR3 = 0.1 * torch.randn(count, 3, 3, generator=generator)
    return _packed(axis_BR3, point_BR3, there_BR, lower_BR, upper_BR, torch.zeros(count, len(SLOTS), 3), rest_BS3,
                   roles_BS * 0, roles_BS, filled_BS, weight_S)  # fmt: skip


def random_chains(count: int, generator: torch.Generator, heads: float = 0.15) -> Chains:
    """So many chains, of which a share are heads; those come last."""
    some = round(count * heads)
    parts = random_arms(count - some, generator), random_heads(some, generator)
    return Chains(*(torch.cat([getattr(part, name) for part in parts]) for name in Chains.__dataclass_fields__))


def _limits(draw: Draw, usual: list[tuple[float, float]]) -> tuple[Tensor, Tensor]:
    """Lower and upper limits (B, R) [rad] about usual ones, which hold for the planned pose."""
    lowers, uppers = [], []
    for low, high in usual:
        middle_B = (low + high) / 2 + 0.35 * torch.randn(draw.count, generator=draw.generator)
        half_B = (high - low) / 2 * draw.between(0.7, 1.3)
        # Either sense of turn is usual, unless it is an elbow, whose axis says where it bends.
        stingy_B, generous_B = draw.maybe(_STINGY), draw.maybe(_GENEROUS)
        half_B = torch.where(
            generous_B > 0, draw.between(1.8, math.pi), half_B * (1 - stingy_B * draw.between(0.3, 0.8))
        )
        middle_B = middle_B + stingy_B * draw.between(-0.6, 0.6)
        half_B = half_B.clamp(_NARROWEST, math.pi)
        lowers.append(middle_B - half_B)
        uppers.append(middle_B + half_B)
    return torch.stack(lowers, dim=1), torch.stack(uppers, dim=1)


def _packed(
    axis_BR3: Tensor, point_BR3: Tensor, there_BR: Tensor, lower_BR: Tensor, upper_BR: Tensor, start_BS3: Tensor,
    end_BS3: Tensor, start_role_BS: Tensor, end_role_BS: Tensor, filled_BS: Tensor, weight_S: Tensor,
) -> Chains:  # fmt: skip
    """Chains of the roles that are there, which move up; the axes are those that a file may give, of either sign."""
    count, roles = there_BR.shape
    place_BR = torch.argsort(1 - there_BR, dim=1, stable=True)[:, :JOINTS]
    if roles < JOINTS:
        place_BR = torch.nn.functional.pad(place_BR, (0, JOINTS - roles))
    number_BN = torch.arange(JOINTS).expand(count, -1)
    present_BN = (number_BN < there_BR.sum(1, keepdim=True)).float()
    row_B1 = torch.arange(count)[:, None]
    before_BX = torch.cat((torch.zeros(count, 1), there_BR.cumsum(1)), dim=1)  # joints there before each role
    start_body_BS, end_body_BS = (before_BX.gather(1, role_BS).long() for role_BS in (start_role_BS, end_role_BS))
    absent_BN = present_BN == 0
    return Chains(
        axis_BN3=axis_BR3[row_B1, place_BR] * present_BN[..., None],
        point_BN3=point_BR3[row_B1, place_BR] * present_BN[..., None],
        present_BN=present_BN,
        lower_BN=lower_BR[row_B1, place_BR].masked_fill(absent_BN, -1.0),
        upper_BN=upper_BR[row_B1, place_BR].masked_fill(absent_BN, 1.0),
        start_BS3=start_BS3,
        end_BS3=end_BS3,
        start_body_BS=start_body_BS,
        end_body_BS=end_body_BS,
        filled_BS=filled_BS.clone(),
        weight_BS=filled_BS * weight_S,
    )


def _rotate(turn_B33: Tensor, vector_X3: Tensor) -> Tensor:
    return (turn_B33 @ vector_X3[..., None])[..., 0]


def _blend(first_B: Tensor, one_B3: Tensor, other_B3: Tensor) -> Tensor:
    return torch.where(first_B[:, None] > 0, one_B3, other_B3)
