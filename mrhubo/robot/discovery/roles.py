"""Which pair of limbs is arms and which legs, and what lies between: chest, pelvis, waist, neck."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrhubo.errors import UserError
from mrhubo.robot.discovery import names
from mrhubo.robot.discovery.arm import GUESS, read_arm
from mrhubo.robot.discovery.bases import without_base
from mrhubo.robot.discovery.bodies import Bodies, Chain, Step, lines_of
from mrhubo.robot.discovery.elbow import find_elbow
from mrhubo.robot.discovery.gripper import without_gripper
from mrhubo.robot.discovery.leg import read_leg
from mrhubo.robot.discovery.lines import PARALLEL, measure, sine, unit
from mrhubo.robot.discovery.necks import find_necks, is_named
from mrhubo.robot.discovery.no_arms import no_arms, why_no_arms
from mrhubo.robot.discovery.symmetry import Pair, alike

_TINY = 0.1
"""The same of the robot's size: fingers of a single arm."""
_SMALL = 0.25
"""Limbs shorter than this share of the longest pair are no limbs: wheels, eyes, antennas."""
_ACROSS, _MIDDLE = 0.3, 0.03
"""Cosine under which two mirror planes are at right angles, and how far from one a chain begins that lies in it, as a
share of the robot's size."""
_ARM = 4
"""Joints of an arm with a whole shoulder."""
_LEG = 3
"""Joints of a leg at the least: with fewer, it may be a wing."""
_CASTER = 2
"""Joints of a caster: it swivels and rolls."""
_LIKE = 0.6
"""How long a further pair of limbs is at least that may be arms, as a share of the arms."""
_MANY = 6
"""Joints of an arm that reaches anywhere in any way; no leg of a four-legged robot has as many."""


@dataclass(frozen=True)
class Roles:
    """The limbs and the trunk of a robot."""

    arms: Pair
    legs: Pair | None
    waist: Chain
    """From the pelvis to the chest; without legs, from the root to the chest."""
    neck: Chain
    necks: tuple[Chain, ...]
    """Other chains in the middle that may be the neck, likeliest first."""
    others: tuple[Pair, ...]
    """Pairs that are neither."""
    sure: float
    """How clear it is which pair is arms, 0..1."""

    def with_neck(self, neck: Chain) -> Roles:
        """With another neck, or none; what else begins in the middle of a root that is the chest is the waist."""
        rest = (_trunk(chain) for chain in self.necks if chain is not neck)
        below = next(iter(sorted(filter(None, rest), key=lambda chain: not is_named(chain, "waist"))), ())
        return replace(self, neck=neck, waist=self.waist or (_reversed(below) if self.legs is None else ()))

    @property
    def more_arms(self) -> tuple[Pair, ...]:
        """Further pairs of limbs, about as long as the arms and with as many joints, on the same body."""
        arms = self.arms
        return tuple(
            pair for pair in self.others
            if pair.body == arms.body and pair.size > _LIKE * arms.size and len(pair.chains[0]) >= len(arms.chains[0])
        )  # fmt: skip

    @property
    def chest(self) -> int:
        """The body that carries both arms."""
        return self.arms.body


def _trunk(chain: Chain) -> Chain:
    """The joints of a chain before those that names call an arm's or a tail's, and no waist's."""

    def called(step: Step, *kinds: str) -> bool:
        return any(is_named((step,), kind) for kind in kinds)

    return tuple(itertools.takewhile(lambda step: called(step, "waist") or not called(step, "arm", "tail"), chain))


def _reversed(chain: Chain) -> Chain:
    """A chain passed from its other end."""
    return tuple(Step(step.hinge, step.end) for step in reversed(chain))


