"""Which joint of a tree is which of a body's: by structure first, by names second, never by order.

Pairs of limbs alike are looked for; the two pairs that fit a body best are legs and arms; what carries them is pelvis
and chest; what else hangs on the chest is the head. Left is where left is for a body whose toes point forward and whose
knees bend backward.

Legend: F frames.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from mrhubo.errors import UserError
from mrhubo.fast.rotations import turned
from mrhubo.motion.readers.tree.hierarchy import JointTree
from mrhubo.motion.readers.tree.limbs import Limbs, find_limbs
from mrhubo.motion.readers.tree.names import is_head, is_neck, is_spine, left_votes
from mrhubo.motion.readers.tree.shape import Chain, Shape

_STEADIER = 0.6
"""A joint above the one that carries limbs is the part that they belong to, if they move less in its axes than this
share of how they move in the carrier's."""
_MOVES = 0.02
"""Shoulders and hips that move by less, of their distance, do not tell."""
_SURE, _PLAIN, _HINT = 0.3, 0.6, 0.1
"""How clear toes and knees must be, of 1, to be sure together which side is left; how clear either by itself; and how
clear they must be to be asked where names do not say."""
_BENT = np.sin(np.radians(15.0))
"""Sine of the bend from which a knee tells where forward is."""
_OFTEN = 0.05
"""Share of the frames in which a knee must be bent so much to be believed by itself."""

_TOES, _TOES_ALIKE = 3, 1.7
"""Toes of which one is in the middle; and how much their distances from the ankle differ, as a ratio, at most."""

_LEG, _ARM = ("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist")
NEEDED = ("pelvis", "spine3", *(f"{side}_{name}" for side in ("left", "right") for name in (*_LEG, *_ARM)))
"""Joints without which nothing can be made of a tree."""
ROLES = (*NEEDED, "neck", "head", "left_foot", "right_foot", "left_collar", "right_collar")
"""Joints that are looked for; `spine3` is the chest, `foot` where toes begin, `collar` the first joint of the arm."""


class NoBody(UserError):
    """A tree has no arms and legs."""


@dataclass(frozen=True)
class Anatomy:
    """Which joint of a file stands for which of ours."""

    place: Mapping[str, int]
    """Places in the tree, by the names of our joints: those of `NEEDED`, and of `ROLES` as far as they are there."""
    notes: tuple[str, ...] = ()


def find_anatomy(tree: JointTree, given: Mapping[str, int] | None = None, what: str = "the file") -> Anatomy:
    """Finds the joints of a body in a tree.

    Args:
        tree: the joints and their motion.
        given: those that the user has named; they are taken as they are.
        what: the file, for a sentence.

    Raises:
        NoBody: the tree has no two pairs of limbs that fit a body.
        UserError: nothing tells left from right.
    """
    given = dict(given or {})
    if given.keys() >= set(NEEDED):
        return Anatomy(given)
    shape = Shape(tree)
    limbs = find_limbs(shape)
    if limbs is None:
        raise NoBody(
            f"{what}: no arms and legs, of which two each are needed, are found among its {len(tree.joints)} joints; "
            "name them in a YAML file with --bvh-map"
        )
    notes: list[str] = []
    shoulders, hips = ([triple[0] for triple in pair] for pair in (limbs.arms, limbs.legs))
    spine, above = _spine(shape, limbs), tree.above(limbs.leg_carrier)[1:]
    chest = _steadiest(shape, limbs.arm_carrier, shoulders, spine[1:], is_neck)
    place = {"pelvis": _steadiest(shape, limbs.leg_carrier, hips, above, is_spine), "spine3": chest}
    head_chain = _head_chain(shape, limbs)
    legs, arms = _sides(shape, limbs, notes, what)
    for side, leg, arm in zip(("left", "right"), legs, arms, strict=True):
        place |= {f"{side}_{name}": limbs.legs[leg][i] for i, name in enumerate(_LEG)}
        place |= {f"{side}_{name}": limbs.arms[arm][i] for i, name in enumerate(_ARM)}
        place[f"{side}_collar"] = limbs.chains["arm"][arm].places[0]
        toes = _toes(shape, limbs, leg)
        if toes is not None:
            place[f"{side}_foot"] = toes
    if head_chain is not None:
        place["neck"], place["head"] = head_chain.places[0], _head(shape, head_chain)
    return Anatomy(place | given, tuple(notes))


