"""Whether limbs run between the centres of the robot's joints: an upper arm from where the shoulder's axes cross.

The link that a name suggests may lie a hand's breadth from there, and then the upper arm points 10 to 30 degrees beside
where it should, in every pose, while every error that is measured with the same wrong point stays small.

Legend: S poses, N joints.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import torch

from mrhubo.errors import InputWarning
from mrhubo.robot.ancestry import Ancestry
from mrhubo.robot.bending import BendAxis
from mrhubo.robot.capsules import SHORT
from mrhubo.robot.discovery.lines import cross, unit
from mrhubo.robot.entries import Point
from mrhubo.robot.joint import Joint
from mrhubo.robot.keypoints import Limb
from mrhubo.robot.standing import StandingRobot
from mrhubo.robot.suggestions import point_entry

if TYPE_CHECKING:
    from mrhubo.robot.body_map import BodyMap

_POSES = 3
"""Random poses besides the one in which the joints are at 0: a point that does not move with a limb shows in them."""
_OFF = 0.02
"""Metres by which a point may be farther from an axis than the centre is: 5 degrees of an upper arm of 25 cm, and more
than the axes of small robots lie beside each other (15 mm on NAO)."""
_ELSEWHERE = 0.2
"""How far an axis passes the joint's centre that does not belong to it, as a share of the limb: a clavicle's."""
_SWING = 0.5
"""How much of its turn a limb must turn by where an axis swings it, and does not just twist it."""
_ASIDE = 15.0
"""Degrees that a limb may point beside the line between its joints' centres: axes of a shoulder or an elbow that do not
meet leave a choice of 5 to 10."""


def check_centres(body_map: BodyMap) -> None:
    """Warns of limbs that start beside the axes that turn them, or point beside the line between their joints."""
    robot, tree = body_map.robot, Ancestry(body_map.robot)
    q_SN = torch.cat((robot.home()[None], robot.sample(_POSES, torch.Generator().manual_seed(0)))).cpu().numpy()
    poses = [StandingRobot(robot.description, robot.configuration(q_N)) for q_N in q_SN]
    told: set[str] = set()
    for limb in (direction for direction in body_map.keypoints.directions if isinstance(direction, Limb)):
        view = body_map.keypoints.ends[limb.part.seen_from or ""]
        start, end = (body_map.yardstick.centre(name, limb.end.link) for name in (limb.part.start, limb.part.end))
        if start is None or tree.is_inward(limb, view) or _other_joint(body_map, poses[0], limb):
            continue
        if limb.part.hangs_on == limb.part.seen_from:
            below = [name for name in reversed(tree.movable(limb.end.link)) if name not in tree.movable(view.link)]
            sentence = _beside(poses, limb, start, [robot.description.joints[name] for name in below], tree)
            if sentence is not None:
                told.add(limb.part.start)
                _warn(sentence)
        if (
            end is not None
            and limb.part.start not in told
            and (sentence := _aside(poses, limb, start, end)) is not None
        ):
            told.add(limb.part.end)
            _warn(sentence)


def _other_joint(body_map: BodyMap, standing: StandingRobot, limb: Limb) -> bool:
    """Whether another joint bends the limb, or what hangs on it, than the one that was found to: then the map and what
    was found speak of different joints, and the one need not be measured by the other.
    """
    for bend in (direction for direction in body_map.directions if isinstance(direction, BendAxis)):
        if limb.part.name not in bend.part.limbs:
            continue
        outer = next(x for x in body_map.directions if isinstance(x, Limb) and x.part.name == bend.part.bent)
        centre = body_map.yardstick.centre(outer.part.start, bend.link)
        hinge = standing.line(body_map.robot.description.parent_joint[bend.link])
        if centre is not None and hinge.distance(standing.position(centre)) > _ELSEWHERE * _length(standing, outer):
            return True
    return False


def _warn(sentence: str) -> None:
    warnings.warn(sentence, InputWarning, stacklevel=4)


def _beside(
    poses: Sequence[StandingRobot], limb: Limb, centre: Point, joints: Sequence[Joint], tree: Ancestry
) -> str | None:
    """A sentence on the axis that a limb's start lies beside; None if it lies beside none.

    Args:
        poses: of the robot.
        limb: the limb.
        centre: where the axes cross.
        joints: those between what sees the limb and its end, from the body outwards.
        tree: the robot's.
    """
    start, length = limb.start, float(np.median([_length(pose, limb) for pose in poses]))
    worst, most = None, _OFF
    for joint in (joint for joint in joints if joint.rotary and _turn(poses, limb, joint, tree) > _SWING):
        near, far = (max(pose.line(joint).distance(pose.position(x)) for pose in poses) for x in (centre, start))
        if near <= max(_ELSEWHERE * length, _OFF) and far - near > most:
            worst, most = (joint.name, far), far - near
    if worst is None:
        return None
    return (
        f"robot.keypoints.{limb.part.start}: is {1000 * worst[1]:.0f} mm from the axis of '{worst[0]}', which turns "
        f"the {limb.part.name.replace('_', ' ')}, so that this points beside where it should; the axes that turn it "
        f"cross at {point_entry(limb.part.start, centre)}"
    )


def _turn(poses: Sequence[StandingRobot], limb: Limb, joint: Joint, tree: Ancestry) -> float:
    """By how much a limb turns, where a joint above its end does by a radian: the median over the poses."""
    moves_start = joint.name in tree.movable(limb.start.link)
    found = []
    for pose in poses:
        line, start_3, end_3 = pose.line(joint), pose.position(limb.start), pose.position(limb.end)
        lever_3 = end_3 - start_3 if moves_start else end_3 - line.nearest(end_3)
        found.append(float(np.linalg.norm(cross(line.axis_3, lever_3))) / max(_length(pose, limb), SHORT))
    return float(np.median(found))


def _length(pose: StandingRobot, limb: Limb) -> float:
    return float(np.linalg.norm(pose.position(limb.end) - pose.position(limb.start)))


def _aside(poses: Sequence[StandingRobot], limb: Limb, start: Point, end: Point) -> str | None:
    """A sentence on the end of a limb that points beside the line between two centres; None if it points along it."""
    angles, moved = [], []
    for pose in poses:
        here, there = ([pose.position(point) for point in ends] for ends in ((limb.start, limb.end), (start, end)))
        written_3, between_3 = unit(here[1] - here[0]), unit(there[1] - there[0])
        sine = np.linalg.norm(cross(written_3, between_3))
        angles.append(float(np.degrees(np.arctan2(sine, written_3 @ between_3))))
        moved.append([float(np.linalg.norm(a - b)) for a, b in zip(here, there, strict=True)])
    if float(np.median(angles)) <= _ASIDE:
        return None
    outer = float(np.mean(moved, axis=0).argmax()) > 0
    name, centre = (limb.part.end, end) if outer else (limb.part.start, start)
    return (
        f"robot.keypoints.{name}: the {limb.part.name.replace('_', ' ')} points {float(np.median(angles)):.0f} degrees "
        f"beside the line between its joints' centres; the robot's axes tell {point_entry(name, centre)}"
    )
