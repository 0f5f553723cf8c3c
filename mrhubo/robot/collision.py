"""Self-collision of a robot: signed distances between the capsules of its links, and how they change with the joints.

The shapes are those of the URDF's collision elements: a sphere and a cylinder with round ends are capsules, and one to
three capsules hug a flat-ended cylinder or a box (`mrhubo.robot.capsules`), up to four the hull of a mesh
(`mrhubo.robot.hulls`). `uncovered` names the links of which a mesh is not there, and `unknown` those of them for which
nobody knows whether the robot touches itself.

Links that the sampled joints do not move against each other are one body. Two bodies that share a joint cannot be kept
apart, so they are not compared; nor are two of which some capsules overlap in more than half of all random poses (an
upper arm and a forearm with an axis of its own between the two, both of which reach around the elbow), or nearly do
where they stand for a mesh, whose hull fills what is hollow: one that reaches into it is always near. Nor are two
capsules that overlap in the robot's home pose: whoever made it means them to, as a shoulder in the hollow of a trunk
whose hull is closed (MoveIt's setup assistant leaves out the same, as "collision by default").

Pairs grow with the square of the capsules. So poses are looked at few at a time where there are many pairs, and of more
than two thousand capsules the links with most are left out.

Legend: B batch, C capsules, P pairs of them, X pairs in some pose, A driven joints, N joints of q, L bodies.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
import torch
from torch import Tensor, nn

from mrhubo.robot.capsules import SHORT, closest_points
from mrhubo.robot.driven_bodies import DrivenBodies
from mrhubo.robot.link_capsules import link_capsules
from mrhubo.robot.model import LinkPoses, Robot

_SAMPLES = 2_000
_FEW_SAMPLES = 100
_ALWAYS = 0.5
_NEARLY = 0.004
"""How near capsules of a mesh count as overlapping in random poses, as a share of the robot: 6 mm of a human's."""
_SLACK = 1e-3
_CHUNK = 1024
"""Most poses at a time."""
_AT_ONCE = 2**24
"""Most pairs of capsules, over all poses, whose rough distance is in memory; a sixteenth of them with what is exact."""
_MOST_LISTED = 5


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


@dataclass(frozen=True)
class _Placed:
    """Bodies and capsules in the base frame."""

    rotation_BL33: Tensor
    position_BL3: Tensor
    ends_BC23: Tensor


@dataclass(frozen=True)
class _Close:
    """Contacts, with the point on the first capsule's axis [m] and the direction to it from the second's."""

    row_X: Tensor
    pair_X: Tensor
    distance_X: Tensor
    point_X3: Tensor
    normal_X3: Tensor