def _toes(shape: Shape, limbs: Limbs, leg: int) -> int | None:
    """The first joint beyond an ankle that is not in its place."""
    chain, ankle = limbs.chains["leg"][leg], limbs.legs[leg][2]
    start = chain.places.index(ankle)
    beyond = [i for i in range(start + 1, len(chain.places)) if chain.below[i] - chain.below[start] > shape.nothing]
    return _middle_toe(shape, ankle, chain.places[beyond[0]]) if beyond else None


def _middle_toe(shape: Shape, ankle: int, toe: int) -> int:
    """The toe in the middle of those that begin beside one: feet of some models have five."""
    far = shape.distance(ankle, toe)
    toes = [
        one
        for one in shape.tree.children[shape.tree.joints[toe].parent]
        if far / _TOES_ALIKE < shape.distance(ankle, one) < far * _TOES_ALIKE
        and shape.distance(one, toe) < far / _TOES_ALIKE
    ]
    if len(toes) < _TOES:
        return toe
    return min(toes, key=lambda one: sum(shape.distance(one, other) for other in toes))


def _steadiest(shape: Shape, carrier: int, ends: list[int], above: list[int], misplaced: Callable[[str], bool]) -> int:
    """The joint with whose turn two points go, shoulders or hips: that which carries them, or one above it.

    Who makes bipeds hangs collars on the neck and thighs on the spine, though they move with neither.

    Args:
        shape: of the tree.
        carrier: the joint on which the limbs hang.
        ends: the two points.
        above: the joints above that come into question, the nearest first.
        misplaced: whether a name says that limbs hang on it by such a habit.
    """
    width = max(shape.distance(*ends), 1e-9)

    def moves(place: int) -> float:
        back_F33, base_F3 = shape.pose.matrix[place].mT, shape.pose.point[place]
        seen = [turned(back_F33, shape.pose.point[end] - base_F3) / width for end in ends]
        return float(np.sqrt(np.mean([np.var(x_F3, axis=0).sum() for x_F3 in seen])))

    if above and misplaced(shape.tree.names[carrier]):
        carrier, above = above[0], above[1:]
    best, least = carrier, moves(carrier)
    for place in above:
        if least > _MOVES and moves(place) < _STEADIER * least:
            best, least = place, moves(place)
    return best


def _spine(shape: Shape, limbs: Limbs) -> list[int]:
    """Joints from the one that carries the arms up to, and without, the one that is above the legs too."""
    legs = set(shape.tree.above(limbs.leg_carrier))
    found = []
    for place in shape.tree.above(limbs.arm_carrier):
        if place in legs:
            break
        found.append(place)
    return found


def _head_chain(shape: Shape, limbs: Limbs) -> Chain | None:
    """The longest of what hangs on the chest beside the arms."""
    spine = _spine(shape, limbs) or [limbs.arm_carrier]
    arms = {chain.places[0] for chain in limbs.chains["arm"]} | {chain.places[0] for chain in limbs.chains["leg"]}
    below = set(spine) | set(shape.tree.above(limbs.leg_carrier))
    children = [child for place in spine for child in shape.tree.children[place] if child not in arms | below]
    children = [child for child in children if shape.far(child) > shape.nothing]
    if not children:
        return None
    named = [child for child in children if any(is_head(shape.tree.names[p]) for p in shape.chain(child).places)]
    return shape.chain(max(named or children, key=shape.far))


