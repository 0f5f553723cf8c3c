"""What of a robot moves as one: its base, and the child of each driven joint, each with all that is fixed to it.

Legend: B batch, A driven joints, L bodies: the base, and the child of each driven joint.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from mrhubo.robot.model import LinkPoses, Robot
from mrhubo.robot.urdf import link_poses


class DrivenBodies(nn.Module):
    """The bodies of one robot, on the robot's device. Joints that are not driven stay where they are held."""

    above_LA: Tensor
    """1 where a driven joint moves a body against the base."""
    _children_A: Tensor

    def __init__(self, robot: Robot) -> None:
        """Reads the robot's URDF."""
        super().__init__()
        self._description, self._driven = robot.description, frozenset(robot.driven_joints)
        children = [self._description.joints[name].child for name in robot.driven_joints]
        self.links = (self._description.root, *children)
        """The link that stands for each (L)."""
        self._number = {link: number for number, link in enumerate(self.links)}
        self._rest = link_poses(self._description.parsed, robot.configuration(robot.home().cpu().numpy()))
        above = [{joint.name for joint in self._description.joints_above(link)} for link in self.links]
        above_LA = torch.tensor([[float(name in names) for name in robot.driven_joints] for names in above])
        rows_A = torch.tensor([robot.link_index(link) for link in children], dtype=torch.long)
        for name, tensor in (("above_LA", above_LA.reshape(len(self.links), -1)), ("_children_A", rows_A)):
            self.register_buffer(name, tensor.to(robot.lower_N.device), persistent=False)

    def link_of(self, link: str) -> str:
        """The link that stands for all that move with this one."""
        above = (joint.child for joint in self._description.joints_above(link) if joint.name in self._driven)
        return next(above, self._description.root)

    def number(self, link: str) -> int:
        """Of the body that a link belongs to; 0 is the base."""
        return self._number[self.link_of(link)]

    def inside(self, link: str) -> np.ndarray:
        """Pose (4, 4) of a link in the frame of its body."""
        return np.linalg.inv(self._rest[self.link_of(link)]) @ self._rest[link]

    def place(self, poses: LinkPoses) -> tuple[Tensor, Tensor]:
        """Rotations (B, L, 3, 3) and places (B, L, 3) [m] of bodies in poses of the robot, in the base frame."""
        rotation_BA33 = poses.rotation_BL33.index_select(1, self._children_A)
        position_BA3 = poses.position_BL3.index_select(1, self._children_A)
        eye_B133 = torch.eye(3, dtype=position_BA3.dtype, device=position_BA3.device).expand(len(position_BA3), 1, 3, 3)
        rotation_BL33 = torch.cat((eye_B133, rotation_BA33), dim=1)
        return rotation_BL33, torch.cat((eye_B133[..., 0] * 0, position_BA3), dim=1)
