"""Unit directions that a robot and a human share, each seen from the part that its row of the table names.

Directions are in human axes (x left, y up, z forward) of that part, so neither proportions nor the way a base faces
matter. The length of a human's direction is how much it counts: 1 for limbs and oriented parts, 0 to 1 for bend axes.

Legend: B batch, D directions, E of them limbs, A of them axes (of oriented parts, then bend axes), V parts from which
they are seen, L robot links.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from mrhubo.body.skeleton import JOINT_NAMES, POSED_JOINT_NAMES, Skeleton, keypoint_indices
from mrhubo.body.turns import JointTurns
from mrhubo.frames import human_axes
from mrhubo.robot.bending import BendAxis, bend_axis, find_bend_axes
from mrhubo.robot.keypoints import Axis, Keypoints, Limb
from mrhubo.robot.model import LinkPoses, Robot
from mrhubo.robot.root_turn import is_turned_back, make_root_turn


@dataclass(frozen=True)
class RobotView:
    """A robot's directions, and what they were worked out from."""

    direction_BD3: Tensor
    """Unit directions, each in human axes of the part from which it is seen."""
    start_BE3: Tensor
    """Where limbs start [m], base frame."""
    end_BE3: Tensor
    """Where they end [m], base frame."""
    views: list[Tensor]
    """Rotations (B, 3, 3) of the parts from which directions are seen: columns are their left, up and forward."""


