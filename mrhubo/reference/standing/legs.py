"""A robot's legs as the floor sees them: its root, its soles, how long its legs are, and where all that is in a pose.

The root is the middle of the joints where the legs start, at home, fixed to the link that carries them: the same point
of a person's body.

Legend: B batch, P points of soles (rear and front of each foot, foot by foot), K balls of all soles, D directions, N
joints.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import torch
from torch import Tensor, nn

from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, keypoint_indices
from mrhubo.errors import InputWarning, UserError
from mrhubo.frames import human_to_world
from mrhubo.robot import BodyMap, LinkPoses
from mrhubo.robot.outline import Outline
from mrhubo.robot.parts import LimbPart
from mrhubo.robot.soles import Sole, find_soles


@dataclass(frozen=True)
class LegPoses:
    """Where soles are [m], in a frame that who gives it says."""

    point_BP3: Tensor
    """Rear and front of each sole."""
    ball_BK3: Tensor
    """Centres of what can touch the floor."""


@dataclass(frozen=True)
class LegBuild:
    """How a leg is built, as far as its directions tell where its sole is; at home, m."""

    hip_3: Tensor
    """Where it starts, from the root, in the human axes of what carries the legs."""
    bones: tuple[tuple[str, float], ...]
    """The direction and the length of each limb, outwards."""
    sole_23: Tensor
    """Rear and front of the sole from where the last limb ends: in the foot's forward, up and left."""


