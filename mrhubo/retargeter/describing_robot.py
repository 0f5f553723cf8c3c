"""A robot as the plain arrays of `mrhubo.fast`: kinematics, cost, collision shapes.

Legend: as in `mrhubo.fast.sections`.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable
from typing import Any

import numpy as np
import torch
from torch import Tensor

from mrhubo.fast.sections import Capsules, Cost, Kinematics
from mrhubo.reference import DirectionProblem, polish
from mrhubo.robot import BodyMap, Robot
from mrhubo.robot.joint import drive
from mrhubo.robot.keypoints import Limb
from mrhubo.robot.urdf import moved


def whole(values: Any) -> np.ndarray:
    """An array of whole numbers."""
    values = values.cpu().numpy() if isinstance(values, Tensor) else values
    return np.array(values, np.int64)


def real(values: Any) -> np.ndarray:
    """An array of float64."""
    values = values.cpu().numpy() if isinstance(values, Tensor) else values
    return np.array(values, np.float64)


def single(tensor: Tensor) -> np.ndarray:
    """An array of float32."""
    return np.array(tensor.detach().cpu().numpy(), np.float32)


class Bodies:
    """The links that driven joints carry, and where others are fixed to them."""

    def __init__(self, robot: Robot) -> None:
        self.description = robot.description
        depth = {name: len(self.description.joints_above(self._child(name))) for name in robot.driven_joints}
        self.joints = sorted(robot.driven_joints, key=lambda name: depth[name])
        """Each after those above it."""
        exact, home_N = copy.deepcopy(robot).double(), robot.home().double()
        poses, self._pose = exact.forward(home_N[None]), {self.description.root: np.eye(4)}
        for link, rotation_33, position_3 in zip(
            exact.links, poses.rotation_BL33[0], poses.position_BL3[0], strict=True
        ):
            pose_44 = np.eye(4)
            pose_44[:3, :3], pose_44[:3, 3] = rotation_33.cpu().numpy(), position_3.cpu().numpy()
            self._pose[link] = pose_44
        self.home_N = home_N.cpu().numpy()

    def _child(self, joint: str) -> str:
        return self.description.joints[joint].child

    def number(self, link: str) -> int:
        """Of the body that a link is fixed to; 0 is the root."""
        above = (joint.name for joint in self.description.joints_above(link))
        return next((self.joints.index(name) + 1 for name in above if name in self.joints), 0)

    def inside(self, link: str) -> np.ndarray:
        """Pose (4, 4) of a link in the frame of its body."""
        number = self.number(link)
        body = self._child(self.joints[number - 1]) if number else self.description.root
        return np.linalg.inv(self._pose[body]) @ self._pose[link]

    def origin(self, joint: str, angle: float) -> tuple[int, np.ndarray]:
        """The body that carries a joint, and the joint's pose (3, 4) in its frame; `angle`: the joint's at home."""
        own = self.description.joints[joint]
        parent = self.number(own.parent)
        body = self._child(self.joints[parent - 1]) if parent else self.description.root
        home_44 = np.linalg.inv(self._pose[body]) @ self._pose[own.child]
        return parent, (home_44 @ np.linalg.inv(moved(own.axis_3, angle, not own.rotary)))[:3]


def describe_kinematics(problem: DirectionProblem, bodies: Bodies) -> Kinematics:
    """The robot's joints and directions."""
    body_map, jacobian = problem.body_map, problem.kinematics
    robot, shared = body_map.robot, body_map.shared
    drives = [drive(robot.description.joints, name) for name in bodies.joints]
    columns = [robot.joint_names.index(d.joint) for d in drives]
    angles = [d.multiplier * bodies.home_N[n] + d.offset for d, n in zip(drives, columns, strict=True)]
    placed = [bodies.origin(name, angle) for name, angle in zip(bodies.joints, angles, strict=True)]
    own = [robot.description.joints[name] for name in bodies.joints]

    def point(link: str, offset: Iterable[float]) -> tuple[int, np.ndarray]:
        pose_44 = bodies.inside(link)
        return bodies.number(link), pose_44[:3, :3] @ np.array(list(offset)) + pose_44[:3, 3]

    def axis(link: str, axis_3: Tensor) -> tuple[int, np.ndarray]:
        return bodies.number(link), bodies.inside(link)[:3, :3] @ axis_3.cpu().double().numpy()

    starts, ends = [], []
    for direction in body_map.directions:
        if isinstance(direction, Limb):
            starts.append(point(direction.start.link, direction.start.offset_3))
            ends.append(point(direction.end.link, direction.end.offset_3))
        else:
            starts.append((0, np.zeros(3)))
            ends.append(axis(direction.link, direction.axis_3))
    views = [
        (bodies.number(link), bodies.inside(link)[:3, :3] @ axes_33.cpu().double().numpy())
        for link, axes_33 in zip(shared.view_links, shared.view_axes_V33, strict=True)
    ]
    here = [bodies.joints.index(name) for name in robot.driven_joints]
    pairs = len(jacobian._direction_P)
    column_Q = np.zeros(pairs, np.int64)
    layers_KD3N = jacobian._layers_KX.reshape(-1, len(body_map.directions), 3, len(robot.joint_names)).cpu()
    for layer, d, n in torch.nonzero(layers_KD3N[:, :, 0] < 3 * pairs).tolist():
        column_Q[int(layers_KD3N[layer, d, 0, n]) // 3] = n
    factors = [getattr(jacobian, f"_{name}_P1")[:, 0] for name in ("end", "start", "bend", "slide")]
    return Kinematics(
        parent_A=whole([parent for parent, _ in placed]),
        origin_A34=real(np.array([origin for _, origin in placed])),
        axis_A3=real(np.array([joint.axis_3 for joint in own])),
        rotary_A=whole([joint.rotary for joint in own]),
        column_A=whole(columns),
        ratio_A=real([d.multiplier for d in drives]),
        offset_A=real([d.offset for d in drives]),
        limb_D=whole([isinstance(direction, Limb) for direction in body_map.directions]),
        start_body_D=whole([body for body, _ in starts]),
        start_D3=real(np.array([point_3 for _, point_3 in starts])),
        end_body_D=whole([body for body, _ in ends]),
        end_D3=real(np.array([point_3 for _, point_3 in ends])),
        view_body_V=whole([body for body, _ in views]),
        view_V33=real(np.array([axes_33 for _, axes_33 in views])),
        direction_Q=whole(jacobian._direction_P),
        joint_Q=whole([here[a % len(here)] for a in jacobian._joint_P.tolist()]),
        column_Q=column_Q,
        factor_Q4=real(torch.stack(factors, dim=1)),
    )


def describe_cost(problem: DirectionProblem, polisher: polish.Polish) -> Cost:
    """What the optimiser's steps make small, and where they may start again."""
    blocks, posture, pool = problem.blocks, problem.posture, polisher.pool
    turned_DC = blocks.directions_DC
    block_D = torch.where(turned_DC.sum(dim=1) > 0, turned_DC.argmax(dim=1), -1)
    ridge_CU = torch.zeros(pool.cells_CU.shape, device=pool.q_UN.device)
    for block, part in enumerate(pool.blocks):
        for number, cell in enumerate(part.get_submodule("cells").children()):
            ridge_CU[block, pool.cells_CU[block] == number] = cell.get_buffer("constant_U")
    directions_UD3 = problem.body_map.robot_directions(problem.robot.forward(pool.q_UN))
    return Cost(
        lower_N=real(problem.lower_N),
        upper_N=real(problem.upper_N),
        velocity_N=real(problem.robot.velocity_N),
        middle_N=real(posture.mid_N),
        ridge_N=real(posture.ridge_N),
        block_N=whole(blocks.block_N),
        block_D=whole(block_D),
        weight_D=real(problem.directions.weight_D),
        partial_D=whole(problem.directions.partial_D > 0),
        pool_UN=single(pool.q_UN),
        pool_UD3=single(directions_UD3),
        pool_ridge_CU=single(ridge_CU),
        cell_CU=np.array(pool.cells_CU.cpu().numpy(), np.int32),
    )


def describe_capsules(body_map: BodyMap, bodies: Bodies) -> Capsules:
    """The collision shapes."""
    collision, joints = body_map.collision, body_map.robot.driven_joints
    children = [body_map.robot.description.joints[name].child for name in joints]
    number = [0, *(bodies.number(child) for child in children)]
    return Capsules(
        body_S=whole([number[body] for body in collision._body_C.tolist()]),
        end_S23=real(collision._ends_C23),
        radius_S=real(collision._radius_C),
        pair_Y2=np.array(collision._pair_2P.T.cpu().numpy(), np.int32),
    )
