"""What of a robot besides its soles is near the floor, when it kneels, crawls or lies: the balls of its outline.

What cannot give way lifts the robot: trunk, head and knees; so do arms, as long as nothing else lies on the floor, of
who stands on the hands. Else arms bend (`bending`). Balls that are nearer to a leg's ankle than to its knee are left to
the soles, and so are those that are lower than these as the robot stands at home: who made it means them to be there.

Legend: T frames, K balls, A driven joints, S arms.
"""

from __future__ import annotations

from functools import cached_property

import torch
from torch import Tensor, nn

from mrhubo.reference.standing.arms import Arm, find_arms
from mrhubo.reference.standing.legs import Legs
from mrhubo.robot import LinkPoses
from mrhubo.robot.outline import Outline

NEAR = 0.3
"""A robot whose joint centres are no lower than this [m], on a person's scale, has nothing near the floor but feet."""
_AT_ONCE = 2**22
"""Most balls, over all frames, that are in memory."""


class LowBody(nn.Module):
    """The outline of one robot with legs; shapes are read when something is near the floor for the first time."""

    def __init__(self, legs: Legs) -> None:
        super().__init__()
        self.legs = legs
        self._marks = Outline(legs.body_map, with_shapes=False)
        self._marks_K = self._counting(self._marks)

    @cached_property
    def outline(self) -> Outline:
        """The balls."""
        return Outline(self.legs.body_map)

    @cached_property
    def arms(self) -> list[Arm]:
        """The arms (S)."""
        return find_arms(self.legs, self.outline)

    @cached_property
    def _arms_K(self) -> Tensor:
        """Which balls of the outline belong to arms (K,)."""
        none_K = torch.zeros_like(self.outline.radius_K, dtype=torch.bool)
        return sum((arm.upper_K | arm.lower_K for arm in self.arms), none_K)

    @cached_property
    def _lifting_K(self) -> Tensor:
        """Which of the others are looked at (K,)."""
        return self._counting(self.outline) & ~self._arms_K

    @property
    def counts_K(self) -> Tensor:
        """Which balls of the outline are looked at (K,)."""
        return self._lifting_K | self._arms_K

    @property
    def arms_N(self) -> Tensor:
        """Which joints move arms (N,)."""
        none_N = torch.zeros_like(self.outline.robot.lower_N, dtype=torch.bool)
        drive_AN = self.outline.robot.drive_DN != 0
        return sum(((arm.moving_A[:, None] & drive_AN).any(dim=0) for arm in self.arms), none_N)

    def raised(self, target_TD3: Tensor, poses: LinkPoses, up_T3: Tensor, raise_TS2: Tensor) -> Tensor:
        """The person's directions (T, D, 3), of which those of arms are raised; arguments as for `Legs.over_floor` and
        `Arm.raised`.
        """
        way_T3 = self.legs.upright(poses, up_T3)
        for number, arm in enumerate(self.arms):
            target_TD3 = arm.raised(target_TD3, poses, way_T3, raise_TS2[:, number])
        return target_TD3

    def near(self, poses: LinkPoses, up_T3: Tensor, height_T: Tensor) -> bool:
        """Whether anything but the feet is near the floor in a motion; arguments as for `Legs.over_floor`."""
        height_TK = self.legs.over_floor(self._marks, poses, up_T3, height_T)[0][:, self._marks_K]
        return bool((height_TK < NEAR * self.legs.scale).any())

    def lowest(self, poses: LinkPoses, up_T3: Tensor, height_T: Tensor) -> tuple[Tensor, Tensor]:
        """Heights [m] of the lowest of all but arms and soles (T,), and of each upper and lower arm (T, S, 2); infinite
        where the robot has no such ball. Arguments as for `Legs.over_floor`.
        """
        outline = self.outline
        groups = [self._lifting_K, *(some_K for arm in self.arms for some_K in (arm.upper_K, arm.lower_K))]
        frames, found = max(1, _AT_ONCE // max(1, len(outline.radius_K))), []
        for first in range(0, len(up_T3), frames):
            part = slice(first, first + frames)
            some = LinkPoses(poses.rotation_BL33[part], poses.position_BL3[part])
            height_TK = self.legs.over_floor(outline, some, up_T3[part], height_T[part])[0]
            far_T1 = torch.full_like(height_TK[:, :1], torch.inf)
            found.append(torch.stack([torch.cat((height_TK[:, k], far_T1), 1).amin(1) for k in groups], dim=1))
        found_TG = torch.cat(found)
        return found_TG[:, 0], found_TG[:, 1:].unflatten(1, (len(self.arms), 2))

    def lowest_of_any(self, poses: LinkPoses, up_T3: Tensor, height_T: Tensor) -> Tensor:
        """The least of these heights (T,)."""
        body_T, arm_TS2 = self.lowest(poses, up_T3, height_T)
        return torch.cat((body_T[:, None], arm_TS2.flatten(1)), dim=1).amin(dim=1)

    def _counting(self, outline: Outline) -> Tensor:
        """Which balls are looked at (K,)."""
        robot, legs = outline.robot, self.legs
        home = robot.forward(robot.home()[None])
        up_13, none_1 = robot.lower_N.new_tensor([[0.0, 1.0, 0.0]]), robot.lower_N.new_zeros(1)
        height_1K, place_1K3 = legs.over_floor(outline, home, up_13, none_1)
        seen = legs.places(home)
        sole = float((seen.ball_BK3[0, :, 1] - legs.radius_K).min())
        counts_K = height_1K[0] >= sole
        for chain, sole_link in zip(legs.chains, (sole.link for sole in legs.soles), strict=True):
            own_A = outline.moving(sole_link) - outline.moving(legs.link)
            in_leg_K = (outline.moved_against(legs.link) * own_A).abs().sum(dim=1) > 0
            knee_3, ankle_3 = (legs.place(home, name) for name in (chain[-1].start, chain[-1].end))
            nearer_K = (place_1K3[0] - ankle_3).norm(dim=-1) < (place_1K3[0] - knee_3).norm(dim=-1)
            counts_K = counts_K & ~(in_leg_K & nearer_K)
        return counts_K
