"""Turns a human's arms and head until they point exactly where the robot's do.

Latent inverse kinematics ends where prior and keypoints balance: a pose of Reachy's misses its head by 12 degrees and
its hands by 14 to 24, and a network trained on that turns robots' heads and hands too far. What is left of the way is
gone here, by the smallest turn of each joint, from the shoulders outwards; the rest of the pose stays.

Legend: B batch, D directions, J = 21 human joints.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body.skeleton import JOINT_NAMES, PARENTS
from mrhubo.robot.body_map import BodyMap
from mrhubo.robot.parts import ENDS, joint_of, limb_of, turn_of

_CHEST = JOINT_NAMES.index("spine3")
_NECK = JOINT_NAMES.index("neck")


def align_pose(body_map: BodyMap, local_BJ33: Tensor, direction_BD3: Tensor) -> Tensor:
    """Local rotations (B, 21, 3, 3) of the poses whose `BodyMap.human_directions` are the given ones.

    An upper arm or forearm turns about the axis across its old and new direction, so that no twist is added. A hand
    turns at the wrist; neck and head share the head's turn.

    Args:
        body_map: the robot's body map.
        local_BJ33: local rotations (B, 21, 3, 3) of the poses to start from.
        direction_BD3: unit directions (B, D, 3), seen from the chest, in human axes (`BodyMap.robot_directions`).
    """
    pose = _Pose(local_BJ33, body_map.skeleton.global_rotations(local_BJ33))
    rest_K3 = body_map.skeleton.rest_K3
    wanted = dict(zip(body_map.direction_names, (direction_BD3 @ pose.of(_CHEST).mT).unbind(1), strict=True))
    for d in body_map.directions:
        if d.axis_3 is None:
            inner, outer = (JOINT_NAMES.index(name) for name in limb_of(d.name))
            bone_3 = torch.nn.functional.normalize(rest_K3[outer] - rest_K3[inner], dim=0)
            pose.turn(inner, _shortest_turn(pose.of(inner) @ bone_3, wanted[d.name]))
    for end in body_map.ends:
        joint = JOINT_NAMES.index(joint_of(end))
        orientation_B33 = turn_of(end, *(wanted[f"{end}_{word}"] for word in ENDS[end]))
        if end == "head":
            missing = rotation.matrix_to_axis_angle(orientation_B33 @ pose.of(joint).mT)
            pose.turn(_NECK, rotation.axis_angle_to_matrix(missing / 2))
        pose.turn(joint, orientation_B33 @ pose.of(joint).mT)
    return pose.local()


class _Pose:
    """Poses whose joints are turned one after the other, inner ones first; what hangs on a joint turns with it."""

    def __init__(self, local_BJ33: Tensor, global_BJ33: Tensor) -> None:
        self._local_BJ33, self._global_BJ33 = local_BJ33, global_BJ33
        self._turned: dict[int, Tensor] = {}

    def of(self, joint: int) -> Tensor:
        """A joint's rotation (B, 3, 3) relative to the pelvis."""
        parent = PARENTS[joint]
        if joint in self._turned:
            return self._turned[joint]
        if parent in self._turned:
            return self._turned[parent] @ self._local_BJ33[:, joint - 1]
        return self._global_BJ33[:, joint]

    def turn(self, joint: int, turn_B33: Tensor) -> None:
        """Turns a joint by rotations (B, 3, 3) in the pelvis's frame."""
        self._turned[joint] = turn_B33 @ self.of(joint)

    def local(self) -> Tensor:
        """Local rotations (B, 21, 3, 3)."""
        found = self._local_BJ33.clone()
        for joint, turned in self._turned.items():
            found[:, joint - 1] = self.of(PARENTS[joint]).mT @ turned
        return found


def _shortest_turn(start_B3: Tensor, end_B3: Tensor) -> Tensor:
    """The smallest rotations (B, 3, 3) between unit vectors; none if they are opposite, where no axis is told."""
    axis_B3 = torch.linalg.cross(start_B3, end_B3)
    sine_B1 = axis_B3.norm(dim=-1, keepdim=True)
    angle_B1 = torch.atan2(sine_B1, (start_B3 * end_B3).sum(-1, keepdim=True))
    return rotation.axis_angle_to_matrix(axis_B3 * (angle_B1 / sine_B1.clamp_min(1e-9)))
