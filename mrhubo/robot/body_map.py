"""Robot links as human body parts: unit directions that robot and human share, and human keypoints built from them.

A direction is seen from the chest, in human axes (x left, y up, z forward), so neither proportions nor the way a
base faces matter. Limbs (upper arm, forearm) have one direction, oriented ends (hand, head) two: fingers and thumb,
forward and up.

`scale: auto` then gives each limb the human's length: keypoints are chained outwards from the shoulders of a human who
stands upright, along the robot's directions. No number is tuned. `scale: manual` is in `scale`.

Legend: B batch, D directions, K keypoints, L robot links, N robot joints.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, POSED_JOINT_NAMES, Skeleton, keypoint_indices
from mrhubo.config import RobotConfig, with_places
from mrhubo.errors import UserError, unknown_name
from mrhubo.robot.collision import SelfCollision
from mrhubo.robot.entries import End, Point, check_names, read_end, read_point
from mrhubo.robot.manual_scale import ManualScale, check_ranges
from mrhubo.robot.model import LinkPoses, Robot
from mrhubo.robot.parts import ENDS, HAND_POINTS, LIMBS, POINTS, SIDES, human_axes, joint_of, limb_of, turn_of
from mrhubo.robot.urdf import describe

_PINNED = ("left_knee", "right_knee", "left_ankle", "right_ankle", "neck", "left_shoulder", "right_shoulder")
"""Keypoints held at the upright rest pose: the robot's arms and head are retargeted, the human stands."""


@dataclass(frozen=True)
class Direction:
    """One direction: from one point to another (`axis` None), or an axis fixed to a link."""

    name: str
    start: Point | None
    end: Point | None
    link: str
    axis_3: Tensor | None


