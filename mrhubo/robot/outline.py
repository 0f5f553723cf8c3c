"""The outline of a robot: balls (`mrhubo.robot.balls`) of its collision shapes and its joint centres, and where they
are in poses of it. What lies on the floor, when it kneels, crawls or falls, are they.

Legend: B poses, K balls, A driven joints.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from mrhubo.robot.balls import balls_of, outermost, placed
from mrhubo.robot.body_map import BodyMap
from mrhubo.robot.driven_bodies import DrivenBodies
from mrhubo.robot.model import LinkPoses

_MOST = 128
"""Most balls of the shapes of one body; of more those count that are farthest out."""


class Outline(nn.Module):
    """The balls of one robot, on the robot's device."""

    centre_K3: Tensor
    radius_K: Tensor
    above_KA: Tensor
    """1 where a driven joint moves a ball against the base."""
    body_K: Tensor
    """Which of `bodies` carries each ball."""

    def __init__(self, body_map: BodyMap, with_shapes: bool = True) -> None:
        """Reads collision shapes, meshes among them; without, there are the joint centres alone."""
        super().__init__()
        self.body_map, self.robot = body_map, body_map.robot
        self.bodies = DrivenBodies(self.robot)

        def in_body(link: str, balls_K4: np.ndarray) -> tuple[int, np.ndarray]:
            return self.bodies.number(link), placed(balls_K4, self.bodies.inside(link))

        points = body_map.keypoints.points.values()
        found = [in_body(point.link, np.array([[*point.offset_3, 0.0]])) for point in points]
        solid: dict[int, list[np.ndarray]] = {}
        for shape in self.robot.description.solids.shapes if with_shapes else ():
            body, balls_K4 = in_body(shape.link, placed(balls_of(shape), shape.origin_44))
            solid.setdefault(body, []).append(balls_K4)
        for body, several in solid.items():
            balls_K4 = np.concatenate(several)
            found.append((body, balls_K4 if len(balls_K4) <= _MOST else outermost(balls_K4, _MOST)))
        ball_K4 = np.concatenate([balls_K4 for _, balls_K4 in found])
        body_K = [body for body, balls_K4 in found for _ in balls_K4]
        tensors = {
            "centre_K3": torch.tensor(ball_K4[:, :3].tolist()),
            "radius_K": torch.tensor(ball_K4[:, 3].tolist()),
            "body_K": torch.tensor(body_K, dtype=torch.long),
            "above_KA": self.bodies.above_LA[body_K],
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
        rotation_BL33, position_BL3 = self.bodies.place(poses)
        turned_BK3 = (rotation_BL33[:, self.body_K] @ self.centre_K3[..., None])[..., 0]
        return position_BL3[:, self.body_K] + turned_BK3
