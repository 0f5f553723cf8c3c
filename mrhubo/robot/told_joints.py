"""Which joints a human pose tells: what is listed and cannot be told is held or refused, what could be told and is not
listed is named.

Everything is seen from the chest, so joints below it that carry all of the body parts alike, a waist's, turn nothing.
They are held: to take the pelvis for the chest instead would let them spin.

Legend: B random poses, D directions, N joints.
"""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import torch

from mrhubo.errors import InputWarning, UserError
from mrhubo.robot.ancestry import Ancestry
from mrhubo.robot.discovery.lines import PARALLEL, sine
from mrhubo.robot.joint import Joint, stuck
from mrhubo.robot.keypoints import Keypoints, Limb
from mrhubo.robot.standing import StandingRobot
from mrhubo.robot.suggestions import quoted
from mrhubo.robot.urdf import Description

if TYPE_CHECKING:
    from mrhubo.robot.body_map import BodyMap
    from mrhubo.robot.model import Robot

_POSES = 16
_STANDING = 2
"""Random poses in which a joint that is not listed is turned: in one alone, a straight arm hides its own twist."""
_TURN, _TURNED = 0.5, 0.1
"""Radians by which it is turned, and how much of that a direction must turn along: a wrist's point is a little off the
axis of the forearm's twist."""
_MOST_NAMED = 24
"""Joints that a sentence names: all of two arms, a neck and a waist, and not a thousand."""
_ASIDE_M, _LESS = 1e-3, 0.5
"""How far the axis of a gear's play, or of a spring, may be from the motor's, and how much of its range it turns at
most."""
_NOTHING = 1e-4
"""Change of a unit direction that counts as none."""


@torch.no_grad()
def untold_joints(body_map: BodyMap) -> list[str]:
    """The joints of q that turn no direction: no human pose could tell their angles."""
    robot, count = body_map.robot, len(body_map.robot.joint_names)
    q_BN = robot.sample(_POSES, torch.Generator().manual_seed(0))
    mirrored_BN = robot.lower_N + robot.upper_N - q_BN  # in each joint's range
    moved_NBN = torch.where(torch.eye(count, dtype=torch.bool, device=q_BN.device)[:, None], mirrored_BN, q_BN)
    poses = robot.forward(torch.cat((q_BN, moved_NBN.flatten(0, 1))))
    direction_XBD3 = body_map.robot_directions(poses).unflatten(0, (count + 1, _POSES))
    change_N = (direction_XBD3[1:] - direction_XBD3[0]).abs().flatten(1).amax(dim=1)
    return [joint for joint, change in zip(robot.joint_names, change_N.tolist(), strict=True) if change < _NOTHING]


def waist_joints(body_map: BodyMap) -> list[str]:
    """The joints of q that turn no direction because they carry the parts from which all others are seen."""
    tree = Ancestry(body_map.robot)
    carrying = [set(tree.turning(link)) for link in body_map.shared.view_links]
    carried = [joint for joint in body_map.robot.joint_names if all(joint in above for above in carrying)]
    return [joint for joint in untold_joints(body_map) if joint in carried] if carried else []


def tell_of_waist(body_map: BodyMap, joints: Sequence[str]) -> None:
    """Says that joints are held from now on."""
    views = " and ".join(
        f"the {n} '{x}'" for n, x in zip(body_map.shared.views, body_map.shared.view_links, strict=True)
    )
    _warn(
        f"robot.joints: {quoted(joints)} {'carries' if len(joints) == 1 else 'carry'} {views} and all that is seen "
        "from there, which no human pose tells, and is held at 0; leave it out, or choose where it stands: "
        f"hold: {{{', '.join(f'{joint}: 0.0' for joint in joints)}}}"
    )


def refuse_untold(body_map: BodyMap) -> None:
    """Refuses joints that no human pose tells, and a waist between the chest and the limbs that are seen from it.

    Raises:
        UserError: names the joint, and what to write.
    """
    for joint in untold_joints(body_map)[:1]:
        shared = body_map.shared
        seen_from = ", ".join(f"the {n} '{link}'" for n, link in zip(shared.views, shared.view_links, strict=True))
        raise UserError(
            f"robot.joints: '{joint}' turns no limb, hand or head of robot.keypoints relative to {seen_from}, "
            "so no human pose could tell its angle; leave it out or name what it moves"
        )
    tree, ends = Ancestry(body_map.robot), body_map.keypoints.ends
    limbs = [direction for direction in body_map.directions if isinstance(direction, Limb)]
    for name in body_map.shared.views:
        hanging = [limb for limb in limbs if limb.part.hangs_on == limb.part.seen_from == name]
        links = [limb.start.link for limb in hanging if not tree.is_inward(limb, ends[name])]
        if len(links) < 2:
            continue
        apart = set(tree.turning(ends[name].link))
        alike = [joint for joint in tree.turning(links[0]) if all(joint in tree.turning(x) for x in links)]
        if between := [joint for joint in alike if joint not in apart]:
            parts = ", ".join(f"'{limb.part.start}'" for limb in hanging)
            raise UserError(
                f"robot.keypoints.{name}: '{ends[name].link}' does not carry {parts}: {quoted(between)} between them "
                f"would turn them all alike, and spin; name the link that carries them, and leave the joints out: "
                f"write {body_map.yardstick.entry(name) or f'{name}: {tree.carrier_of(links)}'}"
            )


