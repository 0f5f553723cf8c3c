"""Random arms and legs, as real robots have them and beyond, made in batches from a seed.

Everything is planned as a person stands: a left arm or leg hanging, in human axes (x left, y up, z forward) of the
chest or the pelvis, its upper arm or thigh one unit long; right limbs are mirrored to left ones before anything is
asked of the network. A robot's zero pose does not matter, as chains are asked for nothing but what is so at their
present angles.

Joints are drawn as a list of roles, of which some are left out. Of an arm: clavicle, three of the shoulder, elbow,
forearm's twist, two of the wrist, and the hand's twist; of a leg: three of the hip, knee, two of the ankle. Axes are at
right angles, tilted a little, or of any direction; limits are those of people's robots, wider, or stingy.

Legend: B chains, N = 8 joints, S = 5 slots, R roles.
"""

from __future__ import annotations

import torch
from torch.nn.functional import normalize

from mrhubo.robot.parts import PARTS, BendPart, LimbPart, OrientedPart
from mrhubo.universal.chains import Chains
from mrhubo.universal.learning.drawing import JOINTS, Draw, blend, limits, packed, rotate

_X, _Y, _Z = torch.eye(3)
_LIMB_WEIGHT = next(part.weight for part in PARTS if isinstance(part, LimbPart))
_BEND_WEIGHT = next(part.weight for part in PARTS if isinstance(part, BendPart))
_HAND_WEIGHTS, _FOOT_WEIGHTS = (
    next(part.direction_weights for part in PARTS if isinstance(part, OrientedPart) and part.region == region)
    for region in ("hand", "foot")
)


