"""Self-collision of a robot: signed distances between the capsules of its links, and how they change with the joints.

The shapes are those of the URDF's collision elements, each inside one or more capsules: a sphere and a cylinder with
round ends are capsules, a flat-ended cylinder gets round ends, a box becomes capsules side by side. Meshes are not
read; `uncovered` names the links that have nothing else.

Links that the sampled joints do not move against each other are one body. Two bodies that share a joint cannot be kept
apart, so they are not compared; nor are two of which some capsules overlap in more than half of all random poses (an
upper arm and a forearm with an axis of its own between the two, both of which reach around the elbow).

Legend: B batch, C capsules, P pairs of them, X pairs in some pose, A driven joints, N joints of q, L bodies.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, fields

import numpy as np
import torch
from torch import Tensor, nn

from mrhubo.robot.model import LinkPoses, Robot
from mrhubo.robot.shapes import LinkGeometry, read_collision_geometry
from mrhubo.robot.urdf import link_poses

_SAMPLES = 2_000
_ALWAYS = 0.5
_SHORT = 1e-9
_SLACK = 1e-3
_CHUNK = 1024


@dataclass(frozen=True)
class Contacts:
    """Pairs of capsules that are near each other, one entry each (X)."""

    row_X: Tensor
    """Which of the B poses."""
    pair_X: Tensor
    """Which of `SelfCollision.pairs`."""
    distance_X: Tensor
    """Signed distance of the surfaces [m]; negative where they overlap."""
    jacobian_XN: Tensor
    """Its derivative by the joint angles [m/rad].

    The closest points may slide along the capsules without changing the distance to first order, so only the motion of
    the bodies counts: with the normal n at the contact c, a joint with the axis a through o changes the distance by
    n . (a x (c - o)) = (c x n) . a - n . (a x o).
    """


class SelfCollision(nn.Module):
    """Capsule pairs of one robot, on the robot's device."""

    _children_A: Tensor
    _axes_A3: Tensor
    _rotary_A: Tensor
    _above_LA: Tensor
    _body_C: Tensor
    _ends_C23: Tensor
    _radius_C: Tensor
    _reach_C: Tensor
    _pair_2P: Tensor

    def __init__(self, robot: Robot) -> None:
        """Takes the collision geometry of the URDF that the robot was read from."""
        super().__init__()
        self.robot = robot
        joints = [robot.description.joints[name] for name in robot.driven_joints]
        self._bodies = [robot.description.root, *(joint.child for joint in joints)]
        above = [{joint.name for joint in robot.description.joints_above(link)} for link in self._bodies]
        self._keep("_children_A", torch.tensor([robot.link_index(joint.child) for joint in joints]))
        self._keep("_axes_A3", torch.tensor(np.array([joint.axis_3 for joint in joints]), dtype=torch.float32))
        self._keep("_rotary_A", torch.tensor([float(joint.rotary) for joint in joints]))
        self._keep("_above_LA", torch.tensor([[float(j.name in names) for j in joints] for names in above]))
        self._read_capsules()
        self._choose_pairs({frozenset((joint.child, self._body(joint.parent))) for joint in joints})

    def _keep(self, name: str, tensor: Tensor) -> None:
        """A constant, where the robot is."""
        self.register_buffer(name, tensor.to(self.robot.lower_N.device), persistent=False)

    def _body(self, link: str) -> str:
        """The link that stands for all that move with this one."""
        above = self.robot.description.joints_above(link)
        found = (joint.child for joint in above if joint.name in self.robot.driven_joints)
        return next(found, self.robot.description.root)

    def _read_capsules(self) -> None:
        urdf = self.robot.description.parsed
        shapes = read_collision_geometry(urdf)
        shaped = {shape.link for shape in shapes}
        self.uncovered = tuple(x.name for x in urdf.robot.links if x.collisions and x.name not in shaped)
        """Links whose collision geometry is of meshes alone, which are not looked at."""
        rest = link_poses(urdf, self.robot.configuration(self.robot.home().cpu().numpy()))
        self._links: list[str] = []
        ends, radii = [], []
        for shape in shapes:
            pose_44 = np.linalg.inv(rest[self._body(shape.link)]) @ rest[shape.link] @ shape.origin_44
            for start_3, end_3, radius in _capsules(shape, pose_44):
                self._links.append(shape.link)
                ends.append((start_3, end_3))
                radii.append(radius)
        body_C = [self._bodies.index(self._body(link)) for link in self._links]
        self._keep("_body_C", torch.tensor(body_C, dtype=torch.long))
        self._keep("_ends_C23", torch.tensor(np.array(ends, dtype=np.float32).reshape(-1, 2, 3)))
        self._keep("_radius_C", torch.tensor(radii, dtype=torch.float32))
        self._keep("_reach_C", (self._ends_C23[:, 1] - self._ends_C23[:, 0]).norm(dim=-1) / 2 + self._radius_C)

    def _choose_pairs(self, neighbours: set[frozenset[str]]) -> None:
        """All pairs of capsules of different bodies that can be kept apart; `neighbours` share a joint."""
        bodies = [self._bodies[i] for i in self._body_C.tolist()]
        every = [(i, j) for i, j in itertools.combinations(range(len(bodies)), 2) if bodies[i] != bodies[j]]
        both = [frozenset((bodies[i], bodies[j])) for i, j in every]

        def keep(wanted: list[bool]) -> Tensor:
            chosen = [pair for pair, good in zip(every, wanted, strict=True) if good]
            return torch.tensor(chosen, dtype=torch.long, device=self._body_C.device).reshape(-1, 2).T.contiguous()

        self._keep("_pair_2P", keep([names not in neighbours for names in both]))
        near = self.near(self.robot.sample(_SAMPLES, torch.Generator().manual_seed(0)), 0.0)
        often_P = torch.bincount(near.pair_X, minlength=self._pair_2P.shape[1]) > _ALWAYS * _SAMPLES
        first = self._pair_2P[:, often_P].T.tolist()
        inseparable = {frozenset((bodies[i], bodies[j])) for i, j in first}
        self._pair_2P = keep([names not in neighbours | inseparable for names in both])

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """The links (a, b) of each pair."""
        return tuple((self._links[i], self._links[j]) for i, j in self._pair_2P.T.tolist())

    def collides(self, q_BN: Tensor, poses: LinkPoses | None = None) -> Tensor:
        """Whether any pair overlaps (B,), at joint angles (B, N) [rad]; `poses` as for `near`."""
        found_B = torch.zeros(len(q_BN), dtype=torch.bool, device=q_BN.device)
        found_B[self.near(q_BN, 0.0, poses).row_X] = True
        return found_B

    def near(self, q_BN: Tensor, margin: float, poses: LinkPoses | None = None) -> Contacts:
        """The pairs that are closer than `margin` [m] at joint angles (B, N) [rad].

        `poses` are what `Robot.forward` gives for these angles, if they are there already.
        """
        parts = []
        for first in range(0, max(1, len(q_BN)), _CHUNK):
            part = self._near(self._poses(q_BN, poses, slice(first, first + _CHUNK)), margin)
            parts.append(Contacts(part.row_X + first, *(getattr(part, f.name) for f in fields(Contacts)[1:])))
        return Contacts(*(torch.cat([getattr(part, f.name) for part in parts]) for f in fields(Contacts)))

    def _poses(self, q_BN: Tensor, poses: LinkPoses | None, rows: slice) -> LinkPoses:
        if poses is None:
            return self.robot.forward(q_BN[rows])
        return LinkPoses(poses.rotation_BL33[rows], poses.position_BL3[rows])

    def _near(self, poses: LinkPoses, margin: float) -> Contacts:
        rotation_BA33 = poses.rotation_BL33.index_select(1, self._children_A)
        position_BA3 = poses.position_BL3.index_select(1, self._children_A)
        eye_B133 = torch.eye(3, dtype=position_BA3.dtype, device=position_BA3.device).expand(len(position_BA3), 1, 3, 3)
        rotation_BL33 = torch.cat((eye_B133, rotation_BA33), dim=1)
        position_BL3 = torch.cat((eye_B133[..., 0] * 0, position_BA3), dim=1)
        ends_BC23 = self._ends_C23 @ rotation_BL33[:, self._body_C].mT + position_BL3[:, self._body_C, None]
        # The spheres around the capsules tell cheaply which pairs need a closer look.
        i_P, j_P = self._pair_2P
        centre_BC3 = ends_BC23.mean(dim=2)
        apart_BP = torch.cdist(centre_BC3, centre_BC3).flatten(1)[:, i_P * len(self._links) + j_P]
        row_X, pair_X = torch.nonzero(apart_BP < self._reach_C[i_P] + self._reach_C[j_P] + margin + _SLACK).T
        i_X, j_X = self._pair_2P[:, pair_X]
        point_X3, other_X3 = closest_points(ends_BC23[row_X, i_X], ends_BC23[row_X, j_X])
        apart_X3 = point_X3 - other_X3
        length_X = apart_X3.norm(dim=-1)
        distance_X = length_X - self._radius_C[i_X] - self._radius_C[j_X]
        x = torch.nonzero(distance_X < margin)[:, 0]
        row_X, normal_X3 = row_X[x], apart_X3[x] / length_X[x, None].clamp_min(_SHORT)
        axis_XA3 = ((rotation_BL33[:, 1:] @ self._axes_A3[..., None])[..., 0])[row_X]
        lever_XA3 = torch.linalg.cross(axis_XA3, position_BL3[:, 1:][row_X])
        moment_X31 = torch.linalg.cross(point_X3[x], normal_X3)[..., None]
        turn_XA = (axis_XA3 @ moment_X31 - lever_XA3 @ normal_X3[..., None])[..., 0]
        slide_XA = (axis_XA3 @ normal_X3[..., None])[..., 0]
        sign_XA = self._above_LA[self._body_C[i_X[x]]] - self._above_LA[self._body_C[j_X[x]]]
        moved_XA = torch.where(self._rotary_A > 0, turn_XA, slide_XA) * sign_XA
        return Contacts(row_X, pair_X[x], distance_X[x], moved_XA @ self.robot.drive_DN)