class Directions(nn.Module):
    """The directions of one robot's body parts."""

    limb_links_2E: Tensor
    limb_offsets_2E3: Tensor
    axis_links_A: Tensor
    axes_A3: Tensor
    rest_D3: Tensor
    order_D: Tensor
    view_axes_V33: Tensor
    view_D: Tensor
    turned_D: Tensor

    def __init__(self, robot: Robot, keypoints: Keypoints, skeleton: Skeleton) -> None:
        """Looks links and human joints up."""
        super().__init__()
        self.skeleton, self.keypoints = skeleton, keypoints
        found = [*keypoints.directions, *find_bend_axes(robot, keypoints)]
        self.all = tuple(sorted(found, key=lambda d: keypoints.parts.index(d.part)))
        self.names = tuple(d.name for d in self.all)
        limbs = [(i, d) for i, d in enumerate(self.all) if isinstance(d, Limb)]
        axes = [(i, d) for i, d in enumerate(self.all) if isinstance(d, Axis)]
        bends = [(i, d) for i, d in enumerate(self.all) if isinstance(d, BendAxis)]
        self.limb_columns = [i for i, _ in limbs]
        """Which of the directions are limbs."""
        self.bend_columns = [i for i, _ in bends]
        """Which are bend axes."""
        self.measured_columns = [i for i, _ in sorted((*limbs, *axes), key=lambda row: row[0])]
        """Which are limbs or belong to oriented parts: those that a robot's answer is measured by."""
        limb_of = {d.part.name: place for place, (_, d) in enumerate(limbs)}
        self._bent_limbs = [[limb_of[d.part.limbs[which]] for _, d in bends] for which in (0, 1)]
        self.views = tuple(dict.fromkeys(d.part.seen_from for d in self.all if d.part.seen_from))
        """The parts from which directions are seen."""
        self.view_links = tuple(keypoints.ends[name].link for name in self.views)
        views = [self.views.index(d.part.seen_from or "") for d in self.all]
        joint_of = {part.name: JOINT_NAMES.index(part.joint) for part in keypoints.parts}
        self._view_rows = [robot.link_index(link) for link in self.view_links]
        rows = [d for _, d in (*limbs, *axes, *bends)]
        self.turns = JointTurns([joint_of[name] for name in (*self.views, *(d.part.name for d in rows))])
        starts, tips = (keypoint_indices([getattr(d.part, end) for _, d in limbs]) for end in ("start", "end"))
        bones_E3 = torch.nn.functional.normalize(skeleton.rest_K3[tips] - skeleton.rest_K3[starts], dim=-1)
        rests = [*(d.rest for _, d in axes), *(d.part.rest for _, d in bends)]
        self._bends = len(bends)
        ends = [[d.start for _, d in limbs], [d.end for _, d in limbs]]
        tensors = {
            "limb_links_2E": torch.tensor(
                [[robot.link_index(point.link) for point in points] for points in ends], dtype=torch.long
            ),
            "limb_offsets_2E3": torch.tensor([[point.offset_3 for point in points] for points in ends]).reshape(
                2, -1, 3
            ),
            "axis_links_A": torch.tensor([robot.link_index(d.link) for _, d in (*axes, *bends)], dtype=torch.long),
            "axes_A3": torch.stack([d.axis_3 for _, d in (*axes, *bends)]) if axes or bends else torch.zeros(0, 3),
            "rest_D3": torch.cat([bones_E3, *(bones_E3.new_tensor([x]) for x in rests)]),
            "order_D": torch.tensor([i for i, _ in (*limbs, *axes, *bends)]).argsort(),
            "view_axes_V33": torch.stack([human_axes(keypoints.ends[name].axes_23) for name in self.views]),
            "view_D": torch.tensor(views),
            "turned_D": torch.tensor([is_turned_back(d.part) for d in self.all]),
        }
        for name, tensor in tensors.items():
            self.register_buffer(name, tensor, persistent=False)
        self.root_turn = make_root_turn(robot, keypoints)
        """How the base is turned further than the person's pelvis; None: it is not."""

    def view_robot(self, poses: LinkPoses) -> RobotView:
        """The robot's directions, with what they were worked out from."""
        start_BE3, end_BE3 = (self._limb_points(poses, which) for which in (0, 1))
        limbs = torch.nn.functional.normalize(end_BE3 - start_BE3, dim=-1)
        axes = (poses.rotation_BL33.index_select(1, self.axis_links_A) @ self.axes_A3[..., None])[..., 0]
        views = [
            poses.rotation_BL33[:, row] @ axes_33
            for row, axes_33 in zip(self._view_rows, self.view_axes_V33, strict=True)
        ]
        base_BD3 = torch.cat((limbs, axes), dim=1).index_select(1, self.order_D)
        return RobotView(self.seen(base_BD3, views), start_BE3, end_BE3, views)

    def _limb_points(self, poses: LinkPoses, which: int) -> Tensor:
        """Start (which=0) or end (which=1) points (B, E, 3) of the limbs, base frame [m]."""
        links = self.limb_links_2E[which]
        offset = (poses.rotation_BL33.index_select(1, links) @ self.limb_offsets_2E3[which, :, :, None])[..., 0]
        return poses.position_BL3.index_select(1, links) + offset

    def seen(self, vectors_BX3: Tensor, views: Sequence[Tensor], limbs: bool = False) -> Tensor:
        """A vector (B, X, 3) for each direction, or for each limb, in the axes of the part that sees it."""
        if len(views) == 1:
            return vectors_BX3 @ views[0]
        view_X = self.view_D[self.limb_columns] if limbs else self.view_D
        return (vectors_BX3[..., None, :] @ torch.stack(list(views), dim=1).index_select(1, view_X))[..., 0, :]

    def of_human(self, local_BJ33: Tensor) -> Tensor:
        """Directions (B, D, 3) of human poses (B, 21, 3, 3), in human axes of the parts from which they are seen; their
        length is how much they count.
        """
        turns_BX33, views = self.turns(local_BJ33), len(self.views)
        found_BD3 = (turns_BX33[:, views:] @ self.rest_D3[..., None].to(turns_BX33))[..., 0]
        if self._bends:
            upper_BX3, lower_BX3 = (found_BD3[:, places] for places in self._bent_limbs)
            bend_BX3, needed_BX = bend_axis(upper_BX3, lower_BX3, found_BD3[:, -self._bends :])
            found_BD3 = torch.cat((found_BD3[:, : -self._bends], bend_BX3 * needed_BX[..., None]), dim=1)
        seen_BD3 = self.seen(found_BD3.index_select(1, self.order_D), list(turns_BX33[:, :views].unbind(1)))
        if self.root_turn is None:
            return seen_BD3
        return torch.where(self.turned_D[:, None], seen_BD3 @ self.root_turn(local_BJ33), seen_BD3)

    def input_joints(self, directions: Iterable[int] | None = None) -> tuple[str, ...]:
        """The human joints that tell about all directions, or about some of them, in SMPL's order."""
        chosen = self.all if directions is None else [self.all[i] for i in directions]
        wanted = {name for d in chosen for name in d.part.inputs}
        return tuple(name for name in POSED_JOINT_NAMES if name in wanted)
