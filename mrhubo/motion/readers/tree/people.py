"""Several people in a tree of joints, who have a root each, or hang on one node that carries them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.tracks import Person, choose
from mrhubo.motion.readers.tree.hierarchy import JointTree
from mrhubo.motion.readers.tree.limbs import find_limbs
from mrhubo.motion.readers.tree.shape import Shape

FEWEST_JOINTS = 13
"""The trunk, and three of each limb."""
_STILL_DEG = 0.01
"""Angles that change by less in a whole motion do not."""
_ALL = 0.9
"""People who hang on one node have this share of all joints at least; two arms with all their fingers have less."""
_LESS_LIKE = 6.0
"""How much worse limbs may fit a body than the best of the whole tree, of another person: the fingers of two hands do
not look like two people."""


def of_person(path: Path, tree: JointTree, options: ReadOptions, notes: list[str]) -> JointTree:
    """The tree of one of the people in a file; the whole tree where there is one.

    Raises:
        UserError: there is nobody whose topmost joint has the name that is asked for.
    """
    people: dict[str, JointTree] = {}
    for root, under in _bodies(tree).items():
        name = tree.names[root]
        people[name if name not in people else f"{name} {len(people) + 1}"] = under
    if len(people) < 2 and (len(tree.roots) < 2 or not people):
        notes += options.of_one()
        return tree
    chosen = choose(path, [Person(name, _length(under)) for name, under in people.items()], options, notes)
    return people[chosen.person]


def _length(tree: JointTree) -> int:
    """In how many frames somebody is seen; who never moves, as the others do in an animation of theirs, in one."""
    columns = [column for joint in tree.joints for _, column in joint.rotation]
    moves = bool(columns) and bool((np.ptp(tree.value_TC[:, columns], axis=0) > _STILL_DEG).any())
    return len(tree) if moves else 1


def _bodies(tree: JointTree) -> dict[int, JointTree]:
    """The trees of those who hang side by side on nothing, or on one node, by their topmost joints."""
    sizes = [1] * len(tree.joints)
    for place in range(len(tree.joints) - 1, 0, -1):
        if tree.joints[place].parent >= 0:
            sizes[tree.joints[place].parent] += sizes[place]
    level = [place for place in tree.roots if sizes[place] >= FEWEST_JOINTS]
    while len(level) == 1 and len(tree.roots) < 2:
        level = [place for place in tree.children[level[0]] if sizes[place] >= FEWEST_JOINTS]
    if len(tree.roots) < 2 and (len(level) < 2 or sum(sizes[place] for place in level) < _ALL * len(tree.joints)):
        return {}
    best = find_limbs(Shape(tree))
    found = {}
    for place in level:
        under = tree.under(place)
        limbs = find_limbs(Shape(under))
        if best is not None and limbs is not None and limbs.cost < best.cost + _LESS_LIKE:
            found[place] = under
    return found