def name_unlisted(body_map: BodyMap) -> None:
    """Warns of joints that turn a body part, and are neither listed nor given an angle."""
    robot, tree = body_map.robot, Ancestry(body_map.robot)
    shared, keypoints = body_map.shared, body_map.keypoints
    carrying = {joint for link in shared.view_links for joint in tree.movable(link)}
    links = [*(point.link for point in keypoints.points.values()), *(end.link for end in keypoints.ends.values())]
    joints, driven = robot.description.joints, {*robot.driven_joints, *robot.joint_names, *robot.hold}
    between = dict.fromkeys(name for link in links for name in reversed(tree.movable(link)) if name not in carrying)
    free = [joints[name] for name in between if name not in driven and joints[name].rotary and not joints[name].mimic]
    still = [joint for joint in free if stuck(joint) and not _is_play(body_map, joint) and _turns(body_map, joint)]
    if still:
        ends, which = f"{still[0].lower:g} .. {still[0].upper:g}", "it" if len(still) == 1 else "them"
        _warn(
            f"robot.joints: {quoted([joint.name for joint in still[:_MOST_NAMED]])} would turn body parts of "
            f"robot.keypoints, but limits as {ends} leave {which} no way to move; correct these in the URDF if they "
            f"are wrong, or say that this is meant: hold: {{{_angles(robot, still[:_MOST_NAMED])}}}"
        )
    missing = (joint for joint in free if not (stuck(joint) or _is_play(body_map, joint)) and _turns(body_map, joint))
    if missing := list(itertools.islice(missing, _MOST_NAMED + 1)):
        names = [joint.name for joint in missing[:_MOST_NAMED]]
        angles = _angles(robot, missing[:_MOST_NAMED])
        more = " and more" if len(missing) > len(names) else ""
        angles += ", ..." if more else ""
        _warn(
            f"robot.joints: {quoted(names)}{more} would turn body parts of robot.keypoints, and are not listed, so "
            f"they never move; list them, or say that this is meant: hold: {{{angles}}}"
        )


def _angles(robot: Robot, joints: Sequence[Joint]) -> str:
    """Where joints are held, as an entry."""
    return ", ".join(f"{joint.name}: {robot.held[joint.name]:g}" for joint in joints)


def _is_play(body_map: BodyMap, joint: Joint) -> bool:
    """Whether a joint is the play of a listed one's gear, or the spring behind it: about the same axis, and less."""
    robot, standing = body_map.robot, StandingRobot(body_map.robot.description, {})
    axis = standing.line(joint)
    beside = (
        other for name in robot.joint_names if _turn(joint) < _LESS * _turn(other := robot.description.joints[name])
    )
    lines = (standing.line(other) for other in beside if other.child == joint.parent or other.parent == joint.child)
    return any(sine(line.axis_3, axis.axis_3) < PARALLEL and line.distance(axis.point_3) < _ASIDE_M for line in lines)


def _turn(joint: Joint) -> float:
    """How far it turns [rad]."""
    return math.inf if joint.lower is None or joint.upper is None else joint.upper - joint.lower


def _turns(body_map: BodyMap, joint: Joint) -> bool:
    """Whether a joint that is not listed turns a direction, seen from what carries it."""
    robot = body_map.robot
    q_BN = robot.sample(_STANDING, torch.Generator().manual_seed(0))
    for configuration in (robot.configuration(q_N) for q_N in q_BN.cpu().numpy()):
        turned = {**configuration, joint.name: configuration.get(joint.name, 0.0) + _TURN}
        before_D3, after_D3 = (_directions(body_map.keypoints, robot.description, c) for c in (configuration, turned))
        if float(np.linalg.norm(after_D3 - before_D3, axis=1).max()) > _TURNED * _TURN:
            return True
    return False


def _directions(keypoints: Keypoints, description: Description, configuration: Mapping[str, float]) -> np.ndarray:
    """Unit directions (D, 3) of limbs and oriented parts, each in the frame of the link that sees it."""
    standing = StandingRobot(description, configuration)
    found = []
    for direction in keypoints.directions:
        if isinstance(direction, Limb):
            along_3 = standing.position(direction.end) - standing.position(direction.start)
        else:
            along_3 = standing.poses[direction.link][:3, :3] @ direction.axis_3.numpy()
        view_33 = standing.poses[keypoints.ends[direction.part.seen_from or ""].link][:3, :3]
        found.append(view_33.T @ along_3 / max(float(np.linalg.norm(along_3)), 1e-9))
    return np.stack(found)


def _warn(sentence: str) -> None:
    warnings.warn(sentence, InputWarning, stacklevel=3)
