"""How the directions that robot and human share turn with the robot's joints: the analytic (geometric) Jacobian.

A revolute joint with unit axis a through the point o moves every point p below it by a x (p - o), a prismatic one
(which can only follow a revolute one here) by a. A limb's direction v = (e - s) / |e - s| then changes by
(I - v v^T) (de - ds) / |e - s|, an axis fixed to a link by a x v. Directions are seen from another part: a joint above
both turns none of them, and one above that part alone turns all the other way. No automatic differentiation: everything
is read off the link poses of one forward pass.

Legend: B batch, D directions, A driven joints (`Robot.driven_joints`: those of q and those that mimic them), N joints
of q, P pairs of a direction and a driven joint that turns it (the others are zero, and are most), V parts from which
directions are seen.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from mrhubo.reference.blocks import connected
from mrhubo.robot import BodyMap, LinkPoses
from mrhubo.robot.keypoints import Limb


class DirectionJacobian(nn.Module):
    """Directions of a robot and their derivatives."""

    moved_DN: Tensor
    """Which joints of q turn which direction (D, N)."""
    _children_A: Tensor
    _axes_A3: Tensor
    _direction_P: Tensor
    _joint_P: Tensor
    _end_P1: Tensor
    _start_P1: Tensor
    _bend_P1: Tensor
    _slide_P1: Tensor
    _layers_KX: Tensor

    def __init__(self, body_map: BodyMap) -> None:
        """Looks up which joint turns which direction."""
        super().__init__()
        self.body_map, self.robot = body_map, body_map.robot
        joints = [self.robot.description.joints[name] for name in self.robot.driven_joints]
        self._keep("_children_A", torch.tensor([self.robot.link_index(joint.child) for joint in joints]))
        self._keep("_axes_A3", torch.tensor([joint.axis_3.tolist() for joint in joints]))
        self._list_pairs()

    def _keep(self, name: str, tensor: Tensor) -> None:
        """A constant, where the robot is."""
        self.register_buffer(name, tensor.to(self.robot.lower_N.device), persistent=False)

    def _list_pairs(self) -> None:
        robot, shared = self.robot, self.body_map.shared

        def above(link: str) -> set[str]:
            return {joint.name for joint in robot.description.joints_above(link)}

        above_view = {name: above(link) for name, link in zip(shared.views, shared.view_links, strict=True)}
        pairs: list[tuple[int, int]] = []
        factors: list[tuple[float, float, float, float]] = []
        places: dict[tuple[int, int], list[int]] = {}
        for d, direction in enumerate(self.body_map.directions):
            view = above_view[direction.part.seen_from or ""]
            if isinstance(direction, Limb):
                above_start, above_end = above(direction.start.link), above(direction.end.link)
            else:
                above_start, above_end = view, above(direction.link)
            for a, name in enumerate(robot.driven_joints):
                end, start = (float(name in found) - float(name in view) for found in (above_end, above_start))
                bend = end - start if isinstance(direction, Limb) else 0.0
                turn = float(robot.description.joints[name].rotary)
                for n, ratio in enumerate(robot.drive_DN[a].tolist()):
                    # pair = axis x (end * e - start * s - bend * o) + slide * axis, before the projection
                    if ratio and (turn * (end or start) or bend):
                        places.setdefault((d, n), []).append(len(pairs))
                        pairs.append((d, a))
                        factors.append((ratio * turn * end, ratio * turn * start, ratio * turn * bend,
                                        ratio * (1 - turn) * bend))  # fmt: skip
        shape_DN = (len(self.body_map.directions), len(robot.joint_names))
        moved_DN = torch.tensor([[(d, n) in places for n in range(shape_DN[1])] for d in range(shape_DN[0])])
        self._keep("moved_DN", moved_DN)
        self.blocks = connected({n for n, moved in enumerate(row) if moved} for row in moved_DN.tolist())
        """Directions and joints of each part of the robot that turns apart from the others (an arm, the head): the
        connected components of "joint turns direction". A direction that no joint turns is in none."""
        # Axes and origins of joints are in the frames of all parts from which directions are seen, one after the other.
        joints = len(robot.driven_joints)
        self._keep("_direction_P", torch.tensor([d for d, _ in pairs]))
        self._keep("_joint_P", torch.tensor([int(shared.view_D[d]) * joints + a for d, a in pairs]))
        for name, factor_P1 in zip(("_end_P1", "_start_P1", "_bend_P1", "_slide_P1"),
                                   torch.tensor(factors).T[..., None], strict=True):  # fmt: skip
            self._keep(name, factor_P1)
        # Where each entry of the Jacobian is found among the P * 3 numbers, or the zero after them; a joint that others
        # mimic has several pairs for one entry, which are added.
        layers = max(len(found) for found in places.values())
        index = torch.full((layers, shape_DN[0], 3, shape_DN[1]), 3 * len(pairs))
        for (d, n), found in places.items():
            for layer, p in enumerate(found):
                index[layer, d, :, n] = torch.tensor([3 * p, 3 * p + 1, 3 * p + 2])
        self._keep("_layers_KX", index.flatten(1))

    def forward(self, q_BN: Tensor) -> tuple[Tensor, Tensor]:
        """Unit directions (B, D, 3), as of `BodyMap.robot_directions`, and their Jacobian (B, D, 3, N) [1/rad]."""
        return self.at(self.robot.forward(q_BN))

    def at(self, poses: LinkPoses) -> tuple[Tensor, Tensor]:
        """As `forward`, for the robot's link poses."""
        shared = self.body_map.shared
        view = shared.view_robot(poses)
        directions_BD3 = view.direction_BD3
        axis_BA3 = (poses.rotation_BL33.index_select(1, self._children_A) @ self._axes_A3[..., None])[..., 0]
        axis_BA3 = _in_views(axis_BA3, view.views)
        origin_BA3 = _in_views(poses.position_BL3.index_select(1, self._children_A), view.views)
        # An axis fixed to a link is written as a limb of length 1 from 0 to the axis.
        start_BD3, end_BD3 = torch.zeros_like(directions_BD3), directions_BD3.clone()
        start_BD3[:, shared.limb_columns] = shared.seen(view.start_BE3, view.views, limbs=True)
        end_BD3[:, shared.limb_columns] = shared.seen(view.end_BE3, view.views, limbs=True)
        inverse_length_BD1 = (end_BD3 - start_BD3).square().sum(-1, keepdim=True).rsqrt()

        d, a = self._direction_P, self._joint_P
        axis_BP3 = axis_BA3.index_select(1, a)
        lever_BP3 = end_BD3.index_select(1, d) * self._end_P1 - start_BD3.index_select(1, d) * self._start_P1
        lever_BP3 = lever_BP3 - origin_BA3.index_select(1, a) * self._bend_P1
        moved_BP3 = torch.linalg.cross(axis_BP3, lever_BP3) + axis_BP3 * self._slide_P1
        direction_BP3 = directions_BD3.index_select(1, d)
        moved_BP3 = moved_BP3 - direction_BP3 * (direction_BP3 * moved_BP3).sum(-1, keepdim=True)
        entries_BX = (moved_BP3 * inverse_length_BD1.index_select(1, d)).flatten(1)
        entries_BX = torch.nn.functional.pad(entries_BX, (0, 1))
        jacobian_BX = sum((entries_BX.index_select(1, x) for x in self._layers_KX[1:]),
                          start=entries_BX.index_select(1, self._layers_KX[0]))  # fmt: skip
        return directions_BD3, jacobian_BX.unflatten(1, (directions_BD3.shape[1], 3, -1))


def _in_views(vectors_BA3: Tensor, views: list[Tensor]) -> Tensor:
    """Vectors (B, V A, 3) of the base frame, in the axes of one part after the other."""
    found = [vectors_BA3 @ view_B33 for view_B33 in views]
    return found[0] if len(found) == 1 else torch.cat(found, dim=1)
