"""Whether a limb starts where the axes that turn it pass: an upper arm at the crossing of the shoulder's axes.

The link that a name suggests may lie a hand's breadth from there, and then the upper arm points 10 to 30 degrees beside
where it should, in every pose, while every error that is measured with the same wrong point stays small.

Legend: S poses.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import torch

from mrhubo.errors import InputWarning
from mrhubo.robot.ancestry import Ancestry
from mrhubo.robot.axis_lines import StandingRobot
from mrhubo.robot.capsules import SHORT
from mrhubo.robot.entries import Point
from mrhubo.robot.joint import Joint
from mrhubo.robot.keypoints import Limb
from mrhubo.robot.suggestions import point_entry

if TYPE_CHECKING:
    from mrhubo.robot.body_map import BodyMap

_POSES = 3
"""Random poses besides the one in which the joints are at 0: a point that does not move with a limb shows in them."""
_OFF = 0.02
"""Metres by which a point may be farther from an axis than the centre is: 5 degrees of an upper arm of 25 cm, and more
than the axes of small robots lie beside each other (15 mm on NAO)."""
_EARLY = 3
"""Swinging axes among which the two of the shoulder are looked for: a clavicle's may come before, an elbow's after."""
_SWING, _TWIST = 0.5, 0.9
"""How much of its turn a limb must turn by where an axis swings it; cosine of the angle to an axis that twists it."""


def check_starts(body_map: BodyMap) -> None:
    """Warns of limbs that hang on the body and start beside the axes that turn them."""
    robot, tree = body_map.robot, Ancestry(body_map.robot)
    q_SN = torch.cat((robot.home()[None], robot.sample(_POSES, torch.Generator().manual_seed(0)))).cpu().numpy()
    poses = [StandingRobot(robot.description, robot.configuration(q_N)) for q_N in q_SN]
    for limb in (direction for direction in body_map.keypoints.directions if isinstance(direction, Limb)):
        view = body_map.keypoints.ends[limb.part.seen_from or ""]
        if limb.part.hangs_on != limb.part.seen_from or tree.is_inward(limb, view):
            continue
        below = [name for name in reversed(tree.movable(limb.end.link)) if name not in tree.movable(view.link)]
        turning = _Turning(poses, limb, [robot.description.joints[name] for name in below], tree)
        if (sentence := turning.fault()) is not None:
            warnings.warn(sentence, InputWarning, stacklevel=2)


class _Turning:
    """The axes that turn one limb, in some poses; the first has all joints at 0."""

    def __init__(self, poses: Sequence[StandingRobot], limb: Limb, joints: Sequence[Joint], tree: Ancestry) -> None:
        """`joints` are those between what sees the limb and its end, from the body outwards."""
        self._poses, self._limb, self._tree = poses, limb, tree
        rotary = [joint for joint in joints if joint.rotary]
        self.swinging = [joint for joint in rotary if self._turn(joint) > _SWING]
        self.twisting = [joint for joint in rotary if joint not in self.swinging and self._along(joint) > _TWIST]

    def _turn(self, joint: Joint) -> float:
        """By how much the limb turns, where the joint does by a radian: the median over the poses."""
        moves_start = joint.name in self._tree.movable(self._limb.start.link)
        found = []
        for pose in self._poses:
            line, start_3, end_3 = pose.line(joint), pose.position(self._limb.start), pose.position(self._limb.end)
            lever_3 = end_3 - start_3 if moves_start else end_3 - line.foot(end_3)
            length = max(float(np.linalg.norm(end_3 - start_3)), SHORT)
            found.append(float(np.linalg.norm(np.cross(line.along_3, lever_3))) / length)
        return float(np.median(found))

    def _along(self, joint: Joint) -> float:
        """Cosine of the angle between the axis and the limb: the median over the poses."""
        found = []
        for pose in self._poses:
            limb_3 = pose.position(self._limb.end) - pose.position(self._limb.start)
            found.append(abs(float(limb_3 @ pose.line(joint).along_3)) / max(float(np.linalg.norm(limb_3)), SHORT))
        return float(np.median(found))

    def fault(self) -> str | None:
        """What is wrong with where the limb starts, as a sentence; None if nothing is."""
        if not self.swinging:
            return None
        centre, pair = self._centre()
        start, limb = self._limb.start, self._limb.part
        far = {joint.name: self._distance(joint, start) for joint in (*pair, *self.twisting[:1])}
        near = {joint.name: self._distance(joint, centre) for joint in (*pair, *self.twisting[:1])}
        worst = max(far, key=lambda name: far[name] - near[name])
        if far[worst] - near[worst] <= _OFF:
            return None
        return (
            f"robot.keypoints.{limb.start}: '{start.link}' is {1000 * far[worst]:.0f} mm beside the axis of '{worst}', "
            f"which turns the {limb.name.replace('_', ' ')}, so that this points beside where it should; the axes cross "
            f"at {point_entry(limb.start, centre)}"
        )

    def _distance(self, joint: Joint, point: Point) -> float:
        return max(pose.line(joint).distance(pose.position(point)) for pose in self._poses)

    def _centre(self) -> tuple[Point, list[Joint]]:
        """Where the axes cross, on a link that moves with the limb; and which axes swing it there.

        They are the two of the first few that pass each other nearest. The centre is on the axis about which the limb
        twists, where it is nearest to the outer of the two.
        """
        home, early = self._poses[0], self.swinging[:_EARLY]
        pairs = list(itertools.combinations(early, 2))
        pair = min(pairs, key=lambda two: home.line(two[0]).gap(home.line(two[1]))) if pairs else early
        lines = [home.line(joint) for joint in pair]
        along = next((home.line(joint) for joint in self.twisting), None)
        if along is not None:
            centre_3 = along.nearest(lines[-1])
        elif pairs:
            centre_3 = lines[1].nearest(lines[0])
        else:
            centre_3 = lines[0].foot(home.position(self._limb.start))
        needed = {joint.name for joint in pair}
        outside = {joint.name for joint in self._joints_beyond(pair[-1])}
        own = self._tree.movable(self._limb.start.link)
        link = self._limb.start.link if needed <= own.keys() and not outside & own.keys() else pair[-1].child
        return home.on_link(link, centre_3), list(pair)

    def _joints_beyond(self, joint: Joint) -> list[Joint]:
        """The axes that swing the limb beyond a joint of the shoulder: an elbow's, say."""
        return self.swinging[self.swinging.index(joint) + 1 :]
