"""The reference retargeter's answer to one motion that comes with mrhubo, looked at before a fit: a second that shows
what a mapping is worth, and names the entry where it is worth little.

Legend: T frames, D measured directions, N robot joints.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from mrhubo.config.shipped import shipped_root
from mrhubo.errors import InputWarning
from mrhubo.evaluation import Clip, Motions, solve_references
from mrhubo.fitting.preparation import Prepared
from mrhubo.motion import Motion, read_motion, resample
from mrhubo.reference import DirectionProblem, OptimizationRetargeter, count_jumps, direction_error, limit_shares
from mrhubo.robot import Axis, BodyMap, Limb
from mrhubo.robot.bending import BendAxis
from mrhubo.robot.parts import LimbPart
from mrhubo.runtime.progress import Reporter

_MOTION, _RATE = "pointing", 8.0
"""Both arms up, aside, ahead and back, in 9 seconds; frames per second that show it in 75 frames."""
_LIMB_DEG = 5.0
"""Mean angle from which on a limb misses the human's: robots that can follow stay under 1."""
_AT_LIMIT = 0.5
"""Share of frames at a limit from which on a joint is named."""
_NARROW = 0.5
"""Radians of range below which a joint is at a limit often, whatever is meant."""
_BENT, _BACKWARDS = 25.0, 0.05
"""Degrees from which on an elbow is bent, and share of frames in which one may be so the wrong way."""
_NEAR, _TURNED_DEG = 0.2, 30.0
"""How far an entry may be from what the robot's axes tell, and agree with it: a share of the shortest limb, degrees."""


@dataclass(frozen=True)
class FirstLook:
    """What the reference made of the motion."""

    motion: str
    frames: int
    error_deg: Mapping[str, float]
    """Mean angle to the human by direction (`BodyMap.measured_names`)."""
    at_limit: Mapping[str, float]
    """Share of the frames in which a joint is at a limit, by joint."""
    backwards: Mapping[str, float]
    """Share of the frames in which an elbow is bent backwards, by its joint."""
    jumps: int
    doubts: tuple[str, ...]
    """What may be wrong with the mapping, a sentence each, with the likely entry."""

    def __str__(self) -> str:
        missed = _most({n: f"{angle:.1f}" for n, angle in self.error_deg.items() if angle >= 1.0}, self.error_deg)
        stuck = _most({n: f"{share:.0%}" for n, share in self.at_limit.items() if share >= 0.01}, self.at_limit)
        return (
            f"mapping, tried on '{self.motion}' ({self.frames} frames): the optimiser misses {missed or 'no direction'}"
            f"{' degrees' if missed else ' by a degree'}; at a limit {stuck or 'no joint'}; {self.jumps} jumps"
        )

    @property
    def metrics(self) -> dict[str, float]:
        """Under the names that a run has for them."""
        found = {f"mapping/error_deg/{name}": angle for name, angle in self.error_deg.items()}
        found |= {f"mapping/at_limit/{name}": share for name, share in self.at_limit.items()}
        found |= {f"mapping/backwards/{name}": share for name, share in self.backwards.items()}
        return {**found, "mapping/jumps": float(self.jumps)}


def _most(shown: Mapping[str, str], values: Mapping[str, float]) -> str:
    names = sorted(shown, key=lambda name: -values[name])[:6]
    return ", ".join(f"{name} {shown[name]}" for name in names)


@torch.no_grad()
def look_first(prepared: Prepared, report: Reporter) -> FirstLook:
    """Solves the motion, or reads the answer of an earlier time, says what it shows, and warns of what may be wrong."""
    body_map, motion = prepared.body_map, _motion(prepared.body_map)
    motions = Motions(_folder(), [], [motion])
    clip = solve_references(prepared.config, body_map, motions, prepared.references_dir)[1][0]
    found = judge(body_map, clip)
    report.say(str(found))
    for doubt in found.doubts:
        warnings.warn(doubt, InputWarning, stacklevel=2)
    return found


