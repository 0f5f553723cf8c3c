"""The pose in which a skin was bound to a skeleton: most often a body at rest, arms held out.

Files tell it of the bones that turn the skin, in the skin's own axes and unit.

Legend: N nodes, B bones that are bound, Q quarter turns.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from mrhubo.fast.plain.human import norm
from mrhubo.fast.rotations import orthonormal
from mrhubo.motion.readers.scene.nodes import Rest, in_world

OWN, BOUND = "its nodes' own pose", "the pose in which its skin was bound"
"""Names of poses at rest."""
_FEWEST_BOUND = 10
"""Bones that a skin of a body is bound to, at least."""
_SAME = 0.02
"""Lengths that differ by less, as a share, are in the same unit."""


def _quarter_turns() -> np.ndarray:
    """The rotations (24, 3, 3) that lead axes to axes."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix_33 = np.zeros((3, 3))
            matrix_33[range(3), order] = signs
            found.append(matrix_33)
    return np.stack([matrix_33 for matrix_33 in found if np.linalg.det(matrix_33) > 0])


_QUARTERS_Q33 = _quarter_turns()


def bound_rests(
    local_N34: np.ndarray, parents: Sequence[int], bound: Mapping[int, np.ndarray], up: str | None
) -> list[Rest]:
    """The pose in which the skin is bound; none where too few bones are bound, two where its axes are in doubt.

    The skin's axes are those of the world but for quarter turns, and a unit. Most bones tell the turn, but for those of
    somebody whom a program left lying or on all fours: if a body stands upright without a turn, there is none.

    Args:
        local_N34: where nodes are in their parents when nothing moves them.
        parents: of the nodes, which come before them.
        bound: where bones (3, 4) are in the skin's axes, by their place.
        up: the axis that is up, as the file says.
    """
    with np.errstate(all="ignore"):
        bound = {p: b for p, b in bound.items() if np.isfinite(b).all() and abs(np.linalg.det(b[:, :3])) > 0}
    if len(bound) < _FEWEST_BOUND:
        return []
    world_N34 = in_world(local_N34[None], parents)[0]
    places = list(bound)
    with np.errstate(all="ignore"):
        turn_B33 = orthonormal(world_N34[places, :, :3] @ np.linalg.inv(np.stack([b[:, :3] for b in bound.values()])))
    near_Q = np.einsum("qij,bij->q", _QUARTERS_Q33, np.nan_to_num(turn_B33))
    turn_33 = _QUARTERS_Q33[int(near_Q.argmax())]
    pairs = [(place, parents[place]) for place in bound if parents[place] in bound]
    lengths = [
        sum(float(norm(pose[place][:, 3] - pose[parent][:, 3])) for place, parent in pairs)
        for pose in (world_N34, bound)
    ]
    scale = lengths[0] / lengths[1] if min(lengths) > 0 else 1.0
    scale = 1.0 if abs(scale - 1) < _SAME else scale
    found = [Rest(BOUND, _posed(local_N34, world_N34, parents, bound, scale * turn_33))]
    if up is not None and not np.array_equal(turn_33, np.eye(3)):
        found.insert(0, Rest(BOUND, _posed(local_N34, world_N34, parents, bound, scale * np.eye(3)), up=up))
    return found


def _posed(
    local_N34: np.ndarray,
    world_N34: np.ndarray,
    parents: Sequence[int],
    bound: Mapping[int, np.ndarray],
    place_33: np.ndarray,
) -> np.ndarray:
    """Where nodes (N, 3, 4) are, if a map leads from the axes of the skin, in which some are bound, to the world."""
    found_N34 = np.empty_like(world_N34)
    below = np.zeros(len(parents), bool)  # bones that are bound, and what hangs on them
    for place, parent in enumerate(parents):
        if place in bound:
            found_N34[place] = place_33 @ bound[place]
        elif parent >= 0 and below[parent]:
            found_N34[place] = found_N34[parent, :, :3] @ local_N34[place]
            found_N34[place, :, 3] += found_N34[parent, :, 3]
        else:
            found_N34[place] = world_N34[place]
        below[place] = place in bound or (parent >= 0 and below[parent])
    return found_N34
