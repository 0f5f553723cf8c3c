"""The outline of a robot: balls (`mrhubo.robot.balls`) of its collision shapes and its joint centres, and where they
are in poses of it. What lies on the floor, when it kneels, crawls or falls, are they.

Legend: B poses, K balls, A driven joints, L bodies: the base, and the child of each driven joint.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from mrhubo.robot.balls import balls_of, outermost, placed
from mrhubo.robot.body_map import BodyMap
from mrhubo.robot.model import LinkPoses
from mrhubo.robot.urdf import link_poses

_MOST = 128
"""Most balls of the shapes of one body; of more those count that are farthest out."""


class Outline(nn.Module):
    """The balls of one robot, on the robot's device."""

    centre_K3: Tensor
    radius_K: Tensor
    above_KA: Tensor
    """1 where a driven joint moves a ball against the base."""
    body_K: Tensor

    def __init__(self, body_map: BodyMap, with_shapes: bool = True) -> None:
        """Reads collision shapes, meshes among them; without, there are the joint centres alone."""
        super().__init__()
        self.body_map, self.robot = body_map, body_map.robot
        description = self.robot.description
        joints = [description.joints[name] for name in self.robot.driven_joints]
        bodies = [description.root, *(joint.child for joint in joints)]
        self.bodies = tuple(bodies)
        """Links, of which one carries each ball: `body_K` is which."""
        self._rows = [self.robot.link_index(joint.child) for joint in joints]
        rest = link_poses(description.parsed, self.robot.configuration(self.robot.home().cpu().numpy()))

        def body_of(link: str) -> str:
            above = (joint.child for joint in description.joints_above(link) if joint.name in self.robot.driven_joints)
            return next(above, description.root)

        def in_body(link: str, balls_K4: np.ndarray) -> tuple[int, np.ndarray]:
            body = body_of(link)
            return bodies.index(body), placed(balls_K4, np.linalg.inv(rest[body]) @ rest[link])

        points = body_map.keypoints.points.values()
        found = [in_body(point.link, np.array([[*point.offset_3, 0.0]])) for point in points]
        solid: dict[int, list[np.ndarray]] = {}
        for shape in description.solids.shapes if with_shapes else ():
            body, balls_K4 = in_body(shape.link, placed(balls_of(shape), shape.origin_44))
            solid.setdefault(body, []).append(balls_K4)
        for body, several in solid.items():
            balls_K4 = np.concatenate(several)
            found.append((body, balls_K4 if len(balls_K4) <= _MOST else outermost(balls_K4, _MOST)))
        ball_K4 = np.concatenate([balls_K4 for _, balls_K4 in found])
        body_K = [body for body, balls_K4 in found for _ in balls_K4]
        above = [{joint.name for joint in description.joints_above(body)} for body in bodies]
        above_LA = torch.tensor([[float(joint.name in names) for joint in joints] for names in above])
        tensors = {
            "centre_K3": torch.tensor(ball_K4[:, :3].tolist()),
            "radius_K": torch.tensor(ball_K4[:, 3].tolist()),
            "body_K": torch.tensor(body_K, dtype=torch.long),
            "above_KA": above_LA.reshape(len(bodies), -1)[body_K],
        }
        for name, tensor in tensors.items():
            self.register_buffer(name, tensor.to(self.robot.lower_N.device), persistent=False)

    def moving(self, link: str) -> Tensor:
        """1 where a driven joint moves a link against the base (A,)."""
        names = {joint.name for joint in self.robot.description.joints_above(link)}
        return self.above_KA.new_tensor([float(name in names) for name in self.robot.driven_joints])

    def moved_against(self, link: str) -> Tensor:
        """1 where a driven joint moves a ball against a link, -1 where it moves that against the ball (K, A)."""
        return self.above_KA - self.moving(link)

    def places(self, poses: LinkPoses) -> Tensor:
        """Centres (B, K, 3) [m] in the base frame."""
        eye_B133 = torch.eye(3).to(poses.position_BL3).expand(len(poses.position_BL3), 1, 3, 3)
        rotation_BL33 = torch.cat((eye_B133, poses.rotation_BL33[:, self._rows]), dim=1)
        position_BL3 = torch.cat((0 * eye_B133[..., 0], poses.position_BL3[:, self._rows]), dim=1)
        turned_BK3 = (rotation_BL33[:, self.body_K] @ self.centre_K3[..., None])[..., 0]
        return position_BL3[:, self.body_K] + turned_BK3
