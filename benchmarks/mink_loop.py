"""mink's loop of differential inverse kinematics, as docs/compare.md writes it: a rival of the benchmarks.

Two sets of targets. *Dense*: the places of elbows and wrists, and how hands and head are turned, all that the robot
has. *Ends*: wrists, hands and head alone, which are five targets of a robot with both arms, hands and a head; elbows
are left to the solver, as in teleoperation by a headset and two hand trackers.

Legend: D directions, N joints.
"""

from __future__ import annotations

from importlib import import_module

import numpy as np
import torch
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue] (compiled)

from mrhubo.robot import BodyMap
from mrhubo.robot.keypoints import Axis, Limb
from mrhubo.robot.parts import OrientedPart

_POSITION, _ORIENTATION = 1.0, 0.2
"""Costs of a metre and of a radian: a forearm's length of error weighs about as much as a radian's turn of a hand."""
_COMPILER = {"boundmass": "0.01", "boundinertia": "0.001", "fusestatic": "false", "discardvisual": "true"}


class NoLoop(ValueError):
    """Why the loop is not written for a robot."""


class MinkLoop:
    """The loop for one robot; it goes on from its last answer."""

    def __init__(self, body_map: BodyMap, iterations: int, dense: bool = True) -> None:
        """Reads the robot's URDF with MuJoCo.

        Raises:
            NoLoop: a limb does not run from link to link, the chest moves, or a joint is held away from 0.
        """
        mink, mujoco = import_module("mink"), import_module("mujoco")

        robot = body_map.robot
        limbs = [limb for limb in body_map.directions if isinstance(limb, Limb)]
        if np.any([point.offset_3 for limb in limbs for point in (limb.start, limb.end)]):
            raise NoLoop("limbs that do not run from link to link")
        if any(abs(angle) > 1e-6 for name, angle in robot.held.items() if name not in robot.joint_names):
            raise NoLoop("joints that are held away from 0")
        with torch.no_grad():
            views_B33 = body_map.shared.view_robot(robot.forward(torch.stack((robot.lower_N, robot.upper_N)))).views[0]
        if not torch.allclose(views_B33[0], views_B33[1], atol=1e-5):
            raise NoLoop("joints that turn the chest")
        model = mujoco.MjModel.from_xml_string(_with_these_joints(body_map))
        for name, low, high in zip(robot.joint_names, robot.lower_N.tolist(), robot.upper_N.tolist(), strict=True):
            number = model.joint(name).id
            model.jnt_limited[number], model.jnt_range[number] = 1, (low, high)
        self._mink, self._limbs, self._iterations = mink, limbs, iterations
        self._view_33 = views_B33[0].double().numpy()
        self._columns = [int(model.joint(name).qposadr[0]) for name in robot.joint_names]
        self._places = {name: column for column, name in enumerate(body_map.direction_names)}
        self._oriented = _oriented(body_map)
        ends = {limb.end.link for limb in limbs}
        inner = set() if dense else {limb.start.link for limb in limbs} & ends
        costs = {link: [_POSITION, 0.0] for link in ends - inner}
        for link in self._oriented:
            costs.setdefault(link, [0.0, 0.0])[1] = _ORIENTATION
        self._tasks = {
            link: mink.FrameTask(link, "body", position_cost=position, orientation_cost=orientation)
            for link, (position, orientation) in costs.items()
        }
        self._posture, self._limits = mink.PostureTask(model, cost=1e-3), [mink.ConfigurationLimit(model)]
        self._configuration, q = mink.Configuration(model), np.zeros(model.nq)
        q[self._columns] = robot.home().numpy()
        self._configuration.update(q)
        self._posture.set_target_from_configuration(self._configuration)
        links = {link for limb in limbs for link in (limb.start.link, limb.end.link)} | set(self._tasks)
        self._rest = {
            link: self._configuration.get_transform_frame_to_world(link, "body").translation() for link in links
        }

    @property
    def targets(self) -> int:
        """How many targets there are."""
        return len(self._tasks)

    def of_directions(self, direction_D3: np.ndarray) -> np.ndarray:
        """Joint angles (N,) [rad] for a human's directions (D, 3)."""
        mink, places = self._mink, dict(self._rest)
        base_D3 = direction_D3 @ self._view_33.T
        for limb in self._limbs:
            length = np.linalg.norm(self._rest[limb.end.link] - self._rest[limb.start.link])
            direction_3 = base_D3[self._places[limb.name]]
            places[limb.end.link] = places[limb.start.link] + length * direction_3
        for link, task in self._tasks.items():
            turn = mink.SO3.identity()
            if link in self._oriented:
                names, axes_33 = self._oriented[link]
                first_3, second_3 = (base_D3[self._places[name]] for name in names)
                turned_33 = np.stack((first_3, second_3, np.cross(first_3, second_3)), axis=1)
                turn = mink.SO3.from_matrix(turned_33 @ axes_33.T)
            task.set_target(mink.SE3.from_rotation_and_translation(turn, places[link]))
        tasks = [*self._tasks.values(), self._posture]
        for _ in range(self._iterations):
            velocity = mink.solve_ik(self._configuration, tasks, 0.1, "daqp", limits=self._limits)
            self._configuration.integrate_inplace(velocity, 0.1)
        return self._configuration.q[self._columns].copy()


def _oriented(body_map: BodyMap) -> dict[str, tuple[list[str], np.ndarray]]:
    """By link: names of an oriented part's two directions, and these and their normal (3, 3) in the link's frame."""
    found: dict[str, list[Axis]] = {}
    for direction in body_map.directions:
        if isinstance(direction, Axis) and isinstance(direction.part, OrientedPart):
            found.setdefault(direction.link, []).append(direction)
    pairs = {}
    for link, (first, second) in found.items():
        first_3, second_3 = (axis.axis_3.double().numpy() for axis in (first, second))
        axes_33 = np.stack((first_3, second_3, np.cross(first_3, second_3)), axis=1)
        pairs[link] = ([first.name, second.name], axes_33)
    return pairs


def _with_these_joints(body_map: BodyMap) -> str:
    """The URDF for MuJoCo: joints that the config does not name are fixed, and there are no meshes."""
    robot = body_map.robot
    root = etree.fromstring(robot.urdf.read_bytes(), etree.XMLParser(resolve_entities=False, no_network=True))
    for joint in root.findall("joint"):
        if joint.get("name") not in robot.joint_names:
            joint.set("type", "fixed")
            for tag in ("mimic", "limit"):
                for child in joint.findall(tag):
                    joint.remove(child)
    for link in root.findall("link"):
        for tag in ("visual", "collision"):
            for child in link.findall(tag):
                link.remove(child)
    mujoco = etree.SubElement(root, "mujoco")
    etree.SubElement(mujoco, "compiler", _COMPILER)
    return etree.tostring(root, encoding="unicode")
