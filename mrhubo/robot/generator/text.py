"""A plan as the text of a URDF: frames, origins that slide along their axes, axes of either sign, order by chance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.robot.generator.limbs import Chance
from mrhubo.robot.generator.naming import namer
from mrhubo.robot.generator.plan import Plan, PlannedJoint


@dataclass(frozen=True)
class Written:
    """The text, and what became of bodies and joints."""

    text: str
    links: dict[int, str]
    """By body."""
    joints: dict[str, str]
    """By role."""
    pose_44: dict[int, np.ndarray]
    """Of every body's link in the root's frame, at zero."""


def write(
    chance: Chance,
    plan: Plan,
    moved: list[np.ndarray],
    root: int,
    base_44: np.ndarray,
    style: str,
    tidy: bool,
    shapes: bool,
    masses: bool = True,
) -> Written:
    """The URDF of a plan.

    Args:
        chance: what is random.
        plan: the robot at its zero pose.
        moved: how its bodies have moved since their solids were planned (4, 4).
        root: the body that becomes the root link.
        base_44: pose of the root link's frame in the plan's frame.
        style: how things are called.
        tidy: whether frames stand as the root's, with origins at the joints' points; else both are by chance.
        shapes: whether links have collision boxes.
        masses: whether they have masses.
    """
    joints = plan.rooted(root)
    call = namer(chance, style)
    names = {joint.role: call(joint.role, "joint") for joint in plan.joints}
    links = {body: call(role, "link") for body, role in enumerate(plan.bodies)}
    frames = {root: base_44}
    for joint in joints:
        turn_33 = base_44[:3, :3] if tidy else _turn(chance)
        small = any(word in joint.role for word in ("finger", "thumb", "jaw"))
        slide = 0.0 if tidy or small or not joint.moves else chance.shift(0.5, 0.0, 0.1)
        frames[joint.child] = np.eye(4)
        frames[joint.child][:3, :3], frames[joint.child][:3, 3] = turn_33, joint.point_3 + slide * joint.axis_3
    flips = {
        joint.role: -1.0 if not tidy and joint.mimics is None and chance.maybe(0.5) else 1.0 for joint in plan.joints
    }
    planned = {joint.role: joint for joint in plan.joints}
    # A reversed joint turns by the same angle about the opposite axis, which `rooted` has done.
    parts = [
        _link(plan, body, links[body], frames[body], moved[body], shapes, masses)
        for body in range(len(plan.bodies))
        if body in frames
    ]
    parts += [_joint(joint, planned, names, links, frames, flips) for joint in joints]
    if not tidy:
        parts = [parts[i] for i in chance.random.permutation(len(parts))]
    text = '<?xml version="1.0"?>\n<robot name="made">\n' + "\n".join(parts) + "\n</robot>\n"
    inverse_44 = np.linalg.inv(base_44)
    return Written(text, links, names, {body: inverse_44 @ frame_44 for body, frame_44 in frames.items()})


def _joint(
    joint: PlannedJoint, planned: dict[str, PlannedJoint], names: dict[str, str], links: dict[int, str],
    frames: dict[int, np.ndarray], flips: dict[str, float],
) -> str:  # fmt: skip
    origin_44 = np.linalg.inv(frames[joint.parent]) @ frames[joint.child]
    lines = [
        f'<joint name="{names[joint.role]}" type="{joint.kind}">',
        f'  <origin xyz="{_numbers(origin_44[:3, 3])}" rpy="{_numbers(_rpy(origin_44[:3, :3]))}"/>',
        f'  <parent link="{links[joint.parent]}"/><child link="{links[joint.child]}"/>',
    ]
    if joint.moves:
        flip = flips[joint.role]
        axis_3 = flip * (frames[joint.child][:3, :3].T @ joint.axis_3)
        lines.append(f'  <axis xyz="{_numbers(axis_3)}"/>')
        if joint.lower is not None and joint.upper is not None:
            low, high = sorted((flip * joint.lower, flip * joint.upper))
            lines.append(f'  <limit lower="{low:.9g}" upper="{high:.9g}" effort="10" velocity="5"/>')
        if joint.mimics is not None:
            source, factor = joint.mimics
            lines.append(f'  <mimic joint="{names[source]}" multiplier="{factor * flips[source]:.9g}"/>')
    return "\n".join([*lines, "</joint>"])


def _link(
    plan: Plan, body: int, name: str, frame_44: np.ndarray, moved_44: np.ndarray, shapes: bool, masses: bool
) -> str:
    solid = plan.solids.get(body)
    if solid is None or not (shapes or masses):
        return f'<link name="{name}"/>'
    pose_44 = moved_44.copy()
    pose_44[:3, 3] += moved_44[:3, :3] @ solid.centre_3
    local_44 = np.linalg.inv(frame_44) @ pose_44
    place = f'<origin xyz="{_numbers(local_44[:3, 3])}" rpy="{_numbers(_rpy(local_44[:3, :3]))}"/>'
    mass = 1000 * float(np.prod(2 * solid.half_3))
    lines = [f'<link name="{name}">']
    if masses:
        lines += [f'  <inertial>{place}<mass value="{mass:.6g}"/>'
                  '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>']  # fmt: skip
    if shapes:
        lines.append(f'  <collision>{place}<geometry><box size="{_numbers(2 * solid.half_3)}"/></geometry></collision>')
    return "\n".join([*lines, "</link>"])


def _turn(chance: Chance) -> np.ndarray:
    """A rotation (3, 3) by chance: sometimes about one axis by quarter turns, as people choose them."""
    if chance.maybe(0.5):
        axes = chance.random.permutation(3)
        turn_33 = np.zeros((3, 3))
        turn_33[axes, [0, 1, 2]] = chance.random.choice([-1.0, 1.0], 3)
        return turn_33 * (1.0 if np.linalg.det(turn_33) > 0 else np.array([1.0, 1.0, -1.0]))
    q = np.linalg.qr(chance.random.normal(size=(3, 3)))[0]
    return q if np.linalg.det(q) > 0 else -q


def _rpy(turn_33: np.ndarray) -> np.ndarray:
    """Roll, pitch, yaw about fixed axes [rad], as in URDF."""
    pitch = np.arcsin(np.clip(-turn_33[2, 0], -1.0, 1.0))
    if abs(turn_33[2, 0]) > 1 - 1e-9:
        return np.array([0.0, pitch, np.arctan2(-turn_33[0, 1], turn_33[1, 1])])
    return np.array([np.arctan2(turn_33[2, 1], turn_33[2, 2]), pitch, np.arctan2(turn_33[1, 0], turn_33[0, 0])])


def _numbers(values_N: np.ndarray) -> str:
    return " ".join(f"{value:.9g}" for value in values_N)
