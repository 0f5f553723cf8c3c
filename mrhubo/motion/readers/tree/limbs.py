"""Which joints of a tree are arms and legs: by the proportions of a body; names only where these leave a choice.

Of the joints on the way down a limb, shoulder, elbow and wrist (hip, knee and ankle) are those that fit best. Means are
those of adults (D. Winter, "Biomechanics and Motor Control of Human Movement", 4th ed. 2009, fig. 4.1: of the height,
upper arm 0.186, forearm 0.146, thigh 0.245, shin 0.246, width of the shoulders 0.259); tolerances are wide enough for
children, cartoon figures and skeletons whose joints lie a few centimetres beside the anatomical ones.
"""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations, permutations

from mrhubo.motion.readers.tree.names import is_hand, limb_votes
from mrhubo.motion.readers.tree.shape import Chain, Pair, Shape

_THIGH_SHIN, _FOREARM_UPPER, _ARM_LEG, _WIDTH_LEG = 1.0, 0.83, 0.67, 0.43
"""Thigh over shin, forearm over upper arm, arm (without the hand) over leg, distance of the shoulders over leg (less
than in the table, since joints lie inside the body)."""
_SHARE_OF_LEG = 0.8
"""Thigh and shin, of the whole way from the top of the leg's bones to the end of the toes."""
_BONES, _WHOLE, _WIDTH, _SHARE = 0.15, 0.15, 0.3, 0.25
"""Tolerances: standard deviations of the logarithms of these ratios."""
_HIPS_LEG, _HIPS, _BESIDE = 0.22, 0.6, 50.0
"""Distance of the hips over leg, its tolerance, and what it costs at most: rigs have limbs twice, in one place."""
_SKIPPED, _ROLLED = 2.0, 0.25
"""Cost of a joint between two that are taken, as bones are rarely cut into pieces; and of one that cuts a bone which
never bends there."""
_NAMED = 5.0
"""What it is worth that the end of the arm is called hand or wrist."""
_CALLED = 12.0
"""What it is worth that all joints of a leg are called after a leg, and all of an arm after an arm."""
_HEADED = 6.0
"""What it is worth that a head hangs where the arms do, or that the arms hang farther from the root than the legs."""
_CROWDED = 20.0
"""Cost of a pair beside which there is a third one of the same bones: chains of a skirt, of hair, of a cape."""
_MOST_JOINTS = 24
"""Of a limb, that are looked at."""
_BEST_PAIRS, _MOST_PAIRS = 8, 24
"""Pairs that are looked at, on one joint and in all: the longest of those without a third one beside them, of those
called limbs, and of all."""

Triple = tuple[int, int, int]


@dataclass(frozen=True)
class Limbs:
    """Arms and legs, each side's three joints, in no order of sides."""

    legs: tuple[Triple, Triple]
    arms: tuple[Triple, Triple]
    leg_carrier: int
    arm_carrier: int
    chains: dict[str, tuple[Chain, Chain]]
    """The whole limbs, by `leg` and `arm`."""
    cost: float


def find_limbs(shape: Shape) -> Limbs | None:
    """The arms and legs that fit a body best; None where no two pairs of limbs can be such."""
    pairs = sorted(shape.pairs(), key=lambda pair: -pair.limbs[0].below[-1])
    partners = Counter(chain.places[0] for pair in pairs if shape.same(*pair.limbs) for chain in pair.limbs)
    crowded = {id(pair) for pair in pairs if any(partners[chain.places[0]] > 1 for chain in pair.limbs)}
    alone = [pair for pair in pairs if id(pair) not in crowded]
    called = [pair for pair in pairs if limb_votes(_names(shape, pair))]
    looked_at = {id(pair): pair for kind in (alone, called, pairs) for pair in _longest(kind)}.values()
    found = [
        dataclasses.replace(limbs, cost=limbs.cost + _CROWDED * sum(id(pair) in crowded for pair in (legs, arms)))
        for legs, arms in permutations(looked_at, 2)
        if (limbs := _fit(shape, legs, arms)) is not None
    ]
    return min(found, key=lambda limbs: limbs.cost, default=None)


def _longest(pairs: list[Pair]) -> list[Pair]:
    """The first of those that hang on each joint."""
    on: Counter[int] = Counter()
    kept = []
    for pair in pairs:
        on[pair.carrier] += 1
        if on[pair.carrier] <= _BEST_PAIRS and len(kept) < _MOST_PAIRS:
            kept.append(pair)
    return kept


def _names(shape: Shape, pair: Pair) -> list[str]:
    return [shape.tree.names[place] for chain in pair.limbs for place in chain.places]