class BodyMap:
    """What a robot shares with a human body, read from `robot.keypoints` of the config."""

    def __init__(
        self,
        robot: Robot,
        points: Mapping[str, Point],
        ends: Mapping[str, End],
        chest: End,
        skeleton: Skeleton,
        manual: ManualScale | None = None,
    ) -> None:
        self.robot, self.points, self.ends, self.chest, self.skeleton = robot, points, ends, chest, skeleton
        self.manual = manual
        if manual is not None:
            manual.prepare(robot)
        self.directions = self._list_directions()
        self.direction_names = tuple(d.name for d in self.directions)
        index = robot.link_index
        self._starts = [i for i, d in enumerate(self.directions) if d.axis_3 is None]
        self._axes = [i for i, d in enumerate(self.directions) if d.axis_3 is not None]
        limbs, axes = [self.directions[i] for i in self._starts], [self.directions[i] for i in self._axes]
        self.limb_links = ([index(d.start.link) for d in limbs if d.start], [index(d.end.link) for d in limbs if d.end])
        self._limb_offsets_2E3 = torch.tensor(
            [[d.start.offset_3 for d in limbs if d.start], [d.end.offset_3 for d in limbs if d.end]]
        ).reshape(2, len(limbs), 3)
        self.axis_links = [index(d.link) for d in axes]
        self._axes_A3 = torch.stack([d.axis_3 for d in axes if d.axis_3 is not None]) if axes else torch.zeros(0, 3)
        self._order = torch.tensor(self._starts + self._axes).argsort()
        chest_human_33 = _frame(chest.axes_23)  # columns: human x (left), y (up), z (forward) in the chest link's frame
        self._chest_33 = chest_human_33
        self._chest_link = index(chest.link)
        self._list_keypoints()

    @functools.cached_property
    def collision(self) -> SelfCollision:
        """The robot's collision shapes, on the device on which it is; read when first asked for."""
        return SelfCollision(self.robot)

    def to(self, device: torch.device | str) -> BodyMap:
        """Moves robot, skeleton and constants to the device, in place."""
        self.__dict__.pop("collision", None)
        self.robot.to(device)
        self.skeleton.to(device)
        if self.manual is not None:
            self.manual.to(device)
        for name in ("_limb_offsets_2E3", "_axes_A3", "_order", "_chest_33", "_chained_K3", "_rest_K3"):
            setattr(self, name, getattr(self, name).to(device))
        return self

    def _list_directions(self) -> list[Direction]:
        found = []
        for side in SIDES:
            for a, b in LIMBS:
                start, end = self.points.get(f"{side}_{a}"), self.points.get(f"{side}_{b}")
                if start and end:
                    found.append(Direction(f"{side}_{b}", start, end, end.link, None))
        for name, end in self.ends.items():
            for word, axis in zip(ENDS[name], end.axes_23, strict=True):
                found.append(Direction(f"{name}_{word}", None, None, end.link, axis))
        if not found:
            raise UserError("robot.keypoints: names no limb; give at least one side's shoulder and elbow")
        return found

    def check_moved(self) -> None:
        """Refuses a joint that turns no direction: no human pose could tell its angle.

        Raises:
            UserError: names the joint.
        """
        robot = self.robot
        q_BN = robot.sample(16, torch.Generator().manual_seed(0))
        before = self.robot_directions(robot.forward(q_BN))
        for column, joint in enumerate(robot.joint_names):
            moved = q_BN.clone()
            moved[:, column] = (robot.lower_N + robot.upper_N)[column] - q_BN[:, column]  # mirrored in its range
            change = (self.robot_directions(robot.forward(moved)) - before).abs().max()
            if float(change) < 1e-4:
                raise UserError(
                    f"robot.joints: '{joint}' turns no limb, hand or head of robot.keypoints relative to the chest "
                    f"'{self.chest.link}', so no human pose could tell its angle; leave it out or name what it moves"
                )

    def robot_directions(self, poses: LinkPoses) -> Tensor:
        """Unit directions (B, D, 3) of the robot, seen from its chest, in human axes."""
        start, end = self.limb_links
        vector = self.limb_vectors(poses, 1, end) - self.limb_vectors(poses, 0, start)
        limbs = torch.nn.functional.normalize(vector, dim=-1)
        axes = (poses.rotation_BL33[:, self.axis_links] @ self._axes_A3[..., None])[..., 0]
        return torch.cat((limbs, axes), dim=1)[:, self._order] @ self.chest_axes(poses)

    def limb_vectors(self, poses: LinkPoses, which: int, links: list[int]) -> Tensor:
        """Start (which=0) or end (which=1) points (B, E, 3) of the limbs, base frame [m]."""
        offset = (poses.rotation_BL33[:, links] @ self._limb_offsets_2E3[which, :, :, None])[..., 0]
        return poses.position_BL3[:, links] + offset

    def chest_axes(self, poses: LinkPoses) -> Tensor:
        """Columns (B, 3, 3): the human's left, up and forward as the robot's chest has them, base frame."""
        return poses.rotation_BL33[:, self._chest_link] @ self._chest_33

    def human_directions(self, pose_BJ6: Tensor) -> Tensor:
        """Unit directions (B, D, 3) of human poses (B, 21, 6), seen from spine3, in human axes."""
        keypoints, rotations = self.skeleton.keypoints_and_rotations(rotation.sixd_to_matrix(pose_BJ6))
        columns = []
        for d in self.directions:
            if d.axis_3 is None:
                start, end = limb_of(d.name)
                ends = keypoint_indices([start, end])
                columns.append(torch.nn.functional.normalize(keypoints[:, ends[1]] - keypoints[:, ends[0]], dim=-1))
            else:
                part, word = d.name.rsplit("_", 1)
                joint = JOINT_NAMES.index(joint_of(part))
                columns.append(rotations[:, joint] @ human_axes(part)[ENDS[part].index(word)].to(rotations))
        return torch.stack(columns, dim=1) @ rotations[:, JOINT_NAMES.index("spine3")]

    def _list_keypoints(self) -> None:
        names: list[str] = list(_PINNED)
        for d in self.directions:
            if d.axis_3 is None:
                names.append(d.name)
        for part in self.ends:
            if part == "head":
                names += ["head", "left_eye", "right_eye"]
            else:
                names += [part.replace("hand", point) for point in HAND_POINTS]
        self._chained_names = tuple(names)
        source = self.manual.keypoint_names if self.manual else self._chained_names
        self.keypoint_names = source
        """Names of the target keypoints."""
        self.keypoint_indices = keypoint_indices(source)
        """Their positions in the skeleton's keypoints."""
        self._rest_K3 = self.skeleton.rest_K3[keypoint_indices(names)]
        parent = {name: "neck" if name == "head" else "head" if "eye" in name else self._parent(name) for name in names}
        rest = self.skeleton.rest_K3
        offsets = [rest[KEYPOINT_NAMES.index(n)] - rest[KEYPOINT_NAMES.index(parent[n])] for n in names]
        self._chained_K3 = torch.stack(offsets)

    @staticmethod
    def _parent(name: str) -> str:
        side, part = name.split("_") if "_" in name else ("", name)
        parents = {"elbow": "shoulder", "wrist": "elbow", **dict.fromkeys(HAND_POINTS, "wrist")}
        return f"{side}_{parents[part]}" if part in parents else name

    def human_keypoints(self, directions_BD3: Tensor) -> Tensor:
        """P: target keypoints (B, K, 3) [m] of an upright human whose limbs have these directions (`scale: auto`)."""
        batch = len(directions_BD3)
        found: dict[str, Tensor] = {n: self._rest_K3[i].expand(batch, 3) for i, n in enumerate(self._chained_names)}
        offset = dict(zip(self._chained_names, self._chained_K3, strict=True))
        column = {name: directions_BD3[:, i] for i, name in enumerate(self.direction_names)}
        for d in self.directions:
            if d.axis_3 is None:
                found[d.name] = found[limb_of(d.name)[0]] + offset[d.name].norm() * column[d.name]
        for part in self.ends:
            first, second = (column[f"{part}_{word}"] for word in ENDS[part])
            turn = turn_of(part, first, second)
            if part == "head":
                half = rotation.axis_angle_to_matrix(rotation.matrix_to_axis_angle(turn) / 2)
                found["head"] = found["neck"] + half @ offset["head"]
                points, base = ["left_eye", "right_eye"], "head"
            else:
                points, base = [part.replace("hand", p) for p in HAND_POINTS], joint_of(part)
            for point in points:
                found[point] = found[base] + turn @ offset[point]
        return torch.stack([found[name] for name in self._chained_names], dim=1)

    def targets(self, poses: LinkPoses) -> Tensor:
        """Target keypoints (B, K, 3) [m], human frame, of robot poses."""
        if self.manual is not None:
            return self.manual.targets(poses)
        return self.upright_keypoints(poses)

    def upright_keypoints(self, poses: LinkPoses) -> Tensor:
        """`human_keypoints` (B, K, 3) [m] of robot poses."""
        return self.human_keypoints(self.robot_directions(poses))

    def input_joints(self, directions: Iterable[int] | None = None) -> tuple[str, ...]:
        """Human joints between the chest and the parts that the robot has, or those of some directions alone: what a
        pose needs to tell the network.
        """
        wanted: list[str] = []
        for d in self.directions if directions is None else [self.directions[i] for i in directions]:
            part = d.name.rsplit("_", 1)[0] if d.axis_3 is not None else limb_of(d.name)[0]
            side = part.split("_")[0]
            if part == "head":
                wanted += ["neck", "head"]
            elif part.endswith("hand"):
                wanted += [f"{side}_wrist"]
            else:
                wanted += [f"{side}_collar", part]
        return tuple(name for name in POSED_JOINT_NAMES if name in wanted)