@torch.no_grad()
def look_at(body_map: BodyMap) -> FirstLook:
    """The same of a body map alone, without a place to keep the answer."""
    motion = _motion(body_map)
    reference = OptimizationRetargeter(body_map).retarget(motion.local_TJ33, motion.frame_rate)
    return judge(body_map, Clip(motion, reference.q_TN))


def _folder() -> Path:
    return shipped_root() / "data" / "motions"


def _motion(body_map: BodyMap) -> Motion:
    return resample(read_motion(_folder() / f"{_MOTION}.npz").for_skeleton(body_map.skeleton), _RATE)


def judge(body_map: BodyMap, clip: Clip) -> FirstLook:
    """What the reference's answer to a motion says about a mapping."""
    robot, q_TN, motion = body_map.robot, clip.reference_TN, clip.motion
    error_D = direction_error(body_map, q_TN, motion.local_TJ33).mean(dim=0)
    error_deg = dict(zip(body_map.measured_names, map(float, error_D), strict=True))
    at_limit = dict(zip(robot.joint_names, map(float, limit_shares(robot, q_TN)), strict=True))
    backwards = _backwards(body_map, q_TN)
    human_TD3 = body_map.human_directions(motion.local_TJ33)
    jumps = count_jumps(DirectionProblem(body_map), q_TN, human_TD3, motion.frame_rate)
    doubts = [
        *_missed_limbs(body_map, error_deg),
        *_stuck_joints(body_map, at_limit),
        *_turned_elbows(body_map, backwards),
        *unknown_collisions(body_map),
    ]
    if jumps:
        doubts.append(f"robot.keypoints: the joints jump {jumps} times on '{motion.name}', where the human does not")
    return FirstLook(motion.name, len(motion), error_deg, at_limit, backwards, jumps, tuple(doubts))


def _missed_limbs(body_map: BodyMap, error_deg: Mapping[str, float]) -> list[str]:
    found = []
    for limb in (direction for direction in body_map.directions if isinstance(direction, Limb)):
        names = _doubtful(body_map, (limb.part.start, limb.part.end)) if error_deg[limb.name] > _LIMB_DEG else []
        if names:
            found.append(
                f"robot.keypoints.{names[0]}: the {limb.part.name.replace('_', ' ')} misses the human's by "
                f"{error_deg[limb.name]:.0f} degrees{_remedy(body_map, names)}"
            )
    return found


def _stuck_joints(body_map: BodyMap, at_limit: Mapping[str, float]) -> list[str]:
    robot, found = body_map.robot, []
    wide_N = robot.upper_N - robot.lower_N > _NARROW
    entries = _entries_of(body_map)
    for joint, wide in zip(robot.joint_names, wide_N.tolist(), strict=True):
        names = _doubtful(body_map, entries[joint]) if at_limit[joint] > _AT_LIMIT and wide else []
        if names:
            found.append(
                f"robot.keypoints.{names[0]}: the joint '{joint}' is at a limit in {at_limit[joint]:.0%} of the "
                f"frames{_remedy(body_map, names[:1])}"
            )
    return found


def _remedy(body_map: BodyMap, names: Sequence[str]) -> str:
    """What entries should be, where the axes tell others; else that it may be the robot's build."""
    yardstick = body_map.yardstick
    advice = yardstick.advice(*names, given=body_map.keypoints)
    if advice or yardstick.found is None:
        return f", so this entry may be wrong{advice}"
    return "; the robot's joints may reach no farther, or this entry may be wrong: look at the picture"


def _turned_elbows(body_map: BodyMap, backwards: Mapping[str, float]) -> list[str]:
    known = body_map.yardstick.found
    found = []
    for joint, share in backwards.items():
        if share > _BACKWARDS:
            range_ = None if known is None else known.ranges.get(joint)
            advice = "" if range_ is None else f": {joint}: [{range_.lower:.4g}, {range_.upper:.4g}]"
            found.append(
                f"robot.ranges.{joint}: the limb is bent backwards in {share:.0%} of the frames; narrow this joint to "
                f"the side on which a human's bends{advice}"
            )
    return found