def random_arms(count: int, generator: torch.Generator) -> Chains:
    """So many left arms."""
    draw = Draw(count, generator)
    fore_B1 = draw.between(0.6, 1.5)[:, None]
    elbow_B3 = -_Y + draw.offset(0.3, 0.06)
    wrist_B3 = elbow_B3 + fore_B1 * rotate(draw.tilt(0.3, 0.25), -_Y)
    upper_B3, along_B3 = normalize(elbow_B3, dim=-1), normalize(wrist_B3 - elbow_B3, dim=-1)
    # The shoulder: swings in any order, then a turn about the upper arm.
    orders = [(_X, _Z), (_X, _Z), (_X, _Z), (_Y, _Z), (_Y, _X), (_Z, _X)]
    swing_B23 = draw.either(*(torch.stack(order) for order in orders))
    tilt_B33 = draw.tilt(0.5, 0.9)
    first_B3, second_B3 = (rotate(tilt_B33, swing_B23[:, i]) for i in (0, 1))
    twist_B3 = blend(draw.maybe(0.75), upper_B3, rotate(draw.tilt(0.8, 0.3), -_Y))
    hinge_B3 = rotate(draw.tilt(0.35, 0.35), -_X)
    wrist_B23 = draw.either(torch.stack((_X, _Z)), torch.stack((_Z, _X)))
    wrist_tilt_B33 = draw.tilt(0.3, 0.8)
    spread = 0.09
    roles = [
        (rotate(draw.tilt(0.6, 0.6), draw.either(_Z, _Y, _X)), -0.5 * _X + draw.offset(1.0, 0.15), 0.12, (-0.5, 0.5)),
        (first_B3, draw.offset(0.4, spread), 0.98, (-2.6, 1.2)),
        (second_B3, draw.offset(0.4, spread), 0.97, (-0.5, 2.4)),
        (twist_B3, draw.offset(0.3, spread), 0.9, (-1.7, 1.7)),
        (hinge_B3, elbow_B3 + draw.offset(0.5, 0.05), 0.98, (0.0, 2.3)),
        (blend(draw.maybe(0.8), along_B3, rotate(draw.tilt(1.0, 0.4), -_Y)),
         elbow_B3 + draw.offset(0.3, 0.06), 0.75, (-1.7, 1.7)),
        (rotate(wrist_tilt_B33, wrist_B23[:, 0]), wrist_B3 + draw.offset(0.4, 0.08), 0.6, (-0.9, 0.9)),
        (rotate(wrist_tilt_B33, wrist_B23[:, 1]), wrist_B3 + draw.offset(0.4, 0.08), 0.5, (-0.9, 0.9)),
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
    lower_BR, upper_BR = limits(draw, [ends for *_, ends in roles])
    bent_B = there_BR[:, 4] * draw.maybe(0.93)
    fingers_B3 = blend(draw.maybe(0.7), along_B3, rotate(draw.tilt(1.0, 0.5), -_Y))
    thumb_B3 = rotate(draw.tilt(0.4, 0.5), draw.either(_Z, _Z, -_X))
    thumb_B3 = normalize(thumb_B3 - fingers_B3 * (fingers_B3 * thumb_B3).sum(-1, keepdim=True), dim=-1)
    zero_B3 = torch.zeros(count, 3)
    ends = [elbow_B3, hinge_B3, wrist_B3, fingers_B3, thumb_B3]
    starts = [draw.offset(0.3, 0.03), zero_B3, elbow_B3 + draw.offset(0.2, 0.03), zero_B3, zero_B3]
    one_B = torch.ones(count)
    filled_BS = torch.stack((one_B, bent_B, one_B, hand_B, hand_B), dim=1)
    weight_S = torch.tensor([_LIMB_WEIGHT, _BEND_WEIGHT, _LIMB_WEIGHT, *_HAND_WEIGHTS])
    # After how many roles the ends come: the wrist may hang on the elbow or on the forearm's twist.
    wrist_B = torch.where(draw.maybe(0.5) > 0, 5, 6)
    end_role_BS = torch.stack([torch.full((count,), n) for n in (4, 5, 5, 9, 9)], dim=1)
    end_role_BS[:, 2] = wrist_B
    start_role_BS = torch.stack([torch.full((count,), n) for n in (4, 0, 4, 0, 0)], dim=1)
    start_role_BS[:, 0] = torch.where(draw.maybe(0.3) > 0, 2, 4)
    return packed(axis_BR3, point_BR3, there_BR, lower_BR, upper_BR, torch.stack(starts, 1), torch.stack(ends, 1),
                   start_role_BS, end_role_BS, filled_BS, weight_S)  # fmt: skip


def random_legs(count: int, generator: torch.Generator) -> Chains:
    """So many left legs."""
    draw = Draw(count, generator)
    shin_B1 = draw.between(0.7, 1.3)[:, None]
    knee_B3 = -_Y + draw.offset(0.3, 0.06)
    ankle_B3 = knee_B3 + shin_B1 * rotate(draw.tilt(0.3, 0.2), -_Y)
    # The hip: three axes in any order; which of them comes first decides what the others are.
    orders = [(1, 2, 0), (2, 1, 0), (0, 2, 1), (1, 0, 2), (2, 0, 1), (0, 1, 2)]
    order_B3 = draw.either(*(torch.tensor(order) for order in orders))
    hip_B33 = torch.eye(3)[order_B3] @ draw.tilt(0.3, 0.8).mT
    # Thighs are lifted to the front and swung to the left, which is a turn about -x and about z.
    lows_B3, highs_B3 = (torch.tensor(ends)[order_B3] for ends in ((-2.0, -0.8, -0.45), (0.6, 0.8, 0.8)))
    hips = [
        (rotate(draw.tilt(0.15, 0.3), hip_B33[:, i]), draw.offset(0.5, 0.12), share, (lows_B3[:, i], highs_B3[:, i]))
        for i, share in enumerate((0.97, 0.97, 0.93))
    ]
    hinge_B3 = rotate(draw.tilt(0.3, 0.3), _X)
    ankle_B23 = draw.either(torch.stack((_X, _Z)), torch.stack((_X, _Z)), torch.stack((_Z, _X)))
    ankle_tilt_B33 = draw.tilt(0.3, 0.4)
    pitches_B = (ankle_B23[:, 0, 0] > 0).float()
    wide_B, narrow_B = 0.4 + 0.4 * pitches_B, 0.8 - 0.4 * pitches_B
    roles = [
        *hips,
        (hinge_B3, knee_B3 + draw.offset(0.5, 0.05), 0.98, (0.0, 2.2)),
        (rotate(ankle_tilt_B33, ankle_B23[:, 0]), ankle_B3 + draw.offset(0.4, 0.05), 0.93, (-wide_B, wide_B)),
        (rotate(ankle_tilt_B33, ankle_B23[:, 1]), ankle_B3 + draw.offset(0.4, 0.05), 0.8, (-narrow_B, narrow_B)),
    ]
    axis_BR3 = torch.stack([axis for axis, *_ in roles], dim=1)
    point_BR3 = torch.stack([point for _, point, *_ in roles], dim=1)
    there_BR = torch.stack([draw.maybe(share) for *_, share, _ in roles], dim=1)
    there_BR[:, 0] = torch.where(there_BR[:, :3].sum(1) == 0, 1.0, there_BR[:, 0])
    lower_BR, upper_BR = limits(draw, [ends for *_, ends in roles])
    bent_B, foot_B = there_BR[:, 3] * draw.maybe(0.97), draw.maybe(0.93) * (there_BR[:, 4:].sum(1) > 0)
    there_BR[:, 4:] *= foot_B[:, None]
    turned_B33 = draw.tilt(0.3, 0.3)
    ends = [knee_B3, hinge_B3, ankle_B3, rotate(turned_B33, _Z), rotate(turned_B33, _Y)]
    zero_B3 = torch.zeros(count, 3)
    starts = [draw.offset(0.4, 0.06), zero_B3, knee_B3 + draw.offset(0.2, 0.03), zero_B3, zero_B3]
    one_B = torch.ones(count)
    filled_BS = torch.stack((one_B, bent_B, one_B, foot_B, foot_B), dim=1)
    weight_S = torch.tensor([_LIMB_WEIGHT, _BEND_WEIGHT, _LIMB_WEIGHT, *_FOOT_WEIGHTS])
    end_role_BS = torch.tensor([3, 4, 4, 6, 6]).expand(count, -1)
    start_role_BS = torch.tensor([3, 0, 3, 0, 0]).repeat(count, 1)
    start_role_BS[:, 0] -= draw.maybe(0.3).long()
    return packed(axis_BR3, point_BR3, there_BR, lower_BR, upper_BR, torch.stack(starts, 1), torch.stack(ends, 1),
                  start_role_BS, end_role_BS, filled_BS, weight_S)  # fmt: skip