def find_roles(bodies: Bodies, pairs: Sequence[Pair]) -> Roles:
    """Arms, legs and trunk.

    Raises:
        NoArms: no pair of arms can be told; says what the robot has.
        UserError: it is no humanoid.
    """
    path = bodies.description.path
    least = max(_SMALL * max((pair.size for pair in pairs), default=0.0), _TINY * bodies.size)
    # By shapes too, as those of a forearm beyond an elbow that is the last joint.
    large = [pair for pair in pairs if max(pair.size, min(bodies.span(chain[0]) for chain in pair.chains)) > least]
    armed = [pair for pair in large if all(read_arm(bodies, chain) is not None for chain in pair.chains)]
    # Casters have two joints too, but none of them has limits; nor has any joint of some files, or of some legs.
    armed = [
        pair for pair in armed
        if len(pair.chains[0]) > _CASTER or any(step.hinge.limited for step in pair.chains[0])
        or _folds(pair.chains[0]) or _named_arms(pair)
    ]  # fmt: skip
    if not armed:
        count = len(bodies.hinges)
        raise no_arms(bodies)(
            f"{path}: no two arms were found: no body of the robot carries two limbs of at least two rotary joints "
            f"that are mirror images ({count} movable joint{'s' * (count != 1)} in all), nor one arm beside the middle "
            "of legs, a head or a trunk; of other robots a config is written by hand "
            f"(docs/robots.md){why_no_arms(bodies)}"
        )
    read = {id(pair) for pair in armed}
    # A waist and a neck that are alike, one below the chest and one above, are no limbs.
    armed = [pair for pair in armed if not any(_between(bodies, pair, other) for other in armed)]
    # What stands for an elbow in a leg is its knee, but for one whose hip turns about the thigh alone.
    arms_count = len(armed)
    armed += [pair for pair in large if id(pair) not in read and _has_knees(bodies, pair)]
    legness = {id(pair): _legness(bodies, pair) for pair in armed}
    fronts = _fronts(armed)
    if len(armed) == 1:
        stands = legness[id(armed[0])] > 0.0 and _stands(bodies, armed[0]) and not _named_arms(armed[0])
        if stands or _named_legs(armed[0]):
            joints = ", ".join(f"'{step.hinge.name}'" for step in armed[0].chains[0])
            raise no_arms(bodies)(
                f"{path}: the only pair of limbs looks like legs ({joints}), and no arms were "
                f"found{why_no_arms(bodies)}"
            )
        arms, legs, sure = armed[0], None, 1.0 if legness[id(armed[0])] < 0.5 else 0.6
    elif fronts:
        arms, legs, sure = fronts[0], None, 1.0
    else:
        options = [
            (legness[id(low)] - legness[id(high)] + 2.0 * _hangs_below(low, high) + 2.0 * _whole_arm(high), i, j)
            for i, low in enumerate(armed) for j, high in enumerate(armed[:arms_count]) if i != j
        ]  # fmt: skip
        options.sort(key=lambda option: -option[0])
        score, i, j = options[0]
        if _same(armed[i], armed[j]):
            different = [option for option in options if not _same(armed[option[1]], armed[option[2]])]
            if not different:
                raise UserError(
                    f"{path}: has two pairs of limbs that are alike, as a four-legged robot has; a humanoid is needed"
                )
            score, i, j = different[0]
        arms, legs = armed[j], armed[i]
        reverse = next((option[0] for option in options if option[1:] == (j, i)), 0.0)
        sure = float(np.clip(0.5 + 0.25 * (score - reverse), 0.0, 1.0))
        if _named_legs(arms):
            raise UserError(
                f"{path}: has {len(armed)} pairs of limbs that all look like legs, and no arms; a humanoid is needed"
            )
    if _are_fingers(arms):
        raise UserError(
            f"{path}: the limbs that are like arms are fingers by their names, as a hand alone has; a humanoid is "
            f"needed{why_no_arms(bodies)}"
        )
    # A third pair beside the arms, and longer, may be the arms; legs of few joints may be wings, if no name tells.
    spare = [pair for pair in armed if pair is not arms and pair is not legs and pair.body == arms.body]
    winged = legs is not None and len(legs.chains[0]) < _LEG and not _named_legs(legs)
    if winged or any(pair.size > arms.size for pair in spare):
        sure = min(sure, GUESS)
    if legs is not None and float(legs.normal_3 @ arms.normal_3) < 0:
        legs = legs.flipped()  # whichever side is left, both pairs begin with the same one
    start = legs.body if legs is not None else bodies.body_of[bodies.description.root]
    waist = bodies.path(start, arms.body)
    same = [pair for pair in pairs if abs(float(pair.normal_3 @ arms.normal_3)) > 0.95]
    used = {chain[0].hinge.name for pair in same for chain in pair.chains}
    if legs is None and any(names.speaks_of(step.hinge.name, "head") for step in waist):
        waist = ()  # the root is the head
    if {step.hinge for step in waist} & {step.hinge for chain in arms.chains for step in chain}:
        waist = ()  # the root is a hand
    used |= {step.hinge.name for step in waist}
    necks = find_necks(bodies, arms, used)
    arm = arms.chains[0]
    if any(len(neck) == len(arm) == alike(measure(lines_of(neck)), measure(lines_of(arm))) for neck in necks):
        raise UserError(f"{path}: has three limbs or more that are alike, as a hand has; a humanoid is needed")
    taken = {chain[0].hinge for pair in (arms, legs) if pair is not None for chain in pair.chains}
    others = tuple(pair for pair in pairs if not taken & {chain[0].hinge for chain in pair.chains})
    if legs is None:
        waist = without_base(waist, bodies.size)
    return Roles(arms, legs, waist, necks[0] if necks else (), necks, others, sure)


def _folds(chain: Chain) -> bool:
    """Whether all axes of a limb are parallel, as those of a shoulder and an elbow may be; a caster's are not."""
    lines = lines_of(chain)
    return all(sine(line.axis_3, lines[0].axis_3) < PARALLEL for line in lines)


def looks_like_legs(bodies: Bodies, pair: Pair) -> bool:
    """Whether a pair of limbs has knees between parallel axes, or is like legs by its axes and names."""
    return _has_knees(bodies, pair) or _legness(bodies, pair) > 0.0 or _named_legs(pair)


def _has_knees(bodies: Bodies, pair: Pair) -> bool:
    """Whether parallel axes tell the knees of both of its limbs."""
    return all((leg := read_leg(bodies, chain)) is not None and leg.straight for chain in pair.chains)


