"""How much each direction counts on one robot: what its joints cannot turn every way against the limb that carries it
counts less.

A hand asks for three angles beside its forearm's two. Where a wrist has fewer joints, what is missing would turn the
forearm away, by half of what a human wrist is bent where it only twists.

Legend: B random poses, N joints, D directions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from torch import Tensor

from mrhubo.robot.parts import LimbPart, OrientedPart

if TYPE_CHECKING:
    from mrhubo.robot.body_map import BodyMap

_POSES = 16
_TURN, _TURNED = 0.5, 0.15
"""Radians by which a joint is turned, and how far a direction then turns at least: a limb from an elbow's hinge beside
the arm's axis is 0.1 rad off the axis of its twist."""
_SWINGS = 0.25
"""How far [rad] the limb turns in the frame of what it carries, where a joint is between them that swings it."""
_EVERY_WAY = 3
"""Joints that turn something every way."""


@torch.no_grad()
def direction_weights(body_map: BodyMap) -> list[float]:
    """The weight of each direction (D), in order."""
    parts = {part.name: part for part in body_map.keypoints.parts}
    of = {
        name: weight
        for part in parts.values()
        for name, weight in zip(part.direction_names, part.direction_weights, strict=True)
    }
    names, carried = list(body_map.direction_names), []
    for part in parts.values():
        limb = parts.get(part.hangs_on or "")
        if isinstance(part, OrientedPart) and part.unturned_weights is not None and isinstance(limb, LimbPart):
            carried.append((part, part.unturned_weights, names.index(limb.end)))
    direction_XBD3 = _turned(body_map) if carried else torch.zeros(0)
    for part, (unswung, partly), limb in carried:
        rows = [names.index(name) for name in part.direction_names]
        if not _swings(direction_XBD3[0], rows, limb):
            of |= dict.fromkeys(part.direction_names, unswung)
        elif _joints(direction_XBD3, rows, limb) < _EVERY_WAY:
            of |= dict.fromkeys(part.direction_names, partly)
    return [of[name] for name in names]


def _turned(body_map: BodyMap) -> Tensor:
    """Directions (1 + N, B, D, 3) in random poses, and with each joint turned further."""
    robot, count = body_map.robot, len(body_map.robot.joint_names)
    q_BN = robot.sample(_POSES, torch.Generator().manual_seed(0))
    turned_NBN = q_BN + _TURN * torch.eye(count).to(q_BN)[:, None]
    poses = robot.forward(torch.cat((q_BN, turned_NBN.flatten(0, 1))))
    return body_map.robot_directions(poses).unflatten(0, (1 + count, _POSES))


def _swings(direction_BD3: Tensor, rows: list[int], limb: int) -> bool:
    """Whether a limb points elsewhere, seen from what it carries."""
    first_B3, second_B3 = (direction_BD3[:, row] for row in rows)
    axes_B33 = torch.stack((first_B3, second_B3, torch.linalg.cross(first_B3, second_B3)), dim=1)
    limb_B3 = (axes_B33 @ direction_BD3[:, limb, :, None])[..., 0]
    return float((limb_B3 - limb_B3.mean(dim=0)).norm(dim=-1).max()) > _SWINGS


def _joints(direction_XBD3: Tensor, rows: list[int], limb: int) -> int:
    """How many joints turn something, and not the limb that carries it."""
    change_ND = (direction_XBD3[1:] - direction_XBD3[0]).norm(dim=-1).amax(dim=1)
    return int(((change_ND[:, rows].amax(dim=1) > _TURNED) & (change_ND[:, limb] < _TURNED)).sum())
