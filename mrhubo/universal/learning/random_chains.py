"""Random chains of all kinds: arms, heads, legs and waists, as real robots have them and beyond.

Legend: B chains, N = 8 joints, S = 5 slots, R roles.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import torch
from torch import Tensor

from mrhubo.robot.parts import CHEST, HEAD
from mrhubo.universal.chains import Chains
from mrhubo.universal.learning.drawing import Draw, limits, packed
from mrhubo.universal.learning.random_limbs import random_arms, random_legs
from mrhubo.universal.slots import SLOTS

_X, _Y, _Z = torch.eye(3)
_HEADS = ((_Y, _X, _Z), (_Y, _X, _Z), (_X, _Y, _Z), (_Y, _Z, _X), (_Z, _X, _Y), (_X, _Z, _Y))
_WAISTS = ((_Y, _X, _Z), (_Y, _Z, _X), (_Z, _X, _Y), (_X, _Z, _Y), (_Z, _X, _X), (_X, _Z, _X))
"""Axes of the joints in order; a waist may bend twice about the same one, as hips and knees of a robot on wheels do."""


def random_heads(count: int, generator: torch.Generator) -> Chains:
    """So many heads of one to three joints."""
    return _oriented(count, generator, _HEADS, HEAD.weight)


def random_waists(count: int, generator: torch.Generator) -> Chains:
    """So many waists of one to three joints."""
    return _oriented(count, generator, _WAISTS, CHEST.weight)


def _oriented(count: int, generator: torch.Generator, orders: tuple[tuple[Tensor, ...], ...], weight: float) -> Chains:
    """So many chains of one to three joints, in one of the orders, that turn nothing but an oriented part."""
    draw = Draw(count, generator)
    axis_BR3 = draw.either(*(torch.stack(order) for order in orders))
    axis_BR3 = (draw.tilt(0.4, 0.4)[:, None] @ axis_BR3[..., None])[..., 0]
    there_BR = torch.stack([draw.maybe(share) for share in (0.95, 0.85, 0.35)], dim=1)
    there_BR[:, 0] = torch.where(there_BR.sum(1) == 0, 1.0, there_BR[:, 0])
    lower_BR, upper_BR = limits(draw, [(-1.0, 1.0)] * 3)
    rest_BS3 = torch.stack((_X, _X, _X, _Z, _Y)).expand(count, -1, -1)
    rest_BS3 = (draw.tilt(0.3, 0.3)[:, None] @ rest_BS3[..., None])[..., 0]
    filled_BS = torch.tensor([0.0, 0.0, 0.0, 1.0, 1.0]).expand(count, -1)
    weight_S = torch.full((len(SLOTS),), weight)
    roles_BS = torch.full((count, len(SLOTS)), 3)
    point_BR3 = 0.1 * torch.randn(count, 3, 3, generator=generator)
    return packed(axis_BR3, point_BR3, there_BR, lower_BR, upper_BR, torch.zeros(count, len(SLOTS), 3), rest_BS3,
                   roles_BS * 0, roles_BS, filled_BS, weight_S)  # fmt: skip


KINDS: Mapping[str, Callable[[int, torch.Generator], Chains]] = {
    "arms": random_arms, "heads": random_heads, "legs": random_legs, "waists": random_waists,
}  # fmt: skip
"""What makes chains of each kind."""


def numbers(count: int, shares: Mapping[str, float]) -> dict[str, int]:
    """How many of so many chains are of each kind, whose shares are given; the others are arms."""
    found = {kind: round(count * shares.get(kind, 0.0)) for kind in KINDS if kind != "arms"}
    return {"arms": count - sum(found.values())} | found


def random_chains(number: Mapping[str, int], generator: torch.Generator) -> Chains:
    """So many chains of each kind, one kind after the other."""
    parts = [KINDS[kind](count, generator) for kind, count in number.items() if count]
    return Chains(*(torch.cat([getattr(part, name) for part in parts]) for name in Chains.__dataclass_fields__))