def _head(shape: Shape, chain: Chain) -> int:
    """The joint that turns the head: called so, or where eyes and jaw part, or the last that turns."""
    tree = shape.tree
    for place in chain.places:
        if is_head(tree.names[place]) and tree.joints[place].rotation:
            return place
    for place in chain.places[1:]:
        if len(tree.children[place]) > 1:
            return place
    turning = [place for place in chain.places if tree.joints[place].rotation]
    return turning[-1] if turning else chain.places[0]


def _sides(shape: Shape, limbs: Limbs, notes: list[str], what: str) -> tuple[tuple[int, int], tuple[int, int]]:
    """The left and the right one of legs and arms, as places in the pairs."""
    point, names = shape.pose.point, shape.tree.names
    hips, shoulders = ([point[triple[0]] for triple in pair] for pair in (limbs.legs, limbs.arms))
    up_F3 = _unit((shoulders[0] + shoulders[1]) - (hips[0] + hips[1]))
    line_F3 = _unit(hips[0] - hips[1])
    forward_F3 = _unit(np.cross(line_F3, up_F3))  # were the first leg the left one
    toes, knees, weight, often = [], 0.0, 0.0, 0.0
    for leg, triple in enumerate(limbs.legs):
        hip_F3, knee_F3, ankle_F3 = (point[place] for place in triple)
        toe = _toes(shape, limbs, leg)
        if toe is not None:
            toes.append(np.mean((_unit(point[toe] - ankle_F3) * forward_F3).sum(-1)))
        thigh_F3, shin_F3 = _unit(knee_F3 - hip_F3), _unit(ankle_F3 - knee_F3)
        bend_F = np.linalg.norm(np.cross(thigh_F3, shin_F3), axis=-1)
        bent_F = bend_F > _BENT
        knees += float((((thigh_F3 - shin_F3) * forward_F3).sum(-1) * bent_F).sum())
        weight += float((bend_F * bent_F).sum())
        often += float(bent_F.mean()) / 2
    toe_says = float(np.mean(toes)) if toes else 0.0
    knee_says = knees / weight if weight else 0.0
    # Leg and arm are compared with their partners; arms' names need not begin where legs' do.
    called = _called(limbs.chains["leg"], names)
    sure = min(abs(toe_says), abs(knee_says)) > _SURE and toe_says * knee_says > 0
    sure |= abs(toe_says) > _PLAIN and knee_says * np.sign(toe_says) > -_HINT
    sure |= abs(knee_says) > _PLAIN and often > _OFTEN and toe_says * np.sign(knee_says) > -_HINT
    geometry = toe_says + knee_says
    if sure:
        says = geometry
        if called * geometry < 0:
            notes.append(
                "the names of its joints say left where toes and knees say right; toes and knees are believed "
                "(--bvh-map overrides)"
            )
    elif called:
        says = called
        if called * geometry < 0 and abs(geometry) > _HINT:
            notes.append(
                "the names of its joints say left where toes and knees hint at right; names are believed "
                "(--bvh-map overrides)"
            )
    elif abs(geometry) > _HINT:
        says = geometry
    else:
        raise UserError(
            f"{what}: nothing tells left from right: its joints are not called so, it has no toes, and its knees do "
            "not bend; name the joints in a YAML file with --bvh-map"
        )
    legs = (0, 1) if says > 0 else (1, 0)
    across = np.mean(((shoulders[0] - shoulders[1]) * (hips[legs[0]] - hips[legs[1]])).sum(-1))
    arms = (0, 1) if across > 0 else (1, 0)
    return legs, arms


def _called(chains: tuple[Chain, Chain], names: list[str]) -> float:
    one, other = ([names[place] for place in chain.places] for chain in chains)
    return left_votes(one, other)


def _unit(vector_F3: np.ndarray) -> np.ndarray:
    return vector_F3 / np.maximum(np.linalg.norm(vector_F3, axis=-1, keepdims=True), 1e-12)
