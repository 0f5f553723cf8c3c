"""Keypoints by what joints are called, whatever arrays are.

Each may have an array of its own: dictionaries `{"LeftArm": (T, 3), "LeftForeArm": (T, 3), ...}`, or with a dictionary
a joint, that has its `position` (T, 3), or lists of x, y and z; or a list of such dictionaries with a name each. Or one
array (T, K, 3) stands beside a list of K names. Rotations and speeds are kept so too. Arrays are taken for places if
they are called so, or else if limbs keep their lengths and have a body's proportions.

Legend: T frames, K keypoints.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrhubo.body.joints import SIDES
from mrhubo.errors import UserError
from mrhubo.files.tree import Tree
from mrhubo.motion.readers.keypoint_arrays import CONFIDENCE_KEYS, Keypoints
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.point_names import NEEDED, by_names
from mrhubo.motion.readers.rate import frames_a_second

_PLACES = ("position", "positions", "pos", "global_position", "global_positions", "world_position", "world_positions",
           "translation", "translations", "location", "locations", "xyz")  # fmt: skip
_VALUES = ("frames", "values", "data", "samples")
"""What files may call places too, or rotations."""
_MOST = 1_000
"""Entries of a dictionary of joints."""
_STEADY, _ALIKE = 0.2, 0.2
"""How far, as a share, a limb's length may be from its mean (one standard deviation), and one side's from the other's.
"""
_OF_UPPER_ARM = (0.8, 2.5)
"""Lengths of a thigh, of the upper arm's."""


def points_beside_names(tree: Tree, options: ReadOptions) -> Keypoints | None:
    """The points of an array beside which a dictionary has the names of joints, whatever it calls both; None of any
    other dictionary, and of one whose points have a key that is known.
    """
    names = names_beside(tree)
    if names is None:
        return None
    for key, child in tree.items():
        shape = None if child.is_mapping else child.shape()
        if shape is None or len(shape) != 3 or shape[1:] != (len(names), 3) or not shape[0]:
            continue
        point_TK3 = child.array()
        if point_TK3.dtype.kind in "fiu" and is_body(point_TK3.astype(np.float64), names):
            found = Keypoints(point_TK3.astype(np.float64), names, where=f"'{key}'", notes=options.of_one())
            found.rate = frames_a_second(tree, found.notes)
            return found
    return None


def names_beside(tree: Tree) -> list[str] | None:
    """The names of joints in a dictionary, whatever it calls them; None where it has none."""
    if not tree.is_mapping or len(tree.keys) > _MOST:
        return None
    for _, child in tree.items():
        if child.is_mapping or len(child) > _MOST or ((shape := child.shape()) is not None and len(shape) != 1):
            continue
        try:
            names = child.texts()
        except UserError:
            continue
        if len(set(names)) == len(names) <= _MOST and by_names(names).keys() >= set(NEEDED):
            return names
    return None


def points_by_joint(tree: Tree, options: ReadOptions) -> Keypoints | None:
    """The points of a dictionary of joints, or of one in a dictionary; None of any other."""
    for node in (tree, *(child for _, child in tree.items())):
        node = _under_names(node)
        if 0 < len(node.keys) <= _MOST and (found := _in_node(node)) is not None:
            found.notes = options.of_one()
            found.rate = frames_a_second(tree, found.notes) or frames_a_second(node, found.notes)
            return found
    return None


def _under_names(node: Tree) -> Tree:
    """A list of dictionaries with a name each as a dictionary by their names."""
    if not node.is_list or not 0 < len(node) <= _MOST:
        return node
    named = [child.get("name", "joint", "bone") if child.is_mapping else None for child in node]
    names = [name.text() for name in named if name is not None]
    texts = [name for name in names if name is not None]
    return node.by_names(texts) if len(set(texts)) == len(texts) == len(node) else node


def _in_node(node: Tree) -> Keypoints | None:
    if not by_names(node.keys).keys() >= set(NEEDED):
        return None
    places, sure = dict[str, np.ndarray](), dict[str, np.ndarray]()
    are_called = True
    for name, child in node.items():
        place_T3, is_called = _place(child)
        if place_T3 is not None:
            places[name], are_called = place_T3, are_called and is_called
            told = child.find_array(*CONFIDENCE_KEYS) if child.is_mapping else None
            if told is not None and told.shape == place_T3.shape[:1] and told.dtype.kind in "fiu":
                sure[name] = told.astype(np.float64)
    frames = {len(place_T3) for place_T3 in places.values()}
    if len(frames) != 1 or not by_names(list(places)).keys() >= set(NEEDED):
        return None
    point_TK3 = np.stack(list(places.values()), axis=1)
    if not are_called and not is_body(point_TK3, list(places)):
        return None
    sure_TK = np.stack([sure[name] for name in places], axis=1) if sure.keys() == places.keys() else None
    where = f"'{node.where}'" if node.where else "the arrays"
    return Keypoints(point_TK3, list(places), sure_TK, where=where)


def _place(node: Tree) -> tuple[np.ndarray | None, bool]:
    """Where a joint is (T, 3), and whether it is called that; None where a node tells no places."""
    called = node.get(*_PLACES) if node.is_mapping else None
    chosen = node.get(*_VALUES) if called is None and node.is_mapping else called
    if chosen is None and node.is_mapping:
        axes = [node.find_array(axis) for axis in "xyz"]
        shapes = {None if axis is None else axis.shape for axis in axes}
        if len(shapes) > 1 or None in shapes or len(next(iter(shapes)) or ()) != 1:
            return None, False
        return np.stack([axis for axis in axes if axis is not None], axis=-1).astype(np.float64), True
    chosen = node if chosen is None else chosen
    shape = None if chosen.is_mapping else chosen.shape()
    if shape is None or len(shape) != 2 or shape[1] != 3 or not shape[0]:
        return None, False
    array = chosen.array()
    return (array.astype(np.float64), called is not None) if array.dtype.kind in "fiu" else (None, False)


@np.errstate(all="ignore")
def is_body(point_TK3: np.ndarray, names: Sequence[str]) -> bool:
    """Whether upper arms and thighs of points (T, K, 3) keep their lengths, and those are a body's."""
    points = {name: point_TK3[:, place] for name, place in by_names(names).items()}
    lengths = []
    for start, end in (("shoulder", "elbow"), ("hip", "knee")):
        for side in SIDES:
            if f"{side}_{end}" not in points:
                return False
            length_T = np.linalg.norm(points[f"{side}_{end}"] - points[f"{side}_{start}"], axis=-1)
            length_T = length_T[np.isfinite(length_T)]
            if not len(length_T) or not length_T.std() <= _STEADY * length_T.mean() or not length_T.mean() > 0:
                return False
            lengths.append(float(length_T.mean()))
    arms, thighs = lengths[:2], lengths[2:]
    alike = all(max(both) <= (1 + _ALIKE) * min(both) for both in (arms, thighs))
    return alike and _OF_UPPER_ARM[0] < sum(thighs) / sum(arms) < _OF_UPPER_ARM[1]