def _fit(shape: Shape, legs: Pair, arms: Pair) -> Limbs | None:
    inside = {place for chain in (*legs.limbs, *arms.limbs) for place in chain.places}
    tree = shape.tree
    if arms.carrier in inside or legs.carrier in inside:
        return None
    leg_fits = [
        fit
        for chain in legs.limbs
        if (fit := _best(chain, lambda i, j, k, chain=chain: _leg_cost(chain, i, j, k))) is not None
    ]
    if len(leg_fits) < 2:
        return None
    leg = sum(chain.below[k] - chain.below[i] for chain, (_, (i, _, k)) in zip(legs.limbs, leg_fits, strict=True)) / 2
    arm_fits = [
        fit
        for chain, other in (arms.limbs, arms.limbs[::-1])
        if (fit := _best(chain, lambda i, j, k, chain=chain, other=other: _arm_cost(shape, chain, other, leg, i, j, k)))
        is not None
    ]
    if len(arm_fits) < 2:
        return None
    cost = sum(cost for cost, _ in (*leg_fits, *arm_fits))
    hips = [chain.places[fit[1][0]] for chain, fit in zip(legs.limbs, leg_fits, strict=True)]
    cost += min(_off(shape.distance(*hips) / leg, _HIPS_LEG, _HIPS), _BESIDE)
    for pair, sign in ((legs, 1.0), (arms, -1.0)):
        cost -= sign * _CALLED * limb_votes(_names(shape, pair))
    way = {*tree.above(legs.carrier)}
    others = [
        child
        for child in tree.children[arms.carrier]
        if child not in inside and child not in way and shape.far(child) > 0.05 * leg
    ]
    cost -= _HEADED * bool(others) + _HEADED * (legs.carrier in tree.above(arms.carrier)[1:])

    def joints(chain: Chain, fit: tuple[float, Triple]) -> Triple:
        i, j, k = fit[1]
        return chain.places[i], chain.places[j], chain.places[k]

    return Limbs(
        (joints(legs.limbs[0], leg_fits[0]), joints(legs.limbs[1], leg_fits[1])),
        (joints(arms.limbs[0], arm_fits[0]), joints(arms.limbs[1], arm_fits[1])),
        legs.carrier,
        arms.carrier,
        {"leg": legs.limbs, "arm": arms.limbs},
        cost,
    )


def _best(chain: Chain, cost: Callable[[int, int, int], float]) -> tuple[float, Triple] | None:
    """The three places on a limb that cost least; of several in one place, the last, which turns what hangs on it."""
    count = min(len(chain.places), _MOST_JOINTS)
    found = [
        (round(cost(i, j, k), 9), (-i, -j, -k))
        for i, j, k in combinations(range(count), 3)
        if chain.below[j] > chain.below[i] and chain.below[k] > chain.below[j]
    ]
    if not found:
        return None
    least, (i, j, k) = min(found)
    return least, (-i, -j, -k)


def _skipped(chain: Chain, i: int, k: int) -> float:
    """What it costs to leave out the joints between two, but for those in the place of another."""
    nothing = 1e-3 * chain.below[-1]
    return sum(
        _ROLLED if chain.rolls[place] else _SKIPPED
        for place in range(i + 1, k)
        if chain.below[place] - chain.below[place - 1] > nothing and chain.below[k] - chain.below[place] > nothing
    )


def _bones(chain: Chain, i: int, j: int, k: int) -> tuple[float, float, float]:
    """Lengths of the two bones, and the cost of what is skipped in them."""
    skipped = _skipped(chain, i, j) + _skipped(chain, j, k)
    return chain.below[j] - chain.below[i], chain.below[k] - chain.below[j], skipped


def _off(ratio: float, mean: float, tolerance: float) -> float:
    return (math.log(max(ratio, 1e-9) / mean) / tolerance) ** 2


def _leg_cost(chain: Chain, i: int, j: int, k: int) -> float:
    thigh, shin, skipped = _bones(chain, i, j, k)
    share = (thigh + shin) / chain.below[-1]
    return _off(thigh / shin, _THIGH_SHIN, _BONES) + _off(share, _SHARE_OF_LEG, _SHARE) + skipped


def _arm_cost(shape: Shape, chain: Chain, other: Chain, leg: float, i: int, j: int, k: int) -> float:
    upper, forearm, skipped = _bones(chain, i, j, k)
    partner = other.places[min(i, len(other.places) - 1)]
    width = shape.distance(chain.places[i], partner)
    named = _NAMED * is_hand(shape.tree.names[chain.places[k]])
    return (
        _off(forearm / upper, _FOREARM_UPPER, _BONES)
        + _off((upper + forearm) / leg, _ARM_LEG, _WHOLE)
        + _off(width / leg, _WIDTH_LEG, _WIDTH)
        + skipped
        - named
    )
