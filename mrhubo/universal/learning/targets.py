"""What chains are asked for: directions that they reach, nearly reach, or that people have. No recorded motion.

Legend: B targets, H human poses, S = 5 slots.
"""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor
from torch.nn.functional import normalize

from mrhubo.body.prior import BodyPrior
from mrhubo.body.skeleton import Skeleton, joint_index, keypoint_indices
from mrhubo.body.turns import JointTurns
from mrhubo.robot.bending import bend_axis
from mrhubo.robot.parts import PARTS, BendPart, BodyPart, LimbPart, OrientedPart
from mrhubo.universal.chains import Chains, random_units, rodrigues
from mrhubo.universal.slots import AXIAL_S, MIRROR_3, SLOTS, on_the_right, slot_of

_REGIONS = {"arms": "hand", "heads": "head", "legs": "foot", "waists": "trunk"}
"""The region of the oriented part at the end of each kind of branch."""


class HumanTargets:
    """Poses of the body prior as the directions of branches, all as left ones."""

    def __init__(self, poses: int, seed: int, spread: float = 1.2) -> None:
        """So many poses; latents are drawn with `spread` times the prior's own."""
        prior, skeleton = BodyPrior.open(), Skeleton()
        generator = torch.Generator().manual_seed(seed)
        latent_HZ = spread * torch.randn(poses, prior.latent, generator=generator)
        local_HJ33 = torch.cat([prior.decode_matrices(z) for z in latent_HZ.split(4096)])
        oriented = [part for part in PARTS if isinstance(part, OrientedPart) and part.seen_from]
        self._table_HS3 = {
            kind: torch.cat([_branch(skeleton, local_HJ33, part) for part in oriented if part.region == region])
            for kind, region in _REGIONS.items()
        }

    def draw(self, number: Mapping[str, int], generator: torch.Generator) -> Tensor:
        """Targets (B, S, 3) of somebody, for so many chains of each kind, one kind after the other."""
        found = []
        for kind, count in number.items():
            table_HS3 = self._table_HS3[kind]
            found.append(table_HS3[torch.randint(len(table_HS3), (count,), generator=generator)])
        return torch.cat(found)


def _branch(skeleton: Skeleton, local_HJ33: Tensor, outer: OrientedPart) -> Tensor:
    """Directions (H, S, 3) of an oriented part, of the limbs that carry it, and of what these bend about."""
    by_name = {part.name: part for part in PARTS}
    carried: list[LimbPart] = []
    part = by_name[outer.hangs_on or ""]
    while isinstance(part, LimbPart):
        carried.insert(0, part)
        part = by_name[part.hangs_on or ""]
    names = {part.name for part in carried}
    bends = [part for part in PARTS if isinstance(part, BendPart) and part.bent in names]
    found_HS3 = _of(skeleton, local_HJ33, [*carried, *bends, outer])
    if not carried or not on_the_right(skeleton, carried[0]):
        return found_HS3
    return found_HS3 * torch.tensor(MIRROR_3) * torch.tensor(AXIAL_S)[:, None]


def _of(skeleton: Skeleton, local_HJ33: Tensor, parts: list[BodyPart]) -> Tensor:
    """Directions (H, S, 3) of the parts of one branch, as what carries them sees them; 0 in slots that it has not."""
    view = next(part for part in PARTS if part.name == parts[0].seen_from)
    turns_HX33 = JointTurns([joint_index(part.joint) for part in (view, *parts)])(local_HJ33)
    view_H33, found_HS3 = turns_HX33[:, 0], torch.zeros(len(local_HJ33), len(SLOTS), 3)
    names = {part.name for part in parts}
    for number, part in enumerate(parts, start=1):
        if isinstance(part, LimbPart):
            start, end = keypoint_indices([part.start, part.end])
            rests = [normalize(skeleton.rest_K3[end] - skeleton.rest_K3[start], dim=0)]
        elif isinstance(part, OrientedPart):
            rests = [torch.tensor(rest) for rest in part.rest]
        else:
            assert isinstance(part, BendPart)
            rests = [torch.tensor(part.rest)]
        for word, rest_3 in enumerate(rests):
            slot = slot_of(part, word, part.hangs_on in names)
            found_HS3[:, slot] = (view_H33.mT @ turns_HX33[:, number] @ rest_3.to(turns_HX33)[..., None])[..., 0]
    if any(isinstance(part, BendPart) for part in parts):
        axis_H3, needed_H = bend_axis(found_HS3[:, 0], found_HS3[:, 2], found_HS3[:, 1])
        found_HS3[:, 1] = axis_H3 * needed_H[:, None]
    return found_HS3


def reached_targets(chains: Chains, q_BN: Tensor, generator: torch.Generator, noisy: float = 0.5) -> Tensor:
    """Targets (B, S, 3): the directions at joint angles (B, N), in a share of the chains turned by some degrees."""
    target_BS3 = chains.local(q_BN).direction_BS3
    noisy_B11 = (torch.rand(len(chains), 1, 1, generator=generator) < noisy).float()
    axis_BS3 = random_units(len(chains), 5, generator=generator)
    angle_BS = 0.2 * torch.randn(len(chains), 5, generator=generator) * noisy_B11[..., 0]
    target_BS3 = (rodrigues(axis_BS3, angle_BS) @ target_BS3[..., None])[..., 0]
    # An oriented part's two directions stay at right angles.
    first_B3, second_B3 = target_BS3[:, 3], target_BS3[:, 4]
    target_BS3[:, 4] = normalize(second_B3 - first_B3 * (first_B3 * second_B3).sum(-1, keepdim=True), dim=-1)
    axis_B3, needed_B = bend_axis(target_BS3[:, 0], target_BS3[:, 2], target_BS3[:, 1])
    target_BS3[:, 1] = axis_B3 * needed_B[:, None]
    return target_BS3


def random_targets(
    chains: Chains, number: Mapping[str, int], humans: HumanTargets, generator: torch.Generator, human: float = 0.4
) -> Tensor:
    """Targets (B, S, 3): in a share of the chains a person's, else what the chain reaches or nearly reaches."""
    unit_BN = torch.rand(chains.lower_BN.shape, generator=generator)
    q_BN = chains.lower_BN + unit_BN * (chains.upper_BN - chains.lower_BN)
    reached_BS3 = reached_targets(chains, q_BN, generator)
    asked_B11 = torch.rand(len(chains), 1, 1, generator=generator) < human
    target_BS3 = torch.where(asked_B11, humans.draw(number, generator), reached_BS3)
    return target_BS3 * chains.filled_BS[..., None]
