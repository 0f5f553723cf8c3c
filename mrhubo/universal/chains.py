"""Batches of chains of joints, all different, with the directions that they turn and how these turn.

A chain is given where all its joints are at 0: axes a_n and points p_n on them, in human axes (x left, y up, z
forward) of the part from which its directions are seen. It is a product of exponentials (R. Brockett, "Robotic
manipulators and the product of exponentials formula", 1984),

    T_n(q) = exp([a_1, p_1] q_1) ... exp([a_n, p_n] q_n),

whose Jacobian is geometric: no automatic differentiation.

Legend: B chains, N joints from the body outwards (those beyond a chain's own are absent), S = 5 slots of directions
(`slots`).
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import torch
from torch import Tensor
from torch.nn.functional import normalize

from mrhubo.universal.slots import SIGN_3


@dataclass(frozen=True)
class Local:
    """Directions somewhere, and how they turn there."""

    direction_BS3: Tensor
    """Unit; of no meaning where a slot is empty."""
    jacobian_BS3N: Tensor
    """[1/rad]; 0 where a slot is empty or a joint absent."""
    axis_BN3: Tensor
    """The joints' axes, unit; 0 where a joint is absent."""


@dataclass(frozen=True)
class Chains:
    """B chains."""

    axis_BN3: Tensor
    point_BN3: Tensor
    present_BN: Tensor
    """1 where there is a joint, else 0."""
    lower_BN: Tensor
    upper_BN: Tensor
    """Limits [rad]; -1 and 1 where there is no joint."""
    start_BS3: Tensor
    """Where a limb starts; 0 for axes."""
    end_BS3: Tensor
    """Where it ends; an axis itself."""
    start_body_BS: Tensor
    """How many joints carry the start,"""
    end_body_BS: Tensor
    """and the end."""
    filled_BS: Tensor
    """1 where a slot has a direction."""
    weight_BS: Tensor
    """The directions' weights; 0 where there is none."""

    def __len__(self) -> int:
        return len(self.axis_BN3)

    @property
    def middle_BN(self) -> Tensor:
        """The middle of the limits [rad]."""
        return (self.lower_BN + self.upper_BN) / 2

    def rows(self, rows: Tensor | slice) -> Chains:
        """Some of them."""
        return Chains(*(getattr(self, field.name)[rows] for field in fields(self)))

    def senses(self) -> Tensor:
        """-1 for joints (B, N) whose axis does not point as a canonical one does (`SIGN_3`); else 1."""
        along_BN = self.local(self.middle_BN).axis_BN3 @ self.axis_BN3.new_tensor(SIGN_3)
        return torch.where(along_BN < 0, -1.0, 1.0)

    def canonical(self) -> Chains:
        """The same chains with canonical senses of turn; angles are to be multiplied by `senses`."""
        sense_BN = self.senses()
        turned_BN = sense_BN < 0
        lower_BN = torch.where(turned_BN, -self.upper_BN, self.lower_BN)
        upper_BN = torch.where(turned_BN, -self.lower_BN, self.upper_BN)
        return replace(self, axis_BN3=self.axis_BN3 * sense_BN[..., None], lower_BN=lower_BN, upper_BN=upper_BN)

    def local(self, q_BN: Tensor) -> Local:
        """Directions and Jacobian at joint angles (B, N) [rad]."""
        batch, joints = q_BN.shape
        turn_BN33 = rodrigues(self.axis_BN3, q_BN * self.present_BN)
        rotation_B33 = torch.eye(3).to(q_BN).expand(batch, 3, 3)
        position_B3 = q_BN.new_zeros(batch, 3)
        rotations, positions, axes, points = [rotation_B33], [position_B3], [], []
        # A turn about an axis through p moves x to p + R (x - p).
        shift_BN3 = self.point_BN3 - (turn_BN33 @ self.point_BN3[..., None])[..., 0]
        for n in range(joints):
            vectors_B33 = torch.stack((self.axis_BN3[:, n], self.point_BN3[:, n], shift_BN3[:, n]), dim=2)
            axis_B3, point_B3, moved_B3 = (rotation_B33 @ vectors_B33).unbind(2)
            axes.append(axis_B3)
            points.append(point_B3 + position_B3)
            position_B3 = position_B3 + moved_B3
            rotation_B33 = rotation_B33 @ turn_BN33[:, n]
            rotations.append(rotation_B33)
            positions.append(position_B3)
        rotation_BL33, position_BL3 = torch.stack(rotations, dim=1), torch.stack(positions, dim=1)
        axis_BN3, point_BN3 = torch.stack(axes, dim=1), torch.stack(points, dim=1)
        row_B1 = torch.arange(batch, device=q_BN.device)[:, None]
        limb_S1 = q_BN.new_tensor([1.0, 0.0, 1.0, 0.0, 0.0])[:, None]
        start_BS3, end_BS3 = (
            (rotation_BL33[row_B1, body_BS] @ point_BS3[..., None])[..., 0] + limb_S1 * position_BL3[row_B1, body_BS]
            for body_BS, point_BS3 in ((self.start_body_BS, self.start_BS3), (self.end_body_BS, self.end_BS3))
        )
        along_BS3 = end_BS3 - start_BS3
        length_BS1 = along_BS3.norm(dim=-1, keepdim=True).clamp_min(1e-6)
        direction_BS3 = along_BS3 / length_BS1
        number_N = torch.arange(joints, device=q_BN.device)
        turns_end_BSN, turns_start_BSN = (
            (body_BS[..., None] > number_N).to(q_BN)[..., None] for body_BS in (self.end_body_BS, self.start_body_BS)
        )
        # Of a limb both ends turn about the joint's point; of an axis the end alone, about 0.
        about_BSN3 = point_BN3[:, None] * limb_S1[..., None]
        lever_BSN3 = turns_end_BSN * (end_BS3[:, :, None] - about_BSN3)
        lever_BSN3 = lever_BSN3 - limb_S1[..., None] * turns_start_BSN * (start_BS3[:, :, None] - about_BSN3)
        moved_BSN3 = torch.linalg.cross(axis_BN3[:, None].expand_as(lever_BSN3), lever_BSN3)
        along_BSN1 = moved_BSN3 @ direction_BS3[..., None]
        moved_BSN3 = (moved_BSN3 - along_BSN1 * direction_BS3[:, :, None]) / length_BS1[..., None]
        there_BSN1 = self.filled_BS[:, :, None, None] * self.present_BN[:, None, :, None]
        return Local(direction_BS3, (moved_BSN3 * there_BSN1).mT, axis_BN3 * self.present_BN[..., None])


def rodrigues(axis_X3: Tensor, angle_X: Tensor) -> Tensor:
    """Rotations (..., 3, 3) about unit axes (..., 3) by angles (...) [rad]."""
    x, y, z = axis_X3.unbind(-1)
    zero = torch.zeros_like(x)
    across_X33 = torch.stack((zero, -z, y, z, zero, -x, -y, x, zero), dim=-1).unflatten(-1, (3, 3))
    sine_X11, rest_X11 = angle_X.sin()[..., None, None], (1 - angle_X.cos())[..., None, None]
    return torch.eye(3).to(axis_X3) + sine_X11 * across_X33 + rest_X11 * (across_X33 @ across_X33)


def random_units(count: int, *more: int, generator: torch.Generator) -> Tensor:
    """Unit vectors (count, *more, 3) of any direction."""
    return normalize(torch.randn(count, *more, 3, generator=generator), dim=-1)