def _between(bodies: Bodies, pair: Pair, other: Pair) -> bool:
    """Whether a pair begins in the mirror plane of a larger one, and is mirrored across it: what is in the middle."""
    apart = (pair.mounts_23 - other.mounts_23.mean(0)) @ other.normal_3
    across = abs(float(pair.normal_3 @ other.normal_3)) < _ACROSS
    return across and other.size > pair.size and float(np.abs(apart).max()) < _MIDDLE * bodies.size


def _legness(bodies: Bodies, pair: Pair) -> float:
    """About -2 (arms) to 2 (legs)."""
    called = [name for chain in pair.chains for step in chain for name in (step.hinge.name, step.outer_link)]
    score = names.share(called, "leg") - names.share(called, "arm")
    chain = without_gripper(bodies, pair.chains[0])
    end = chain[-1]
    beyond = [hinge for hinge in bodies.beyond(end)[1] if hinge is not end.hinge]
    if len(beyond) >= 2:
        score -= 0.5
    lines = lines_of(chain)
    found, knee_at = measure(lines), find_elbow(bodies, chain)
    if knee_at is not None and knee_at + 1 < len(chain):
        way = max(found.out_N[-1], 1e-9)
        shank = sum(
            found.apart_N[i] for i in range(knee_at, len(chain) - 1)
            if sine(lines[i].axis_3, lines[i + 1].axis_3) < PARALLEL or found.apart_N[i] > 0.2 * way
        )  # fmt: skip
        twisted = sum(found.along_N[knee_at + 1 :])
        score += 0.7 * (shank / way > 0.2) - 0.7 * (twisted / way > 0.2)
        lateral = [i for i in range(len(lines)) if sine(lines[i].axis_3, lines[knee_at].axis_3) < 0.2]
        score += 0.4 * (len(lateral) >= 3 and knee_at in lateral[1:-1] and shank / way > 0.2)
    return score


def _whole_arm(pair: Pair) -> float:
    """0..1: whether a pair has as many joints as arms: a whole shoulder and an elbow."""
    return min(len(pair.chains[0]) / _ARM, 1.0)


def _named_legs(pair: Pair) -> bool:
    """Whether names speak of legs, and not of arms."""
    called = [name for chain in pair.chains for step in chain for name in (step.hinge.name, step.outer_link)]
    return names.share(called, "leg") > 0.25 and names.share(called, "arm") == 0


def _named_arms(pair: Pair) -> bool:
    """Whether most names speak of arms, and none of legs, as of arms that hang lower than what carries them."""
    called = [name for chain in pair.chains for step in chain for name in (step.hinge.name, step.outer_link)]
    return names.share(called, "arm") > 0.5 and names.share(called, "leg") == 0


def _are_fingers(pair: Pair) -> bool:
    """Whether the names of all joints of both limbs speak of what moves in a hand."""
    return all(names.speaks_of(step.hinge.name, "hand") for chain in pair.chains for step in chain)


def _stands(bodies: Bodies, pair: Pair) -> bool:
    """Whether a pair of limbs ends beyond all else, in the direction in which it hangs, which is down in the file."""
    ends_3 = np.mean([measure(lines_of(chain)).nodes_N3[-1] for chain in pair.chains], axis=0)
    out_3 = unit(ends_3 - pair.mounts_23.mean(0))
    limbs = set().union(*(bodies.beyond(chain[0])[0] for chain in pair.chains))
    rest = [body for body in range(len(bodies.links_of)) if body not in limbs]
    lowest = max(float((bodies.corners(body) @ out_3).max()) for body in rest)
    return out_3[2] < -0.7 and lowest < float(ends_3 @ out_3)


def _same(one: Pair, other: Pair) -> bool:
    """Whether two pairs have the same limbs: the legs of a four-legged robot."""
    measures = [measure(lines_of(pair.chains[0])) for pair in (one, other)]
    count = len(one.chains[0])
    return one.body == other.body and count == len(other.chains[0]) == alike(*measures)


def _fronts(armed: Sequence[Pair]) -> list[Pair]:
    """All pairs, the foremost first by the file's x, where they are alike, and of too many joints for legs: a table or
    cart with two pairs of arms, of which somebody leads one by hand. None of other robots.
    """
    alike = len(armed) > 1 and all(_same(armed[0], pair) and len(pair.chains[0]) >= _MANY for pair in armed)
    return sorted(armed, key=lambda pair: -float(pair.mounts_23[:, 0].mean())) if alike else []


def _hangs_below(low: Pair, high: Pair) -> float:
    """-1..1: whether the lower pair's limbs hang away from where the upper pair begins."""
    ends = np.mean([measure(lines_of(chain)).nodes_N3[-1] for chain in low.chains], axis=0)
    mount_3, other_3 = low.mounts_23.mean(0), high.mounts_23.mean(0)
    if np.linalg.norm(other_3 - mount_3) < 1e-3 * low.size:
        return 0.0
    return float(unit(mount_3 - ends) @ unit(other_3 - mount_3))
