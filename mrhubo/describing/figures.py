"""The human and the robot in a pose, with what a config says about them drawn on them.

Figures stand in the world frame (x forward, y left, z up), seen from the part that sees the limbs, the chest: a chest
that looks backwards shows the robot's back, and a turned one lays it down. Legend: E limbs, D directions, N robot
joints, J = 21 human joints.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from mrhubo.body import KEYPOINT_NAMES
from mrhubo.body.skeleton import POSED_JOINT_NAMES, SIDE_OF
from mrhubo.describing.markers import SIDE_COLORS, arrow, axis_rods, bone
from mrhubo.frames import human_to_world
from mrhubo.robot import Axis, BodyMap, Limb, link_poses
from mrhubo.view import Solids, human_figure
from mrhubo.view.robot import RobotShape
from mrhubo.view.solids import Color

_PALE: Color = (0.84, 0.86, 0.89)
"""Of both bodies, under their marks."""
_ARROW, _SHORT_ARROW, _FRONT_ARROW = 0.17, 0.11, 0.34
"""Lengths [m] of the arrows: a part's first direction, its second one, and where the chest looks."""
_ROD = 0.09
"""Half of a joint axis's rod [m]."""
_TALL = 1.8
"""About the human's height [m], which is the robot's where it is drawn."""
_MOST_STRETCH = 2.5
"""How far the scale that makes limbs alike may be from the one that makes heights alike."""


@dataclass(frozen=True)
class Figure:
    """A figure, and what is drawn over it whatever hides it."""

    body: Solids
    marks: Solids
    middle_3: np.ndarray
    """The middle (3,) of where the arms start, or of the body, where nothing starts at the chest."""