def unknown_collisions(body_map: BodyMap) -> list[str]:
    """A sentence where nobody knows whether the robot touches itself, for want of shapes; else none."""
    why = body_map.collision.why_unknown()
    return [] if why is None else [why]


def _entries_of(body_map: BodyMap) -> dict[str, list[str]]:
    """By joint, the entries that its angle hangs on: of the limbs that it turns, from where the first of them starts
    outwards, then of the oriented parts.
    """
    robot, by_name = body_map.robot, {part.name: part for part in body_map.keypoints.parts}
    q_BN = robot.sample(4, torch.Generator().manual_seed(0))
    before_BD3 = body_map.robot_directions(robot.forward(q_BN))
    found = {}
    for column, joint in enumerate(robot.joint_names):
        turned = q_BN.clone()
        turned[:, column] = (robot.lower_N + robot.upper_N)[column] - q_BN[:, column]  # mirrored in its range
        change_D = (body_map.robot_directions(robot.forward(turned)) - before_BD3).abs().amax(dim=(0, 2))
        names: list[str] = []
        for direction in (d for d, change in zip(body_map.directions, change_D.tolist(), strict=True) if change > 1e-3):
            chain = [direction.part]
            while isinstance(chain[0], LimbPart) and isinstance(
                inner := by_name.get(chain[0].hangs_on or ""), LimbPart
            ):
                chain.insert(0, inner)
            for part in chain:
                names += [part.start, part.end] if isinstance(part, LimbPart) else []
            names += [direction.part.name] if isinstance(direction, Axis) else []
        found[joint] = list(dict.fromkeys(names))
    return found


def _doubtful(body_map: BodyMap, names: Iterable[str]) -> list[str]:
    """Those of some entries that are not where the robot's axes have them; where all are, it is the robot's build that
    is amiss.
    """
    return [name for name in names if not agrees(body_map, name)]


def agrees(body_map: BodyMap, name: str) -> bool:
    """Whether an entry is where the robot's axes have it."""
    keypoints, yardstick = body_map.keypoints, body_map.yardstick
    if name in keypoints.ends:
        turned = yardstick.turned(keypoints.ends[name], name)
        return turned is not None and turned < _TURNED_DEG
    distance = yardstick.distance(name, keypoints.points[name])
    view = body_map.shared.view_robot(body_map.robot.forward(body_map.robot.home()[None]))
    shortest = float((view.end_BE3 - view.start_BE3).norm(dim=-1).amin())
    return distance is not None and distance < _NEAR * shortest


def _backwards(body_map: BodyMap, q_TN: Tensor) -> dict[str, float]:
    """Share of the frames in which an elbow is bent the other way than its hinge does by a positive angle."""
    robot = body_map.robot
    poses = robot.forward(q_TN)
    view = body_map.shared.view_robot(poses)
    along_TE3 = torch.nn.functional.normalize(view.end_BE3 - view.start_BE3, dim=-1)
    limbs = [direction.part.name for direction in body_map.directions if isinstance(direction, Limb)]
    found = {}
    for bend in (direction for direction in body_map.directions if isinstance(direction, BendAxis)):
        upper_T3, lower_T3 = (along_TE3[:, limbs.index(name)] for name in bend.part.limbs)
        cross_T3 = torch.linalg.cross(upper_T3, lower_T3)
        hinge_T3 = poses.rotation_BL33[:, robot.link_index(bend.link)] @ bend.axis_3
        bent_T = torch.rad2deg(torch.atan2(cross_T3.norm(dim=-1), (upper_T3 * lower_T3).sum(-1))) > _BENT
        wrong_T = bent_T & ((cross_T3 * hinge_T3).sum(-1) < 0)
        found[robot.description.parent_joint[bend.link].name] = float(wrong_T.float().mean())
    return found
