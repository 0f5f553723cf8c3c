"""What a tree of joints looks like: lengths of bones, the longest way down from each joint, and pairs of limbs.

Legend: N joints, F frames.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.motion.readers.tree.hierarchy import JointTree, Pose

_SAMPLES = 64
"""Frames in which shapes are looked at."""
_NOTHING = 1e-4
"""Bones shorter than this share of the whole tree's depth are none: two joints in one place."""
_LONG = 0.25
"""A limb is at least this share as long as the longest one that has a partner."""
_UNLIKE = 0.25
"""How far the bones of a pair may differ, as a mean logarithm of their ratio; people's differ by some hundredths."""
_SAME = 0.05
"""The same of bones that were made as copies of each other."""
_STRAIGHT_DEG, _BENT_DEG = 2.0, 15.0
"""A joint at which two bones never bend by more than the first is none of the body's, in a limb in which others bend by
more than the second."""
_COMPARED = 2
"""Bones of a pair that are compared; what hangs on hands and feet may differ, as a hand with a stick does."""
_MOST_CHILDREN = 40
"""Of one joint, in which pairs are looked for."""


@dataclass(frozen=True)
class Chain:
    """The longest way down from a joint."""

    places: tuple[int, ...]
    """The joints on it, from the top."""
    below: tuple[float, ...]
    """How far each is from the first, along the bones."""
    rolls: tuple[bool, ...]
    """Whether each lies on the line between its neighbours in all frames, as a joint does that cuts a bone into pieces;
    known where the limb bends elsewhere."""


@dataclass(frozen=True)
class Pair:
    """Two limbs alike that hang on one joint."""

    carrier: int
    limbs: tuple[Chain, Chain]


class Shape:
    """Lengths and ways of a tree, as it is in a motion."""

    def __init__(self, tree: JointTree) -> None:
        self.tree = tree
        first = 1 if len(tree) > 2 else 0  # the first frame is often no part of the motion
        self.frames = np.unique(np.linspace(first, len(tree) - 1, _SAMPLES).astype(int))
        self.pose: Pose = tree.pose(self.frames)
        self._distances: dict[tuple[int, int], float] = {}
        count = len(tree.joints)
        self.length = np.zeros(count)
        for place, joint in enumerate(tree.joints):
            if joint.parent >= 0:
                bone_F3 = self.pose.point[place] - self.pose.point[joint.parent]
                self.length[place] = np.median(np.linalg.norm(bone_F3, axis=-1))
        self.reach = np.zeros(count)
        """How far it is from each joint to the end of the longest way down."""
        for place in range(count - 1, 0, -1):
            parent = tree.joints[place].parent
            if parent >= 0:
                self.reach[parent] = max(self.reach[parent], self.reach[place] + self.length[place])
        self.nothing = _NOTHING * max(float(self.reach.max()), 1e-12)

    def chain(self, place: int) -> Chain:
        """The longest way down from a joint; of ways that are equally long, that with more joints."""
        places, below = [place], [0.0]
        while self.tree.children[place]:
            place = max(self.tree.children[place], key=lambda child: (self.far(child), len(self.tree.children[child])))
            places.append(place)
            below.append(below[-1] + float(self.length[place]))
        return Chain(tuple(places), tuple(below), self._rolls(places))

    def _rolls(self, places: list[int]) -> tuple[bool, ...]:
        """Which of the places on a way are `Chain.rolls`."""
        bone_PF3 = np.diff(np.stack([self.pose.point[place] for place in places]), axis=0)
        long_PF = np.linalg.norm(bone_PF3, axis=-1)
        cosine_PF = (bone_PF3[1:] * bone_PF3[:-1]).sum(-1) / np.maximum(long_PF[1:] * long_PF[:-1], 1e-12)
        bend_P = np.degrees(np.arccos(np.clip(cosine_PF, -1, 1))).max(axis=1, initial=0.0)
        is_bone_P = np.median(long_PF, axis=1) > self.nothing
        straight_P = (bend_P < _STRAIGHT_DEG) & is_bone_P[1:] & is_bone_P[:-1]
        if bend_P.max(initial=0.0) < _BENT_DEG:
            straight_P[:] = False
        return (False, *straight_P.tolist(), False)[: len(places)]

    def far(self, place: int) -> float:
        """How far it is from a joint's parent, over the joint, to the end of the longest way down."""
        return float(self.length[place] + self.reach[place])

    def pairs(self) -> list[Pair]:
        """All pairs of limbs alike, long enough for arms and legs."""
        found = []
        for carrier, children in enumerate(self.tree.children):
            chains = [self.chain(child) for child in children[:_MOST_CHILDREN]]
            for i, one in enumerate(chains):
                for other in chains[i + 1 :]:
                    if self._alike(one, other):
                        found.append(Pair(carrier, (one, other)))
        longest = max((pair.limbs[0].below[-1] for pair in found), default=0.0)
        return [pair for pair in found if pair.limbs[0].below[-1] >= _LONG * longest]

    def _alike(self, one: Chain, other: Chain) -> bool:
        bones, others = (self._bones(chain)[:_COMPARED] for chain in (one, other))
        if len(bones) < _COMPARED or len(others) < _COMPARED:
            return False
        return float(np.mean(np.abs(np.log(np.array(bones) / np.array(others))))) < _UNLIKE

    def same(self, one: Chain, other: Chain) -> bool:
        """Whether two limbs have the same bones to their ends, as copies of one."""
        bones, others = np.array(self._bones(one)), np.array(self._bones(other))
        return len(bones) == len(others) and bool(np.abs(np.log(bones / others)).max(initial=0.0) < _SAME)

    def _bones(self, chain: Chain) -> list[float]:
        """Lengths of the bones below the first joint that are some."""
        bones = np.diff(chain.below)
        return [float(bone) for bone in bones if bone > max(self.nothing, 0.02 * chain.below[-1])]

    def distance(self, one: int, other: int) -> float:
        """The median distance of two joints over the motion."""
        pair = (min(one, other), max(one, other))
        if pair not in self._distances:
            apart_F3 = self.pose.point[one] - self.pose.point[other]
            self._distances[pair] = float(np.median(np.linalg.norm(apart_F3, axis=-1)))
        return self._distances[pair]
