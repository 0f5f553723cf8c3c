"""The only arm of a robot that has one, and the plane between left and right, which no second arm tells.

A robot arm by itself is no humanoid. What tells the two apart: a humanoid has legs, a head, or a trunk by its name, and
its arm begins beside the middle of that.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mrhubo.robot.discovery import names
from mrhubo.robot.discovery.arm import read_arm
from mrhubo.robot.discovery.bodies import Bodies, Chain, Hinge, Step, lines_of
from mrhubo.robot.discovery.limbs import limb
from mrhubo.robot.discovery.lines import measure
from mrhubo.robot.discovery.necks import in_plane, is_named
from mrhubo.robot.discovery.roles import looks_like_legs
from mrhubo.robot.discovery.symmetry import Pair

_FEWEST = 3
"""Joints of an arm by itself at least: two may be anything."""
_BESIDE = 0.1
"""How far beside the middle an arm begins at least, as a share of its length; a human's 0.3."""
_LIKE = 0.5
"""Length of another limb, as a share of the arm, that may be the other arm, and not the same on both sides."""
_UPRIGHT = 0.5
"""Cosine of how far a mirror plane may lean that only the trunk tells, by the file's z."""
_SHORT, _LOW = 0.15, 0.25
"""Length of an arm, and of legs, at least, as a share of the robot's size; a finger's is less, at the end of an arm."""
_HEAD = 2
"""Joints of a neck at least that no name tells."""


@dataclass(frozen=True)
class LoneArm:
    """An arm whose mirror image is missing."""

    chain: Chain
    normal_3: np.ndarray
    """Across the mirror plane, unit."""
    middle_3: np.ndarray
    """A point of it."""
    cue: str
    """What tells that it is no robot arm by itself."""
    doubt: str | None
    """What of it was guessed, if anything."""


@dataclass(frozen=True)
class _Plane:
    normal_3: np.ndarray
    middle_3: np.ndarray
    hinges: int
    """How many joints of the trunk are their own mirror images."""

    def beside(self, point_3: np.ndarray) -> float:
        """How far a point is from it [m]."""
        return abs(float((point_3 - self.middle_3) @ self.normal_3))


def find_lone_arm(bodies: Bodies, pairs: Sequence[Pair]) -> LoneArm | None:
    """The only arm of a humanoid; None where there is none, or more than one limb may be it.

    Args:
        bodies: the robot.
        pairs: its limbs that have a mirror image.
    """
    # One that begins with the trunk's joints is found there once more, and one that a linkage joins, as its forearm.
    arms = (_as_arm(bodies, chain, pairs) for chain in _limbs(bodies, pairs))
    found = {arm.chain[0].hinge: arm for arm in arms if arm is not None}
    parts = {step.hinge for arm in found.values() for step in arm.chain[1:]}
    found = {hinge: arm for hinge, arm in found.items() if hinge not in parts}
    longest = max(map(bodies.extent, (arm.chain[0] for arm in found.values())), default=0.0)
    likely = [arm for arm in found.values() if bodies.extent(arm.chain[0]) > _LIKE * longest]
    return likely[0] if len(likely) == 1 else None


def _limbs(bodies: Bodies, pairs: Sequence[Pair]) -> Iterator[Chain]:
    """The limbs that are none of a pair, and carry none."""
    paired = {hinge for pair in pairs for chain in pair.chains for hinge in bodies.beyond(chain[0])[1]}
    root = bodies.body_of[bodies.description.root]
    for body, steps in enumerate(bodies.steps_from):
        down = [step for step in steps if step.hinge.bodies[0] == body]
        if len(down) < 2 and body != root:
            continue  # within a limb
        for step in down:
            if step.hinge in paired or _carries(bodies, step, pairs):
                continue
            chain = limb(bodies, step)
            if sum(step.hinge.rotary for step in chain) >= _FEWEST:
                yield chain


def _carries(bodies: Bodies, step: Step, pairs: Sequence[Pair]) -> bool:
    """Whether a branch carries a pair of limbs about as long as itself, as a trunk does; fingers are shorter."""
    inside = bodies.beyond(step)[0]
    return any(pair.body in inside and pair.size > _LIKE * bodies.extent(step) for pair in pairs)


def _as_arm(bodies: Bodies, chain: Chain, pairs: Sequence[Pair]) -> LoneArm | None:
    inside = bodies.beyond(chain[0])[0]
    outer = [pair for pair in pairs if pair.body not in inside]
    size = bodies.extent(chain[0])
    if size < _SHORT * bodies.size:
        return None
    for plane in _planes(bodies, chain, outer):
        others = {part[0].hinge for pair in outer for part in pair.chains}
        first, clear = _first(bodies, chain, plane, others)
        arm = chain[first:]
        nodes_N3 = measure(lines_of(arm)).nodes_N3 if arm else np.zeros((0, 3))
        begins = next((i for i, at_3 in enumerate(nodes_N3) if plane.beside(at_3) > _BESIDE * size), len(arm))
        if sum(step.hinge.rotary for step in arm[begins:]) < _FEWEST or read_arm(bodies, arm) is None:
            continue
        if (cue := _humanoid(bodies, arm, plane, outer, others)) is not None:
            doubt = None if clear else "which joints before it turn the trunk"
            # Of limbs and wheels, there is no pair.
            doubt = doubt if outer else "where the middle of the trunk is"
            return LoneArm(arm, plane.normal_3, plane.middle_3, cue, doubt)
    return None


