"""How much each direction counts on one robot: what no joint swings against the limb that carries it counts little.

A hand whose wrist only twists points where its forearm does. Counted as one that is turned by itself, a bent human
wrist would turn the forearm away by half of what it is bent.

Legend: B random poses, D directions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch

from mrhubo.robot.parts import LimbPart, OrientedPart

if TYPE_CHECKING:
    from mrhubo.robot.body_map import BodyMap

_POSES = 16
_SWINGS = 0.1
"""How far [rad] the limb turns in the frame of what it carries, where a joint is between them that swings it: a wrist's
point is a little off the axis of the forearm's twist."""


@torch.no_grad()
def direction_weights(body_map: BodyMap) -> list[float]:
    """The weight of each direction (D), in order."""
    parts = {part.name: part for part in body_map.keypoints.parts}
    of = {
        name: weight
        for part in parts.values()
        for name, weight in zip(part.direction_names, part.direction_weights, strict=True)
    }
    robot, names = body_map.robot, list(body_map.direction_names)
    loose = [
        (part, limb) for part in parts.values()
        if isinstance(part, OrientedPart) and part.unswung_weight is not None
        and isinstance(limb := parts.get(part.hangs_on or ""), LimbPart)
    ]  # fmt: skip
    if loose:
        q_BN = robot.sample(_POSES, torch.Generator().manual_seed(0))
        direction_BD3 = body_map.robot_directions(robot.forward(q_BN))
    for part, limb in loose:
        first_B3, second_B3 = (direction_BD3[:, names.index(name)] for name in part.direction_names)
        axes_B33 = torch.stack((first_B3, second_B3, torch.linalg.cross(first_B3, second_B3)), dim=1)
        limb_B3 = (axes_B33 @ direction_BD3[:, names.index(limb.end), :, None])[..., 0]
        if float((limb_B3 - limb_B3.mean(dim=0)).norm(dim=-1).max()) < _SWINGS:
            of |= dict.fromkeys(part.direction_names, part.unswung_weight)
    return [of[name] for name in names]