class Legs(nn.Module):
    """The legs of one robot; `has_feet` says whether it has any that stand."""

    axes_33: Tensor
    root_3: Tensor
    points_P3: Tensor
    balls_K3: Tensor
    radius_K: Tensor

    def __init__(self, body_map: BodyMap) -> None:
        """Looks links and lengths up; warns of feet whose soles nothing tells.

        Raises:
            UserError: the robot has no feet, but a weight of its balance.
        """
        super().__init__()
        self.body_map, self.soles = body_map, find_soles(body_map)
        self.has_feet = bool(self.soles)
        if not self.has_feet:
            if body_map.robot.balance:
                raise UserError(
                    f"robot.balance: '{body_map.robot.name}' has no feet over which its centre of mass could be; "
                    "take the entry out"
                )
            return
        for sole in (sole for sole in self.soles if not sole.known):
            name, link = sole.part.name, sole.link
            warnings.warn(
                f"robot.keypoints.{name}: no shape of '{link}' tells where its sole is, so the origin of its frame is "
                f"taken; say how far it reaches backwards, forwards and down [m]: {name}: {{link: {link}, sole: "
                "[0.05, 0.12, 0.035]}",
                InputWarning,
                stacklevel=3,
            )
        keypoints, robot = body_map.keypoints, body_map.robot
        self.carrier = self.soles[0].part.seen_from or ""
        self.link = keypoints.ends[self.carrier].link
        view = body_map.shared.views.index(self.carrier)
        parts = {part.name: part for part in keypoints.parts}
        chains: list[list[LimbPart]] = []
        for sole in self.soles:
            chain: list[LimbPart] = []
            part = parts[sole.part.hangs_on or ""]
            while isinstance(part, LimbPart):
                chain.insert(0, part)
                part = parts[part.hangs_on or ""]
            chains.append(chain)
        self.chains = chains
        """Of each leg the limbs, outwards."""
        self.starts = keypoint_indices([chain[0].start for chain in chains])
        """Human keypoints between which a person's root is."""
        self.joint = JOINT_NAMES.index(parts[self.carrier].joint)
        """The human joint that turns what carries the legs."""
        self.built: list[LegBuild] = []
        """How each leg is built."""
        self.contacts = keypoint_indices([name for sole in self.soles for name in sole.part.stands])
        """Human keypoints of the points of soles (P)."""
        self._link_rows = [robot.link_index(sole.link) for sole in self.soles]
        self._carrier_row = robot.link_index(self.link)
        self._point_rows = [row for row in self._link_rows for _ in range(2)]
        self.ball_PK = _nearest_balls(self.soles)
        """Whether a ball is at that end of its sole at which a point is; one between the two may be at both."""
        self._ball_rows = [row for row, sole in zip(self._link_rows, self.soles, strict=True) for _ in sole.balls_K4]
        balls_K4 = torch.tensor([ball for sole in self.soles for ball in sole.balls_K4.tolist()])
        device = robot.lower_N.device
        tensors = {
            "axes_33": body_map.shared.view_axes_V33[view],
            "points_P3": torch.tensor([p.tolist() for s in self.soles for p in (s.rear_3, s.front_3)]),
            "balls_K3": balls_K4[:, :3],
            "radius_K": balls_K4[:, 3],
            "root_3": torch.zeros(3),
        }
        for name, tensor in tensors.items():
            self.register_buffer(name, tensor.to(device), persistent=False)
        self._measure()

    def _measure(self) -> None:
        """The root's place, and how long the robot's legs are against a person's."""
        robot, keypoints, chains = self.body_map.robot, self.body_map.keypoints, self.chains
        poses = robot.forward(robot.home()[None])
        place = partial(self.place, poses)
        row = self._carrier_row
        middle_3 = torch.stack([place(chain[0].start) for chain in chains]).mean(0)
        self.root_3 = poses.rotation_BL33[0, row].mT @ (middle_3 - poses.position_BL3[0, row])
        rest = self.body_map.skeleton.rest_points
        lengths = []
        for number, (chain, sole) in enumerate(zip(chains, self.soles, strict=True)):
            robots = sum(float((place(limb.end) - place(limb.start)).norm()) for limb in chain)
            humans = sum(float((rest[limb.end] - rest[limb.start]).norm()) for limb in chain)
            foot, up_3 = self._link_rows[number], keypoints.ends[sole.part.name].axes_23[1].to(middle_3)
            ankle_3 = poses.rotation_BL33[0, foot].mT @ (place(chain[-1].end) - poses.position_BL3[0, foot])
            robots += float((ankle_3 - self.points_P3[2 * number]) @ up_3)
            humans += float(rest[chain[-1].end][1] - min(rest[name][1] for name in sole.part.stands))
            lengths.append(robots / humans)
            out_3 = poses.rotation_BL33[0, row].mT @ (place(chain[0].start) - poses.position_BL3[0, row]) - self.root_3
            bones = tuple((limb.end, float((place(limb.end) - place(limb.start)).norm())) for limb in chain)
            self.built.append(LegBuild(self.axes_33.mT @ out_3, bones, _in_foot(self, number, ankle_3)))
        self.scale = sum(lengths) / len(lengths)
        """Length of the robot's legs by that of a person's."""

    def place(self, poses: LinkPoses, name: str) -> Tensor:
        """Where a keypoint is (3,) [m] in the first of some poses of the robot, in the base frame."""
        point, robot = self.body_map.keypoints.points[name], self.body_map.robot
        row = robot.link_index(point.link)
        return poses.position_BL3[0, row] + poses.rotation_BL33[0, row] @ robot.lower_N.new_tensor(point.offset_3)

    def places(self, poses: LinkPoses) -> LegPoses:
        """Where soles are in poses of the robot, seen from what carries the legs: in its human axes, from the root."""
        point_BP3, axes_B33, root_B3 = self.seen(poses)
        return LegPoses(point_BP3, self._seen(poses, self._ball_rows, self.balls_K3, axes_B33, root_B3))

    def seen(self, poses: LinkPoses) -> tuple[Tensor, Tensor, Tensor]:
        """The points (B, P, 3) of `places`, and the human axes (B, 3, 3) of what carries the legs and the place (B, 3)
        [m] of the root, in the base frame.
        """
        carrier_B33 = poses.rotation_BL33[:, self._carrier_row]
        root_B3 = self._root(poses)
        axes_B33 = carrier_B33 @ self.axes_33
        return self._seen(poses, self._point_rows, self.points_P3, axes_B33, root_B3), axes_B33, root_B3

    def _seen(self, poses: LinkPoses, rows: list[int], local_X3: Tensor, axes_B33: Tensor, root_B3: Tensor) -> Tensor:
        turned_BX3 = (poses.rotation_BL33[:, rows] @ local_X3[..., None])[..., 0]
        return (poses.position_BL3[:, rows] + turned_BX3 - root_B3[:, None]) @ axes_B33

    def on_floor(self, poses: LinkPoses, base_B3: Tensor, base_B33: Tensor) -> LegPoses:
        """Where soles are in the world in which the robot's base is there and so; arguments as `base` returns them."""
        found = [
            (poses.position_BL3[:, rows] + (poses.rotation_BL33[:, rows] @ local_X3[..., None])[..., 0])
            for rows, local_X3 in ((self._point_rows, self.points_P3), (self._ball_rows, self.balls_K3))
        ]
        return LegPoses(*(base_B3[:, None] + place_BX3 @ base_B33.mT for place_BX3 in found))

    def lowest(self, height_BK: np.ndarray) -> np.ndarray:
        """Height (B, P) [m] of the lowest ball at each point of a sole, of heights (B, K) of the balls' centres."""
        low_BK = height_BK - self.radius_K.double().cpu().numpy()
        return np.stack([low_BK[:, ball_K].min(axis=1) for ball_K in self.ball_PK], axis=1)

    def upright(self, poses: LinkPoses, up_B3: Tensor) -> Tensor:
        """The upright direction (B, 3) in the base frame, of that in the human axes of what carries the legs."""
        return (poses.rotation_BL33[:, self._carrier_row] @ self.axes_33 @ up_B3[..., None])[..., 0]

    def over_floor(self, outline: Outline, poses: LinkPoses, up_B3: Tensor, height_B: Tensor) -> tuple[Tensor, Tensor]:
        """How far the lowest point of each ball of an outline is over the floor (B, K), and its centre (B, K, 3) in the
        base frame [m].

        Args:
            outline: the robot's.
            poses: of the robot.
            up_B3: the upright direction, in the human axes of what carries the legs.
            height_B: how high the root is over the floor [m].
        """
        place_BK3, way_B3 = outline.places(poses), self.upright(poses, up_B3)
        over_BK = ((place_BK3 - self._root(poses)[:, None]) @ way_B3[..., None])[..., 0]
        return height_B[:, None] + over_BK - outline.radius_K, place_BK3

    def asked(self, local_BJ33: Tensor, turns_BJ33: Tensor) -> Tensor:
        """Human axes (B, 3, 3) that what carries the legs is to have, relative to the person's root: the person's, or
        as `robot.root_follows` says.

        Args:
            local_BJ33: local rotations (B, 21, 3, 3) of human poses.
            turns_BJ33: rotations (B, 22, 3, 3) of their joints relative to the root.
        """
        carrier_B33, root_turn = turns_BJ33[:, self.joint], self.body_map.shared.root_turn
        return carrier_B33 if root_turn is None else carrier_B33 @ root_turn(local_BJ33)

    def heading(self, poses: LinkPoses, base_B33: Tensor) -> Tensor:
        """Human axes (B, 3, 3) of what carries the legs, in the robot's world: columns are its left, up and forward."""
        return base_B33 @ poses.rotation_BL33[:, self._carrier_row] @ self.axes_33

    def root(self, poses: LinkPoses, base_B3: Tensor, base_B33: Tensor) -> Tensor:
        """The root's place (B, 3) [m] in the robot's world."""
        return base_B3 + (base_B33 @ self._root(poses)[..., None])[..., 0]

    def _root(self, poses: LinkPoses) -> Tensor:
        row = self._carrier_row
        return poses.position_BL3[:, row] + poses.rotation_BL33[:, row] @ self.root_3

    def base(self, poses: LinkPoses, root_B3: Tensor, turn_B33: Tensor) -> tuple[Tensor, Tensor]:
        """Place (B, 3) [m] and rotation (B, 3, 3) of the robot's base in the world (x forward, y left, z up).

        Args:
            poses: of the robot.
            root_B3: place of its root in the world [m].
            turn_B33: human axes of what carries the legs, in the human's world.
        """
        carrier_B33 = human_to_world(turn_B33.mT).mT @ self.axes_33.T
        base_B33 = carrier_B33 @ poses.rotation_BL33[:, self._carrier_row].mT
        return root_B3 - (base_B33 @ self._root(poses)[..., None])[..., 0], base_B33

    def pointing(self, target_BD3: Tensor) -> Tensor:
        """Where points of soles are (B, P, 3) [m] if legs point as directions (B, D, 3) say, as `places` has it: of
        their lengths alone, whatever joints can do.
        """
        names, found = self.body_map.direction_names, []
        for leg, sole in zip(self.built, self.soles, strict=True):
            place_B3 = leg.hip_3 + sum(length * target_BD3[:, names.index(name)] for name, length in leg.bones)
            forward_B3, up_B3 = (target_BD3[:, names.index(name)] for name in sole.part.direction_names)
            axes_B33 = torch.stack((forward_B3, up_B3, torch.linalg.cross(up_B3, forward_B3)), dim=1)
            found.append(place_B3[:, None] + leg.sole_23 @ axes_B33)
        return torch.cat(found, dim=1)

    def planted(self, planted_TP: np.ndarray) -> np.ndarray:
        """Whether each foot (T, S) is planted, of points of soles (T, P)."""
        return np.logical_or(planted_TP[:, ::2], planted_TP[:, 1::2])

    def human_root(self, keypoint_BK3: Tensor) -> Tensor:
        """The place (B, 3) of a person's root, of keypoints (B, K, 3)."""
        assert keypoint_BK3.shape[1] == len(KEYPOINT_NAMES)
        return keypoint_BK3[:, self.starts].mean(dim=1)


def _in_foot(legs: Legs, number: int, ankle_3: Tensor) -> Tensor:
    """Rear and front of a sole (2, 3) from the ankle, in the foot's forward, up and left."""
    forward_3, up_3 = legs.body_map.keypoints.ends[legs.soles[number].part.name].axes_23.to(ankle_3)
    axes_33 = torch.stack((forward_3, up_3, torch.linalg.cross(up_3, forward_3)))
    return (legs.points_P3[2 * number : 2 * number + 2] - ankle_3) @ axes_33.mT


def _nearest_balls(soles: Sequence[Sole]) -> np.ndarray:
    """Which balls of all soles (P, K) are nearer to the rear or the front end of their own."""
    found = np.zeros((2 * len(soles), sum(len(sole.balls_K4) for sole in soles)), dtype=bool)
    first = 0
    for number, sole in enumerate(soles):
        along_3 = sole.front_3 - sole.rear_3
        share_K = (sole.balls_K4[:, :3] - (sole.rear_3 + sole.front_3) / 2) @ along_3
        found[2 * number, first : first + len(share_K)] = share_K <= 0
        found[2 * number + 1, first : first + len(share_K)] = share_K >= 0
        first += len(share_K)
    return found