def _first(bodies: Bodies, chain: Chain, plane: _Plane, others: set[Hinge]) -> tuple[int, bool]:
    """How many joints of a chain turn the trunk, before the arm, and whether that is clear: as many as carry a neck
    too; else those in the middle.
    """
    middle, hinges = 0, {step.hinge for step in chain}
    while middle < len(chain) and in_plane(chain[middle], plane.normal_3, plane.middle_3, bodies.size):
        middle += 1
    carriers = [chain[0].start, *(step.end for step in chain[:middle])]
    necks = [i for i, body in enumerate(carriers) if _has_neck(bodies, body, plane, others | hinges)]
    if necks:
        return necks[-1], True
    # A lateral axis is its own mirror image wherever it is, and any may be a clavicle's: names tell more.
    named = [i + 1 for i in range(middle) if is_named(chain[i : i + 1], "waist")]
    arms = [i for i in range(middle) if is_named(chain[i : i + 1], "arm")]
    if (named or arms) and max(named, default=0) == min(arms, default=middle):
        return min(arms, default=middle), True
    nodes_N3 = measure(lines_of(chain)).nodes_N3
    far = [i for i in range(middle) if plane.beside(nodes_N3[i]) > _BESIDE * bodies.extent(chain[0])]
    return min([*arms, *(i for i in far if i >= max(named, default=0)), middle]), not middle


def _has_neck(bodies: Bodies, chest: int, plane: _Plane, others: set[Hinge]) -> bool:
    """Whether a body carries a neck: joints in the mirror plane, named so or not fewer than a head has, and none of
    others.
    """
    for step in bodies.steps_from[chest]:
        if step.hinge in others or step.hinge.bodies[0] != chest:
            continue
        neck: list[Step] = []
        on: Step | None = step
        while on is not None and on.hinge.rotary and in_plane(on, plane.normal_3, plane.middle_3, bodies.size):
            neck.append(on)
            further = bodies.onward(on)
            on = further[0] if len(further) == 1 else None
        if is_named(tuple(neck)) or (len(neck) >= _HEAD and all(step.hinge.limited for step in neck)):
            return True
    return False


def _planes(bodies: Bodies, chain: Chain, outer: Sequence[Pair]) -> list[_Plane]:
    """Mirror planes that other pairs of limbs tell, the largest first; else upright ones of most trunk joints."""
    if outer:
        return [_Plane(pair.normal_3, pair.mounts_23.mean(0), 0) for pair in outer]
    inside = bodies.beyond(chain[0])[1]
    trunk = [hinge for hinge in bodies.hinges if hinge.rotary and hinge not in inside]
    if names.speaks_of(chain[0].hinge.name, "waist"):
        trunk.append(chain[0].hinge)
    carrier = bodies.links_of[chain[0].start][0]
    normals = [*np.eye(3), *bodies.pose_44[carrier][:3, :3].T, *(hinge.line.axis_3 for hinge in trunk)]
    points = [hinge.line.point_3 for hinge in trunk] or [bodies.position(carrier)]
    end_3 = measure(lines_of(chain)).nodes_N3[-1]
    found = [
        _Plane(normal_3, point_3, sum(_own_image(hinge, normal_3, point_3, bodies.size) for hinge in trunk))
        for normal_3 in normals if abs(float(normal_3[2])) < _UPRIGHT
        for point_3 in points
    ]  # fmt: skip
    found.sort(key=lambda plane: (-plane.hinges, -round(plane.beside(end_3), 6)))
    return [plane for plane in found if plane.hinges == found[0].hinges]


def _own_image(hinge: Hinge, normal_3: np.ndarray, middle_3: np.ndarray, size: float) -> bool:
    return in_plane(Step(hinge, hinge.bodies[0]), normal_3, middle_3, size)


def _humanoid(bodies: Bodies, arm: Chain, plane: _Plane, outer: Sequence[Pair], others: set[Hinge]) -> str | None:
    """What tells that an arm belongs to a humanoid."""
    for pair in outer:
        if pair.size > _LOW * bodies.size and looks_like_legs(bodies, pair):
            return "there are legs"
    chest = arm[0].start
    if _has_neck(bodies, chest, plane, {*others, *(step.hinge for step in arm)}):
        return "there is a head"
    trunk = [name for name in bodies.links_of[chest] if names.speaks_of(name, "trunk")]
    return f"'{trunk[0]}' is called a trunk" if trunk else None