def _frame(forward_up_23: Tensor) -> Tensor:
    forward, up = forward_up_23
    return torch.stack((torch.linalg.cross(up, forward), up, forward), dim=-1)


@with_places
def build_body_map(config: RobotConfig, skeleton: Skeleton | None = None) -> BodyMap:
    """Robot and body map of a config's `robot` section, checked; `skeleton` is the human's, by default the open one.

    Raises:
        UserError: the URDF, a joint, a link or a keypoint entry is wrong; says which, and the nearest valid name.
    """
    entries = dict(config.keypoints)
    valid = (*POINTS, *ENDS, "chest")
    for name in entries:
        if name not in valid:
            raise UserError(f"robot.keypoints.{name}: {unknown_name('body part', name, valid)}")
    if "chest" not in entries:
        raise UserError("robot.keypoints: 'chest' is missing; name the link that carries the arms")
    points = {name: read_point(name, entries[name]) for name in POINTS if name in entries}
    for name in points:
        side, part = name.split("_")
        inner = dict((b, a) for a, b in LIMBS).get(part)
        if inner and f"{side}_{inner}" not in points:
            raise UserError(
                f"robot.keypoints.{name}: needs '{side}_{inner}' too; a limb is a direction between the two"
            )
    ends = {name: read_end(name, entries[name], ENDS[name]) for name in ENDS if name in entries}
    for name in ends:
        if name != "head" and joint_of(name) not in points:
            raise UserError(f"robot.keypoints.{name}: needs '{joint_of(name)}' too")
    chest = read_end("chest", entries["chest"], ("forward", "up"))
    if config.scale != "auto" and config.manual is None:
        raise UserError(f"robot.manual: is missing; `scale: {config.scale}` needs its numbers")
    if config.scale == "search" and config.search is None:
        raise UserError("robot.search: is missing; `scale: search` needs the ranges of what varies")
    manual = ManualScale(config.manual) if config.scale != "auto" and config.manual else None
    if config.scale == "search" and config.search and config.manual:
        check_ranges(config.manual, config.search.ranges)
    links = [chest.link, *(p.link for p in points.values()), *(e.link for e in ends.values()), *config.key_links]
    links += manual.links if manual else []
    if not config.key_links:
        raise UserError("robot.key_links: is empty; name the links whose error is measured")
    check_names(config, describe(config.urdf))
    robot = Robot(config.urdf, config.joints, links, config.ranges, config.hold, config.name)
    body_map = BodyMap(robot, points, ends, chest, skeleton or Skeleton(), manual)
    _check_lengths(body_map)
    body_map.check_moved()
    return body_map


def _check_lengths(body_map: BodyMap) -> None:
    poses = body_map.robot.forward(body_map.robot.sample(64, torch.Generator().manual_seed(0)))
    start, end = body_map.limb_links
    length = (body_map.limb_vectors(poses, 1, end) - body_map.limb_vectors(poses, 0, start)).norm(dim=-1).amin(0)
    names = [d.name for d in body_map.directions if d.axis_3 is None]
    for name, shortest in zip(names, length.tolist(), strict=True):
        if shortest < 1e-4:
            raise UserError(
                f"robot.keypoints: '{limb_of(name)[0]}' and '{name}' lie on one point, so the limb has no "
                "direction; choose another link or an offset"
            )
