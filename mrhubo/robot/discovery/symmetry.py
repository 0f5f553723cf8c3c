"""Left and right: pairs of limbs that are mirror images, told by lengths along their axes, which no pose changes.

Link origins need not mirror, and neither need the zero pose; the axes of one arm have the same distances and angles to
each other as those of the other arm.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrhubo.robot.discovery.bodies import Bodies, Chain, lines_of
from mrhubo.robot.discovery.limbs import limb
from mrhubo.robot.discovery.lines import Measures, measure, reflection, unit

_LENGTH = 0.03
"""How far two lengths may differ, as a share of the chain's: left and right in files that were measured, not drawn."""
_COSINE = 0.09
_ALIKE = 0.6
"""Share of the joints up to which two limbs must be alike: one hand may be another than the other."""
_FEWEST, _ENOUGH = 2, 4
"""Joints of a limb, and how many that are alike are enough: a shoulder and an elbow, where one arm has no wrist."""
_WIDE = 0.1
"""How far apart limbs begin, as a share of their size, that tell by that alone where left is."""


@dataclass(frozen=True)
class Pair:
    """Two limbs of one body that are mirror images. Which is the left one is not known yet."""

    body: int
    chains: tuple[Chain, Chain]
    normal_3: np.ndarray
    """Unit, across the mirror plane, from the second limb to the first."""
    mirrored: float
    """0..1: how well the first joint's axis, and the zero pose, mirror too."""
    size: float
    """Length of the limbs along their axes, and beyond to where the branch ends [m]."""

    @property
    def mounts_23(self) -> np.ndarray:
        """Where the limbs begin (2, 3)."""
        return np.stack([measure(lines_of(chain)).nodes_N3[0] for chain in self.chains])

    def flipped(self) -> Pair:
        """With the limbs exchanged."""
        return Pair(self.body, self.chains[::-1], -self.normal_3, self.mirrored, self.size)  # pyright: ignore


def alike(one: Measures, other: Measures) -> int:
    """The number of joints, from the body outwards, up to which two chains have the same lengths and angles."""
    count = min(len(one.out_N), len(other.out_N))
    scale = max(one.out_N[-1], other.out_N[-1], 1e-9)
    same = 1
    for i in range(count - 1):
        lengths = [one.apart_N[i] - other.apart_N[i], one.along_N[i] - other.along_N[i]]
        if max(map(abs, lengths)) > _LENGTH * scale or abs(one.cosine_N[i] - other.cosine_N[i]) > _COSINE:
            break
        same = i + 2
    return same if count > 1 else 0


def find_pairs(bodies: Bodies) -> list[Pair]:
    """All pairs of limbs, the largest first; those within a limb of a larger pair (fingers) are left out."""
    found: list[Pair] = []
    for body, steps in enumerate(bodies.steps_from):
        chains = [limb(bodies, step) for step in steps] if len(steps) > 1 else []
        for chain, other in itertools.combinations(chains, 2):
            least = max(_FEWEST, min(_ENOUGH, _ALIKE * max(len(chain), len(other))))
            if min(len(chain), len(other)) < least:
                continue
            one, two = measure(lines_of(chain)), measure(lines_of(other))
            # Ball joints, as of a neck and a waist, have no lengths by which to tell them apart.
            if alike(one, two) < least or min(one.out_N[-1], two.out_N[-1]) < 1e-3 * bodies.size:
                continue
            pair = _pair(bodies, body, (chain, other))
            if pair is not None and pair.mirrored > 0:
                found.append(pair)
    found.sort(key=lambda pair: -pair.size * pair.mirrored)
    kept: list[Pair] = []
    taken: set[int] = set()
    """Bodies of the limbs of larger pairs."""
    for pair in found:
        inside = [bodies.beyond(chain[0])[0] for chain in pair.chains]
        if pair.body in taken or inside[0] & inside[1] or any(part & taken for part in inside):
            continue
        kept.append(pair)
        taken |= inside[0] | inside[1]
    return kept


def _pair(bodies: Bodies, body: int, chains: tuple[Chain, Chain]) -> Pair | None:
    nodes = [measure(lines_of(chain)).nodes_N3 for chain in chains]
    count = min(map(len, nodes))
    across_N3 = nodes[0][:count] - nodes[1][:count]
    lengths_N = np.linalg.norm(across_N3, axis=-1)
    size = min(bodies.extent(chain[0]) for chain in chains)
    if lengths_N.max() < 1e-3 * bodies.size or size < 1e-6:
        return None
    # The first node stays where it is, whatever the pose; further ones mirror if the zero pose does.
    first = int(np.argmax(lengths_N > 0.02 * bodies.size)) if (lengths_N > 0.02 * bodies.size).any() else 0
    normal_3 = unit(across_N3[first])
    same_N = across_N3 @ normal_3 > 0.97 * lengths_N
    middles_N3 = 0.5 * (nodes[0][:count] + nodes[1][:count])
    if lengths_N[first] > _WIDE * size:
        same_N &= _mirrors(across_N3, middles_N3 - middles_N3[first], normal_3, _LENGTH * size)
    whole_3 = unit(across_N3[same_N].sum(0))
    mirrored = float(np.mean(same_N)) * _mirror_share(chains, whole_3, nodes, count)
    return Pair(body, chains, whole_3, mirrored, size)


def _mirrors(across_N3: np.ndarray, middles_N3: np.ndarray, normal_3: np.ndarray, most: float) -> np.ndarray:
    """Which points of one limb lie where the other limb's are mirrored to, to within `most` metres (N,): those of two
    arms that are one product, not mirrored, stand elsewhere, and say nothing of where left is.

    Args:
        across_N3: from the second limb's points to the first one's.
        middles_N3: half-way between them, from a point of the mirror plane.
        normal_3: across the mirror plane.
        most: how far off.
    """
    aside_N3 = across_N3 - np.outer(across_N3 @ normal_3, normal_3)
    return np.hypot(np.linalg.norm(aside_N3, axis=-1), 2.0 * (middles_N3 @ normal_3)) < most


def _mirror_share(chains: tuple[Chain, Chain], normal_3: np.ndarray, nodes: Sequence[np.ndarray], count: int) -> float:
    """Share of the joints whose axes are mirror images as the joints stand."""
    flip_33 = reflection(normal_3)
    good = 0
    for one, other in zip(chains[0][:count], chains[1][:count], strict=True):
        a_3, b_3 = flip_33 @ one.hinge.line.axis_3, other.hinge.line.axis_3
        good += abs(float(a_3 @ b_3)) > 0.99
    return good / count
