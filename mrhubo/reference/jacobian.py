"""How the directions that robot and human share turn with the robot's joints: the analytic (geometric) Jacobian.

A revolute joint with unit axis a through the point o moves every point p below it by a x (p - o), a prismatic one
(which can only follow a revolute one here) by a. A limb's direction v = (e - s) / |e - s| then changes by
(I - v v^T) (de - ds) / |e - s|, an axis fixed to a link by a x v. Directions are seen from the chest, so joints above
the chest turn none of them. No automatic differentiation: everything is read off the link poses of one forward pass.

Legend: B batch, D directions, A driven joints (`Robot.driven_joints`: those of q and those that mimic them), N joints
of q, P pairs of a direction and a driven joint above it (the others are zero, and are most).
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.robot import BodyMap, LinkPoses


class DirectionJacobian:
    """Directions of a robot and their derivatives; built for the device on which the body map is."""

    def __init__(self, body_map: BodyMap) -> None:
        self.body_map, robot = body_map, body_map.robot
        device = robot.lower_N.device
        joints = [robot.description.joints[name] for name in robot.driven_joints]
        self.robot = robot.with_links([joint.child for joint in joints])
        self._children = [self.robot.link_index(joint.child) for joint in joints]
        self._axes_A3 = torch.tensor([joint.axis_3.tolist() for joint in joints], device=device)
        self._limbs = [i for i, d in enumerate(body_map.directions) if d.axis_3 is None]
        self._list_pairs()

    def _list_pairs(self) -> None:
        body_map, robot = self.body_map, self.body_map.robot
        device = robot.lower_N.device

        def above(link: str) -> set[str]:
            return {joint.name for joint in robot.description.joints_above(link)}

        above_chest = above(body_map.chest.link)
        pairs: list[tuple[int, int]] = []
        factors: list[tuple[float, float, float, float]] = []
        places: dict[tuple[int, int], list[int]] = {}
        for d, direction in enumerate(body_map.directions):
            above_end = above(direction.link) - above_chest
            above_start = above(direction.start.link) - above_chest if direction.start else set()
            for a, name in enumerate(robot.driven_joints):
                end, start = float(name in above_end), float(name in above_start)
                bend = end - start if direction.axis_3 is None else 0.0
                turn = float(robot.description.joints[name].rotary)
                for n, ratio in enumerate(robot.drive_DN[a].tolist()):
                    # pair = axis x (end * e - start * s - bend * o) + slide * axis, before the projection
                    if ratio and (turn * (end or start) or bend):
                        places.setdefault((d, n), []).append(len(pairs))
                        pairs.append((d, a))
                        factors.append((ratio * turn * end, ratio * turn * start, ratio * turn * bend,
                                        ratio * (1 - turn) * bend))  # fmt: skip
        shape_DN = (len(body_map.directions), len(robot.joint_names))
        self.moved_DN = torch.tensor([[(d, n) in places for n in range(shape_DN[1])] for d in range(shape_DN[0])])
        """Which joints of q are above which direction (D, N)."""
        self.blocks = _blocks(self.moved_DN)
        """Directions and joints of each part of the robot that turns apart from the others (an arm, the head): the
        connected components of "joint is above direction". A direction that no joint turns is in none."""
        self._direction_P = torch.tensor([d for d, _ in pairs], device=device)
        self._joint_P = torch.tensor([a for _, a in pairs], device=device)
        self._end_P1, self._start_P1, self._bend_P1, self._slide_P1 = torch.tensor(factors, device=device).T[..., None]
        # Where each entry of the Jacobian is found among the P * 3 numbers, or the zero after them; a joint that others
        # mimic has several pairs for one entry, which are added.
        layers = max(len(found) for found in places.values())
        index = torch.full((layers, shape_DN[0], 3, shape_DN[1]), 3 * len(pairs))
        for (d, n), found in places.items():
            for layer, p in enumerate(found):
                index[layer, d, :, n] = torch.tensor([3 * p, 3 * p + 1, 3 * p + 2])
        self._layers_KX = index.flatten(1).to(device)

    def forward(self, q_BN: Tensor) -> tuple[Tensor, Tensor]:
        """Unit directions (B, D, 3), seen from the chest in human axes, and their Jacobian (B, D, 3, N) [1/rad]."""
        poses = self.robot.forward(q_BN)
        directions_BD3 = self.body_map.robot_directions(poses)
        return directions_BD3, self.jacobian(poses, directions_BD3)

    def jacobian(self, poses: LinkPoses, directions_BD3: Tensor) -> Tensor:
        """Derivatives (B, D, 3, N) [1/rad] of the directions by q, for `self.robot`'s link poses at q."""
        chest_B33 = self.body_map.chest_axes(poses)
        axis_BA3 = (poses.rotation_BL33[:, self._children] @ self._axes_A3[..., None])[..., 0] @ chest_B33
        origin_BA3 = poses.position_BL3[:, self._children] @ chest_B33
        # An axis fixed to a link is written as a limb of length 1 from 0 to the axis.
        start_BD3, end_BD3 = torch.zeros_like(directions_BD3), directions_BD3.clone()
        start_links, end_links = self.body_map.limb_links
        start_BD3[:, self._limbs] = self.body_map.limb_vectors(poses, 0, start_links) @ chest_B33
        end_BD3[:, self._limbs] = self.body_map.limb_vectors(poses, 1, end_links) @ chest_B33
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
        return jacobian_BX.unflatten(1, (directions_BD3.shape[1], 3, -1))


def _blocks(moved_DN: Tensor) -> list[tuple[set[int], set[int]]]:
    blocks: list[tuple[set[int], set[int]]] = []
    for direction, row in enumerate(moved_DN.tolist()):
        directions, joints = {direction}, {n for n, moved in enumerate(row) if moved}
        for block in [b for b in blocks if b[1] & joints]:
            directions, joints = directions | block[0], joints | block[1]
            blocks.remove(block)
        if joints:
            blocks.append((directions, joints))
    return sorted(blocks, key=lambda block: min(block[0]))