class SelfCollision(nn.Module):
    """Capsule pairs of one robot, on the robot's device."""

    _axes_A3: Tensor
    _rotary_A: Tensor
    _body_C: Tensor
    _ends_C23: Tensor
    _radius_C: Tensor
    _reach_C: Tensor
    _pair_2P: Tensor
    _reach_CC: Tensor
    _pair_CC: Tensor

    def __init__(self, robot: Robot) -> None:
        """Takes the collision geometry of the URDF that the robot was read from."""
        super().__init__()
        self.robot = robot
        joints = [robot.description.joints[name] for name in robot.driven_joints]
        self._bodies = DrivenBodies(robot)
        self._keep("_axes_A3", torch.tensor(np.array([joint.axis_3 for joint in joints]), dtype=torch.float32))
        self._keep("_rotary_A", torch.tensor([float(joint.rotary) for joint in joints]))
        self._read_capsules()
        self._choose_pairs({frozenset((self._bodies.number(j.child), self._bodies.number(j.parent))) for j in joints})

    def _keep(self, name: str, tensor: Tensor) -> None:
        """A constant, where the robot is."""
        self.register_buffer(name, tensor.to(self.robot.lower_N.device), persistent=False)

    def _read_capsules(self) -> None:
        urdf = self.robot.description.parsed
        solids, found = self.robot.description.solids, link_capsules(self.robot, self._bodies)
        unread = self.robot.description.unread_collisions
        solid = (link.name for link in urdf.robot.links if link.collisions or link.name in unread)
        self.uncovered = tuple(name for name in solid if name not in found or name in solids.gaps)
        """Links of which something is not looked at: a mesh that is not there, what cannot be read, or is too much."""
        joints = [self.robot.description.joints[name] for name in self.robot.driven_joints]
        carrying = {joint.parent for joint in joints}
        moved = {name for name in self.uncovered if self._bodies.number(name)}
        self.unknown = tuple(name for name in self.uncovered if name in moved | carrying)
        """Those of `uncovered` that move, or carry what moves: whether they touch anything is not known."""
        self._links = [link for link, some in found.items() for _ in some]
        ends = [(start_3, end_3) for some in found.values() for start_3, end_3, _ in some]
        radii = [radius for some in found.values() for _, _, radius in some]
        body_C = [self._bodies.number(link) for link in self._links]
        self._keep("_body_C", torch.tensor(body_C, dtype=torch.long))
        self._keep("_ends_C23", torch.tensor(np.array(ends, dtype=np.float32).reshape(-1, 2, 3)))
        self._keep("_radius_C", torch.tensor(radii, dtype=torch.float32))
        self._keep("_reach_C", (self._ends_C23[:, 1] - self._ends_C23[:, 0]).norm(dim=-1) / 2 + self._radius_C)

    def _choose_pairs(self, neighbours: set[frozenset[int]]) -> None:
        """All pairs of capsules of different bodies that can be kept apart; `neighbours` share a joint."""
        count = len(self._bodies.links)
        apart_LL = ~torch.eye(count, dtype=torch.bool)
        for i, j in neighbours:
            apart_LL[i, j] = apart_LL[j, i] = False
        body_C = self._body_C.cpu()
        every_2P = torch.triu_indices(len(body_C), len(body_C), offset=1)
        self._keep_pairs(every_2P[:, apart_LL[body_C[every_2P[0]], body_C[every_2P[1]]]])
        often_P = self._often_near(self.robot.sample(self._samples(), torch.Generator().manual_seed(0)))
        for i, j in body_C[self._pair_2P[:, often_P].cpu()].T.unique(dim=0).tolist():
            apart_LL[i, j] = apart_LL[j, i] = False
        pair_2P = self._pair_2P.cpu()
        self._keep_pairs(pair_2P[:, apart_LL[body_C[pair_2P[0]], body_C[pair_2P[1]]]])
        meant_P = torch.ones(self._pair_2P.shape[1], dtype=torch.bool)
        meant_P[self.near(self.robot.home()[None], 0.0).pair_X.cpu()] = False
        self._keep_pairs(self._pair_2P.cpu()[:, meant_P])

    def _keep_pairs(self, pair_2P: Tensor) -> None:
        """The pairs in their order, how near two centres must be for a closer look, and which pair two capsules are."""
        reach_C = self._reach_C.cpu()
        count, (i_P, j_P) = len(reach_C), pair_2P
        reach_CC, pair_CC = torch.full((count, count), -torch.inf), torch.zeros(count, count, dtype=torch.int32)
        reach_CC[i_P, j_P] = reach_C[i_P] + reach_C[j_P]
        pair_CC[i_P, j_P] = torch.arange(len(i_P), dtype=torch.int32)
        self._keep("_pair_2P", pair_2P)
        self._keep("_reach_CC", reach_CC)
        self._keep("_pair_CC", pair_CC)

    def _samples(self) -> int:
        """Random poses that tell which bodies always overlap: fewer where there are very many pairs."""
        return max(_FEW_SAMPLES, min(_SAMPLES, _AT_ONCE // max(1, self._pair_2P.shape[1])))

    def _often_near(self, q_BN: Tensor) -> Tensor:
        """Which pairs overlap in more than half of the poses, or nearly do where one of them stands for a mesh."""
        hulls = {shape.link for shape in self.robot.description.solids.of_meshes}
        of_mesh_C = torch.tensor([link in hulls for link in self._links], device=self._body_C.device, dtype=torch.bool)
        centre_C3 = self._place(self.robot.forward(self.robot.home()[None])).ends_BC23[0].mean(dim=1)
        size = float((centre_C3.amax(0) - centre_C3.amin(0)).norm()) if len(centre_C3) else 0.0
        near_P = of_mesh_C[self._pair_2P].any(dim=0) * (_NEARLY * size)
        near = float(near_P.max()) if len(near_P) else 0.0
        count_P = torch.zeros(self._pair_2P.shape[1], dtype=torch.long, device=self._body_C.device)
        for rows in self._chunks(len(q_BN)):
            close = self._closer(self._place(self._poses(q_BN, None, rows)), near)
            pair_X = close.pair_X[close.distance_X < near_P[close.pair_X]]
            count_P += torch.bincount(pair_X, minlength=len(count_P))
        return count_P > _ALWAYS * len(q_BN)

    @property
    def known(self) -> bool:
        """Whether it is known if the robot touches itself: of what moves no shape is missing, and some could meet."""
        return bool(self._pair_2P.shape[1]) and not self.unknown

    def why_unknown(self) -> str | None:
        """A sentence where it is not known whether the robot touches itself, for want of shapes; else none."""
        start = f"robot.urdf: {self.robot.urdf}: whether the robot touches itself is unknown"
        if self.unknown:
            listed = ", ".join(self.unknown[:_MOST_LISTED]) + (", ..." if len(self.unknown) > _MOST_LISTED else "")
            return f"{start}: collision meshes of {len(self.unknown)} links are not there, or cannot be read: {listed}"
        return None if self.known else f"{start}: it has no collision shapes that could meet"

    def touches(self, q_BN: Tensor, poses: LinkPoses | None = None) -> Tensor | None:
        """`collides`, where that is known; else None."""
        return self.collides(q_BN, poses) if self.known else None

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """The links (a, b) of each pair."""
        return tuple((self._links[i], self._links[j]) for i, j in self._pair_2P.T.tolist())

    def clearance(self, most: float) -> Tensor:
        """The distance [m] that each pair is to keep (P,): `most`, or what it has in the robot's home pose, if that is
        less. So no pair is asked to be further apart than whoever made the robot has it at home, and shapes that
        overlap there (a cover around the next link) are not fought.
        """
        home = self.near(self.robot.home()[None], most)
        return self._reach_C.new_full((self._pair_2P.shape[1],), most).index_copy(0, home.pair_X, home.distance_X)

    def collides(self, q_BN: Tensor, poses: LinkPoses | None = None) -> Tensor:
        """Whether any pair overlaps (B,), at joint angles (B, N) [rad]; `poses` as for `near`."""
        found_B = torch.zeros(len(q_BN), dtype=torch.bool, device=q_BN.device)
        for rows in self._chunks(len(q_BN)):
            close = self._closer(self._place(self._poses(q_BN, poses, rows)), 0.0)
            found_B[rows.start + close.row_X] = True
        return found_B

    def near(self, q_BN: Tensor, margin: float, poses: LinkPoses | None = None) -> Contacts:
        """The pairs that are closer than `margin` [m] at joint angles (B, N) [rad].

        `poses` are what `Robot.forward` gives for these angles, if they are there already.
        """
        parts = []
        for rows in self._chunks(len(q_BN)):
            part = self._near(self._poses(q_BN, poses, rows), margin)
            parts.append(Contacts(part.row_X + rows.start, *(getattr(part, f.name) for f in fields(Contacts)[1:])))
        return Contacts(*(torch.cat([getattr(part, f.name) for part in parts]) for f in fields(Contacts)))

    def _chunks(self, poses: int) -> Iterator[slice]:
        """Poses that are looked at together; at least one chunk, which may be empty."""
        size = max(1, min(_CHUNK, _AT_ONCE // max(1, len(self._links) ** 2)))
        return (slice(first, first + size) for first in range(0, max(1, poses), size))

    def _poses(self, q_BN: Tensor, poses: LinkPoses | None, rows: slice) -> LinkPoses:
        if poses is None:
            return self.robot.forward(q_BN[rows])
        return LinkPoses(poses.rotation_BL33[rows], poses.position_BL3[rows])

    def _place(self, poses: LinkPoses) -> _Placed:
        """Bodies and capsules where the links are."""
        rotation_BL33, position_BL3 = self._bodies.place(poses)
        ends_BC23 = self._ends_C23 @ rotation_BL33[:, self._body_C].mT + position_BL3[:, self._body_C, None]
        return _Placed(rotation_BL33, position_BL3, ends_BC23)

    def _closer(self, placed: _Placed, margin: float) -> _Close:
        """The pairs that are closer than `margin` [m]."""
        if not self._pair_2P.shape[1]:
            none_X = self._body_C[:0]
            return self._exactly(placed, none_X, none_X, margin)
        # The spheres around the capsules tell cheaply which pairs need a closer look.
        centre_BC3 = placed.ends_BC23.mean(dim=2)
        apart_BCC = torch.cdist(centre_BC3, centre_BC3)
        row_X, i_X, j_X = torch.nonzero(apart_BCC < self._reach_CC + margin + _SLACK).T
        pair_X = self._pair_CC[i_X, j_X].long()
        blocks = zip(row_X.split(_AT_ONCE // 16), pair_X.split(_AT_ONCE // 16), strict=True)
        parts = [self._exactly(placed, row_Y, pair_Y, margin) for row_Y, pair_Y in blocks]
        return _Close(*(torch.cat([getattr(part, f.name) for part in parts]) for f in fields(_Close)))

    def _exactly(self, placed: _Placed, row_X: Tensor, pair_X: Tensor, margin: float) -> _Close:
        """Those of some pairs that are closer than `margin` [m]."""
        i_X, j_X = self._pair_2P[:, pair_X]
        point_X3, other_X3 = closest_points(placed.ends_BC23[row_X, i_X], placed.ends_BC23[row_X, j_X])
        apart_X3 = point_X3 - other_X3
        length_X = apart_X3.norm(dim=-1)
        distance_X = length_X - self._radius_C[i_X] - self._radius_C[j_X]
        x = torch.nonzero(distance_X < margin)[:, 0]
        normal_X3 = apart_X3[x] / length_X[x, None].clamp_min(SHORT)
        return _Close(row_X[x], pair_X[x], distance_X[x], point_X3[x], normal_X3)

    def _near(self, poses: LinkPoses, margin: float) -> Contacts:
        placed = self._place(poses)
        close = self._closer(placed, margin)
        i_X, j_X = self._pair_2P[:, close.pair_X]
        axis_XA3 = ((placed.rotation_BL33[:, 1:] @ self._axes_A3[..., None])[..., 0])[close.row_X]
        lever_XA3 = torch.linalg.cross(axis_XA3, placed.position_BL3[:, 1:][close.row_X])
        moment_X31 = torch.linalg.cross(close.point_X3, close.normal_X3)[..., None]
        turn_XA = (axis_XA3 @ moment_X31 - lever_XA3 @ close.normal_X3[..., None])[..., 0]
        slide_XA = (axis_XA3 @ close.normal_X3[..., None])[..., 0]
        sign_XA = self._bodies.above_LA[self._body_C[i_X]] - self._bodies.above_LA[self._body_C[j_X]]
        moved_XA = torch.where(self._rotary_A > 0, turn_XA, slide_XA) * sign_XA
        return Contacts(close.row_X, close.pair_X, close.distance_X, moved_XA @ self.robot.drive_DN)
