"""Several people in a tree of joints, who have a root each."""

from __future__ import annotations

from pathlib import Path

from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.tracks import Person, choose
from mrhubo.motion.readers.tree.hierarchy import JointTree
from mrhubo.motion.readers.tree.limbs import find_limbs
from mrhubo.motion.readers.tree.shape import Shape


def of_person(path: Path, tree: JointTree, options: ReadOptions, notes: list[str]) -> JointTree:
    """The tree of one of the people in a file, who have a root each; the whole tree where it has one root.

    Raises:
        UserError: there is nobody whose root has the name that is asked for.
    """
    roots = tree.roots
    if len(roots) < 2:
        notes += options.of_one()
        return tree
    people: dict[str, JointTree] = {}
    for root in roots:
        under, name = tree.under(root), tree.names[root]
        if find_limbs(Shape(under)) is not None:
            people[name if name not in people else f"{name} {len(people) + 1}"] = under
    if not people:
        return tree
    chosen = choose(path, [Person(name, len(tree)) for name in people], options, notes)
    return people[chosen.person]