def closest_points(a_23: Tensor, b_23: Tensor) -> tuple[Tensor, Tensor]:
    """The points (..., 3) where segments a and b (..., 2, 3) are nearest; a segment may be a point.

    C. Ericson, Real-Time Collision Detection (2005), section 5.1.9, without branches.
    """
    start_a, start_b = a_23[..., 0, :], b_23[..., 0, :]
    along_a, along_b, r = a_23[..., 1, :] - start_a, b_23[..., 1, :] - start_b, start_a - start_b
    a, e, b = along_a.square().sum(-1), along_b.square().sum(-1), (along_a * along_b).sum(-1)
    c, f = (along_a * r).sum(-1), (along_b * r).sum(-1)
    safe_a, safe_e = a.clamp_min(_SHORT), e.clamp_min(_SHORT)
    # Nearly parallel segments have no one answer; any point of a will do, the other end follows from it.
    determinant = a * e - b * b
    s = torch.where(determinant > 1e-7 * a * e, (b * f - c * e) / determinant.clamp_min(_SHORT * _SHORT), 0.0)
    t = ((b * s.clamp(0, 1) + f) / safe_e).clamp(0, 1)
    s = ((b * t - c) / safe_a).clamp(0, 1)
    t = ((b * s + f) / safe_e).clamp(0, 1)
    return start_a + s[..., None] * along_a, start_b + t[..., None] * along_b


def _capsules(shape: LinkGeometry, pose_44: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Capsules (start (3,), end (3,), radius) around a shape whose centre is at the pose."""
    centre_3, axes_33 = pose_44[:3, 3], pose_44[:3, :3]
    if shape.kind != "box":
        half_3 = 0.5 * (shape.size[1] if len(shape.size) == 2 else 0.0) * axes_33[:, 2]
        return [(centre_3 - half_3, centre_3 + half_3, shape.size[0])]
    thin, wide, long = np.argsort(shape.size)
    count = max(1, math.ceil(shape.size[wide] / max(shape.size[thin], 0.1 * shape.size[wide])))
    step = shape.size[wide] / count
    radius = 0.5 * math.hypot(shape.size[thin], step)
    half_3 = max(0.0, 0.5 * shape.size[long]) * axes_33[:, long]
    centres = [centre_3 + ((k + 0.5) * step - 0.5 * shape.size[wide]) * axes_33[:, wide] for k in range(count)]
    return [(centre - half_3, centre + half_3, radius) for centre in centres]
