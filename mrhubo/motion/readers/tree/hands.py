"""How a hand is turned, as far as its fingers tell.

Frame: the hand's own axes in the file.
"""

from __future__ import annotations

import numpy as np

from mrhubo.motion.orientations import frame_of
from mrhubo.motion.readers.tree.hierarchy import JointTree
from mrhubo.motion.readers.tree.names import is_finger, is_thumb
from mrhubo.motion.readers.tree.reference import angle

_APART_DEG = 15.0
"""A thumb begins by at least this angle beside the fingers."""
_FINGERS = 4
"""Fingers, with the thumb, that tell which of them the thumb is, if no name does."""
_MOST = 12
"""What hangs on a hand, that is looked at."""


def hand_axes(tree: JointTree, wrist: int) -> np.ndarray | None:
    """Columns (3, 3): where fingers and thumb point, at right angles, and their cross product; None where no thumb can
    be told from the fingers. Fingers are looked at as they are when all angles are 0: how they are bent in the motion
    says nothing about the hand.
    """
    fingers = [_chain(tree, child) for child in tree.children[wrist][:_MOST]]
    called = [chain for chain in fingers if any(is_finger(tree.names[place]) for place in chain)]
    fingers = called if len(called) > 1 else fingers  # what a hand holds is none
    point = tree.rest().point

    def seen(place: int) -> np.ndarray:
        return (point[place] - point[wrist])[0]

    longest = max((float(np.linalg.norm(seen(chain[-1]))) for chain in fingers), default=0.0)
    bases, thumb = [], None
    for chain in fingers:
        ways = [seen(place) for place in chain]
        base = next((way for way in ways if np.linalg.norm(way) > 0.05 * longest), None)
        if base is None:
            continue
        if any(is_thumb(tree.names[place]) for place in chain):
            thumb = base
        else:
            bases.append(base)
    if thumb is None and len(bases) >= _FINGERS:
        bases, thumb = _without_thumb(bases)
    if thumb is None or not bases:
        return None
    along = np.mean([base / np.linalg.norm(base) for base in bases], axis=0)
    across = thumb
    if len(bases) > 1:  # knuckles lie across the hand; a thumb also stands off the palm
        by_thumb = sorted(bases, key=lambda base: float(np.linalg.norm(base - thumb)))
        across = by_thumb[0] - by_thumb[-1]
    frame_33 = frame_of(along[None], across[None])[0]
    return frame_33 if np.isfinite(frame_33).all() else None


def _chain(tree: JointTree, place: int) -> list[int]:
    """A finger's joints, from its base: the first way down."""
    chain = [place]
    while tree.children[place] and len(chain) < _MOST:
        place = tree.children[place][0]
        chain.append(place)
    return chain


def _without_thumb(bases: list[np.ndarray]) -> tuple[list[np.ndarray], np.ndarray | None]:
    """The finger that begins farthest beside the others is the thumb."""
    far = [angle(base, np.mean([other for other in bases if other is not base], axis=0)) for base in bases]
    thumb = int(np.argmax(far))
    if far[thumb] < _APART_DEG:
        return bases, None
    return [base for i, base in enumerate(bases) if i != thumb], bases[thumb]
