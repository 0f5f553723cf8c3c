"""Turns a human's limbs, hands, feet and head until they point exactly where the robot's do.

Latent inverse kinematics ends where prior and keypoints balance: a pose of Reachy's misses its head by 12 degrees and
its hands by 14 to 24, and a network trained on that turns robots' heads and hands too far. What is left of the way is
gone here, by the smallest turn of each joint, from the trunk outwards; the rest of the pose stays.

Legend: B batch, D directions, J = 21 human joints.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, PARENTS, ancestors
from mrhubo.robot.bending import bend_axis
from mrhubo.robot.body_map import BodyMap
from mrhubo.robot.parts import BendPart, LimbPart, OrientedPart
from mrhubo.robot.root_turn import is_turned_back

_ROOT = "root"
"""What sees legs where the base is not turned as the person's pelvis."""


def align_pose(body_map: BodyMap, local_BJ33: Tensor, direction_BD3: Tensor, hinged: bool = False) -> Tensor:
    """Local rotations (B, 21, 3, 3) of the poses whose `BodyMap.human_directions` are the given ones.

    A limb turns about the axis across its old and new direction, so that no twist is added; then, if the robot has a
    bend axis, about itself, until its own axis is where that and the limb that bends have it. An oriented part turns at
    its joint; joints that share its turn (neck and head) do so in equal parts.

    Args:
        body_map: the robot's body map.
        local_BJ33: local rotations (B, 21, 3, 3) of the poses to start from.
        direction_BD3: directions (B, D, 3), as of `BodyMap.robot_directions` or `BodyMap.human_directions`.
        hinged: let limbs bend about a human's axes also where the robot has no such axis. A pose is read so, and then
            legs hang on the robot's root as it is turned, whatever `robot.root_follows` says.
    """
    pose = _Pose(local_BJ33, body_map.skeleton.global_rotations(local_BJ33))
    rest_K3 = body_map.skeleton.rest_K3
    column = {name: i for i, name in enumerate(body_map.direction_names)}
    view_joint = {part.name: JOINT_NAMES.index(part.joint) for part in body_map.keypoints.parts}
    root_turn = None if hinged else body_map.shared.root_turn
    from_pelvis: dict[str, Tensor] = {}
    """All directions, by the part from which they are seen: a part is turned before others are seen from it."""
    for part in body_map.keypoints.parts:
        there = set(part.direction_names) <= column.keys()
        if not part.seen_from or not (there or (hinged and isinstance(part, BendPart))):
            continue
        view = _ROOT if root_turn is not None and is_turned_back(part) else part.seen_from
        if view not in from_pelvis:
            turn_B33 = pose.of(view_joint[part.seen_from])
            if root_turn is not None and view == _ROOT:
                turn_B33 = turn_B33 @ root_turn(pose.local())
            from_pelvis[view] = direction_BD3 @ turn_B33.mT
        wanted = [from_pelvis[view][:, column[name]] for name in part.direction_names if there]
        joint = JOINT_NAMES.index(part.joint)
        if isinstance(part, LimbPart):
            start, end = (KEYPOINT_NAMES.index(name) for name in (part.start, part.end))
            bone_3 = torch.nn.functional.normalize(rest_K3[end] - rest_K3[start], dim=0)
            pose.turn(joint, rotation.shortest_turn(pose.of(joint) @ bone_3, wanted[0]))
        elif isinstance(part, BendPart):
            limbs = (limb.direction_names[0] for limb in body_map.keypoints.parts if limb.name in part.limbs)
            upper, lower = (from_pelvis[view][:, column[name]] for name in limbs)
            own_B3 = pose.of(joint) @ pose.of(joint).new_tensor(part.rest)
            axis_B3 = bend_axis(upper, lower, wanted[0] if there else own_B3)[0]
            pose.turn(joint, _turn_about(upper, own_B3, axis_B3))
        elif isinstance(part, OrientedPart):
            orientation_B33 = part.turn(*wanted)
            for shares, name in zip(range(len(part.turned_by), 1, -1), part.turned_by, strict=False):
                missing = rotation.matrix_to_axis_angle(orientation_B33 @ pose.of(joint).mT)
                pose.turn(JOINT_NAMES.index(name), rotation.axis_angle_to_matrix(missing / shares))
            pose.turn(joint, orientation_B33 @ pose.of(joint).mT)
    return pose.local()


class _Pose:
    """Poses whose joints are turned one after the other, inner ones first; what hangs on a joint turns with it."""

    def __init__(self, local_BJ33: Tensor, global_BJ33: Tensor) -> None:
        self._local_BJ33, self._global_BJ33 = local_BJ33, global_BJ33
        self._turned: dict[int, Tensor] = {}

    def of(self, joint: int) -> Tensor:
        """A joint's rotation (B, 3, 3) relative to the pelvis."""
        if joint in self._turned:
            return self._turned[joint]
        if joint > 0 and self._moved(PARENTS[joint]):
            return self.of(PARENTS[joint]) @ self._local_BJ33[:, joint - 1]
        return self._global_BJ33[:, joint]

    def _moved(self, joint: int) -> bool:
        return any(above in self._turned for above in ancestors(joint))

    def turn(self, joint: int, turn_B33: Tensor) -> None:
        """Turns a joint by rotations (B, 3, 3) in the pelvis's frame."""
        self._turned[joint] = turn_B33 @ self.of(joint)

    def local(self) -> Tensor:
        """Local rotations (B, 21, 3, 3)."""
        found = self._local_BJ33.clone()
        for joint, turned in self._turned.items():
            found[:, joint - 1] = self.of(PARENTS[joint]).mT @ turned
        return found


def _turn_about(axis_B3: Tensor, start_B3: Tensor, end_B3: Tensor) -> Tensor:
    """Rotations (B, 3, 3) about unit axes that take the half-plane of one vector to that of another; none where a
    vector is 0 or along the axis.
    """
    sine_B = (axis_B3 * torch.linalg.cross(start_B3, end_B3)).sum(-1)
    along_B = (start_B3 * axis_B3).sum(-1) * (end_B3 * axis_B3).sum(-1)
    cosine_B = (start_B3 * end_B3).sum(-1) - along_B
    return rotation.axis_angle_to_matrix(axis_B3 * torch.atan2(sine_B, cosine_B)[:, None])