class FigureMaker:
    """Draws one robot and the human, with limbs of one length."""

    def __init__(self, body_map: BodyMap) -> None:
        self.body_map, self.robot = body_map, body_map.robot
        self._fine = self._shape = RobotShape(self.robot.description)
        self._limbs = [d for d in body_map.directions if isinstance(d, Limb)]
        self._axes = [d for d in body_map.directions if isinstance(d, Axis)]
        self._inner = [limb.part.hangs_on == limb.part.seen_from for limb in self._limbs]
        self.scale = 1.0
        self.scale = self._scale(self.robot.home())
        self._shape = self._fine.coarser(_TALL / self.scale)

    def human(self, local_J33: Tensor) -> Figure:
        """The human in a pose, local rotations (21, 3, 3)."""
        points = self._human_points(local_J33)
        start_E3, end_E3 = self._human_limbs(points)
        body = human_figure(local_J33, self.body_map.skeleton, _PALE, None)
        middle_3 = self._middle(start_E3, body)
        marks = self._marks(start_E3, end_E3, self.body_map.human_directions(local_J33[None])[0], points)
        return Figure(body, Solids.concatenate([marks, _front(middle_3)]), middle_3)

    def robot_figure(self, q_N: Tensor, size: float = 1.0, rod: float = _ROD, near: bool = False) -> Figure:
        """The robot at joint angles (N,) [rad]; `size` of its marks, and half the length [m] of a joint axis's `rod`.
        From `near` its meshes are as fine as they are, and no arrow shows where its chest looks.
        """
        poses = self.robot.forward(q_N[None])
        view = self.body_map.shared.view_robot(poses)
        place_44 = np.eye(4)
        place_44[:3, :3] = human_to_world(view.views[0][0].numpy()).T
        turn_33 = self.scale * place_44[:3, :3].T
        start_E3, end_E3 = view.start_BE3[0].numpy() @ turn_33, view.end_BE3[0].numpy() @ turn_33
        links_L3 = poses.position_BL3[0].numpy() @ turn_33
        origins = {axis.part.joint: links_L3[self.robot.link_index(axis.link)] for axis in self._axes}
        marks = self._marks(start_E3, end_E3, view.direction_BD3[0], origins, size)
        shown = link_poses(self.robot.description.parsed, self.robot.configuration(q_N.numpy()))
        rods = axis_rods(self._joint_axes(shown, place_44), rod, size)
        shape = self._fine if near else self._shape
        body = shape.solids(shown).recolored(_PALE).scaled(self.scale).transformed(place_44)
        middle_3 = self._middle(start_E3, body)
        return Figure(body, Solids.concatenate([marks, rods, *([] if near else [_front(middle_3)])]), middle_3)

    def places(self, q_N: Tensor) -> dict[str, np.ndarray]:
        """Where the config's points (3,) are in `robot_figure`, by their names."""
        view = self.body_map.shared.view_robot(self.robot.forward(q_N[None]))
        turn_33 = self.scale * human_to_world(view.views[0][0].numpy())
        found: dict[str, np.ndarray] = {}
        for row, limb in enumerate(self._limbs):
            found.setdefault(limb.part.start, view.start_BE3[0, row].numpy() @ turn_33)
            found.setdefault(limb.part.end, view.end_BE3[0, row].numpy() @ turn_33)
        return found

    def _human_points(self, local_J33: Tensor) -> dict[str, np.ndarray]:
        """Keypoints (3,) by name, world frame, m."""
        with torch.no_grad():
            points_K3 = self.body_map.skeleton.keypoints(local_J33[None])[0].numpy()
        return dict(zip(KEYPOINT_NAMES, human_to_world(points_K3), strict=True))

    def _human_limbs(self, points: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        ends = ([points[getattr(limb.part, end)] for limb in self._limbs] for end in ("start", "end"))
        start_E3, end_E3 = (np.array(end).reshape(-1, 3) for end in ends)
        return start_E3, end_E3

    def _scale(self, home_N: Tensor) -> float:
        """How many times larger the robot is drawn."""
        rest = self._human_points(torch.eye(3).repeat(len(POSED_JOINT_NAMES), 1, 1))
        robot = self.robot_figure(home_N).body
        by_height = float(np.ptp(np.array(list(rest.values()))[:, 2]) / max(np.ptp(robot.bounds()[:, 2]), 1e-3))
        view = self.body_map.shared.view_robot(self.robot.forward(home_N[None]))
        own_E = (view.end_BE3 - view.start_BE3)[0].norm(dim=-1).numpy()
        if not len(own_E) or own_E.mean() < 1e-3:
            return by_height
        start_E3, end_E3 = self._human_limbs(rest)
        by_limbs = float(np.linalg.norm(end_E3 - start_E3, axis=1).mean() / own_E.mean())
        return float(np.clip(by_limbs, by_height / _MOST_STRETCH, by_height * _MOST_STRETCH))

    def _marks(
        self,
        start_E3: np.ndarray,
        end_E3: np.ndarray,
        direction_D3: Tensor,
        origins: Mapping[str, np.ndarray],
        size: float = 1.0,
    ) -> Solids:
        """Limbs, and where hands and head point; `origins` by the human joint of a part."""
        limbs = zip(self._limbs, start_E3, end_E3, strict=True)
        marks = [bone(start_3, end_3, _color(limb.part.joint), size) for limb, start_3, end_3 in limbs]
        ends = {limb.part.name: end_3 for limb, end_3 in zip(self._limbs, end_E3, strict=True)}
        columns = {d.name: row for row, d in enumerate(self.body_map.directions)}
        for axis in self._axes:
            origin_3 = ends.get(axis.part.hangs_on or "", origins[axis.part.joint])
            length = _ARROW if axis.name == axis.part.direction_names[0] else _SHORT_ARROW
            direction_3 = human_to_world(direction_D3[columns[axis.name]].numpy())
            marks.append(arrow(origin_3, direction_3, length, _color(axis.part.joint), size))
        return Solids.concatenate(marks)

    def _middle(self, start_E3: np.ndarray, body: Solids) -> np.ndarray:
        return start_E3[self._inner].mean(axis=0) if any(self._inner) else body.bounds().mean(axis=0)

    def _joint_axes(
        self, poses: Mapping[str, np.ndarray], place_44: np.ndarray
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        for name in self.robot.joint_names:
            joint = self.robot.description.joints[name]
            pose_44 = place_44 @ poses[joint.child]
            yield self.scale * pose_44[:3, 3], pose_44[:3, :3] @ joint.axis_3


def _color(joint: str) -> Color:
    return SIDE_COLORS[SIDE_OF.get(joint)]


def _front(origin_3: np.ndarray) -> Solids:
    """Where the chest looks: x of the world frame."""
    return arrow(origin_3, np.array([1.0, 0.0, 0.0]), _FRONT_ARROW, SIDE_COLORS[None], 1.8)
