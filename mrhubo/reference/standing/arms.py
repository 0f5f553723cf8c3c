"""Arms that are held higher than the person's, so that nothing of them is under the floor.

The places of elbow and wrist, of a robot whose limbs point as the person's do, are raised along the vertical, and the
directions are those of the raised places. An arm that hangs straight down has to bend for that: about the axis about
which the person's elbow bends, as the upper arm is turned.

Legend: T frames, K balls, A driven joints, D directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import normalize

from mrhubo.reference.standing.legs import Legs
from mrhubo.robot import LinkPoses
from mrhubo.robot.bending import bend_axis
from mrhubo.robot.outline import Outline
from mrhubo.robot.parts import BendPart, LimbPart

_TURNS = 0.05
"""How far [of the upper arm] the person's elbow is beside a straight arm where that tells the plane of a raised one, as
much as the axis does."""
_SHORT = 1e-9


@dataclass(frozen=True)
class Arm:
    """One arm."""

    upper: int
    """Columns of its directions: of the upper arm,"""
    lower: int | None
    """the forearm, where the robot has one,"""
    axis: int | None
    """and the elbow's axis, where the robot has one."""
    lengths: tuple[float, float]
    """Of upper arm and forearm [m]."""
    axes_33: Tensor
    """Human axes of the link from which the directions are seen, in its frame,"""
    row: int
    """and which of the robot's links it is."""
    upper_K: Tensor
    """Balls of the outline that go with the elbow (K,): nearer to the upper arm than to what follows,"""
    lower_K: Tensor
    """and the others that the arm's joints move."""
    moving_A: Tensor
    """Which driven joints move it (A,)."""

    def raised(self, target_TD3: Tensor, poses: LinkPoses, way_T3: Tensor, raise_T2: Tensor) -> Tensor:
        """Directions (T, D, 3) of the person, of which those of the arm are raised.

        Args:
            target_TD3: the person's.
            poses: of the robot.
            way_T3: the upright direction, in its base frame.
            raise_T2: how far elbow and wrist are to be higher [m]; the wrist goes with the elbow.
        """
        up_T3 = (way_T3[:, None] @ poses.rotation_BL33[:, self.row] @ self.axes_33)[:, 0]
        moved_T11 = (raise_T2 > 0).any(dim=1)[:, None, None]
        return torch.where(moved_T11, self._raised(target_TD3, up_T3, raise_T2), target_TD3)

    def _raised(self, target_TD3: Tensor, up_T3: Tensor, raise_T2: Tensor) -> Tensor:
        found_TD3, own_T3 = target_TD3.clone(), target_TD3[:, self.upper]
        size_T1 = own_T3.norm(dim=-1, keepdim=True)
        upper_T3 = normalize(self.lengths[0] * normalize(own_T3, dim=-1) + raise_T2[:, :1] * up_T3, dim=-1)
        if self.lower is not None:
            lower_size_T1 = target_TD3[:, self.lower].norm(dim=-1, keepdim=True)
            lower_T3 = normalize(target_TD3[:, self.lower], dim=-1)
            more_T1 = (raise_T2[:, 1:] - raise_T2[:, :1]).clamp(min=0.0)
            axis_T3 = torch.zeros_like(upper_T3) if self.axis is None else target_TD3[:, self.axis]
            upper_T3, lower_T3 = self._bent(upper_T3, lower_T3, axis_T3, up_T3, more_T1)
            found_TD3[:, self.lower] = lower_T3 * lower_size_T1
            if self.axis is not None:
                axis_T3, needed_T = bend_axis(upper_T3, lower_T3, axis_T3)
                found_TD3[:, self.axis] = axis_T3 * needed_T[:, None]
        found_TD3[:, self.upper] = upper_T3 * size_T1
        return found_TD3

    def _bent(
        self, upper_T3: Tensor, lower_T3: Tensor, axis_T3: Tensor, up_T3: Tensor, more_T1: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Unit directions of both limbs whose wrist is so much higher [m]."""
        upper, lower = self.lengths
        own_T3 = upper * upper_T3 + lower * lower_T3
        wrist_T3 = own_T3 + more_T1 * up_T3
        far_T1 = wrist_T3.norm(dim=-1, keepdim=True).clamp(min=_SHORT)
        reach_T1 = far_T1.clamp(abs(upper - lower) + _SHORT, upper + lower)
        way_T3 = wrist_T3 / far_T1
        along_T1 = (reach_T1.square() + upper**2 - lower**2) / (2 * reach_T1)
        beside_T1 = (upper**2 - along_T1.square()).clamp(min=0.0).sqrt()
        elbow_T3 = _across(upper * upper_T3, normalize(own_T3, dim=-1, eps=_SHORT))
        bends_T3 = -_TURNS * upper * torch.linalg.cross(axis_T3, upper_T3)
        share_T1 = (more_T1 / (_TURNS * upper)).clamp(max=1.0)
        side_T3 = normalize(_across(elbow_T3 + share_T1 * bends_T3, way_T3), dim=-1, eps=_SHORT)
        elbow_T3 = along_T1 * way_T3 + beside_T1 * side_T3
        return normalize(elbow_T3, dim=-1), normalize(reach_T1 * way_T3 - elbow_T3, dim=-1)


def _across(vector_T3: Tensor, way_T3: Tensor) -> Tensor:
    """What of a vector is at right angles to a unit one."""
    return vector_T3 - (vector_T3 * way_T3).sum(dim=-1, keepdim=True) * way_T3


def find_arms(legs: Legs, outline: Outline) -> list[Arm]:
    """The arms of a robot whose outline is this."""
    keypoints, robot, shared = legs.body_map.keypoints, legs.body_map.robot, legs.body_map.shared
    home = robot.forward(robot.home()[None])
    place_K3, found = outline.places(home)[0], []
    limbs = [part for part in keypoints.parts if isinstance(part, LimbPart) and part.region == "arm"]
    bends = {part.hangs_on: part.name for part in keypoints.parts if isinstance(part, BendPart)}
    for part in (part for part in limbs if part.hangs_on not in {limb.name for limb in limbs}):
        lower = next((limb for limb in limbs if limb.hangs_on == part.name), None)
        view = part.seen_from or ""
        link, last = keypoints.ends[view].link, keypoints.points[(lower or part).end].link
        own_A = outline.moving(last) - outline.moving(link)
        moved_K = (outline.moved_against(link) * own_A).abs().sum(dim=1) > 0
        start_3, elbow_3, wrist_3 = (legs.place(home, name) for name in (part.start, part.end, (lower or part).end))
        first_K = _distance(place_K3, start_3, elbow_3) <= _distance(place_K3, elbow_3, wrist_3)
        upper_K = moved_K if lower is None else moved_K & first_K
        bend = bends.get(part.name)
        found.append(Arm(
            upper=shared.names.index(part.end), lower=None if lower is None else shared.names.index(lower.end),
            axis=shared.names.index(bend) if bend in shared.names else None,
            lengths=(float((elbow_3 - start_3).norm()), float((wrist_3 - elbow_3).norm())),
            axes_33=shared.view_axes_V33[shared.views.index(view)], row=robot.link_index(link),
            upper_K=upper_K, lower_K=moved_K & ~upper_K, moving_A=own_A != 0,
        ))  # fmt: skip
    return found


def _distance(place_K3: Tensor, start_3: Tensor, end_3: Tensor) -> Tensor:
    """Of places from a line between two others (K,) [m]."""
    along_3 = end_3 - start_3
    share_K = ((place_K3 - start_3) @ along_3 / along_3.square().sum().clamp(min=_SHORT)).clamp(0.0, 1.0)
    return (place_K3 - start_3 - share_K[:, None] * along_3).norm(dim=-1)
