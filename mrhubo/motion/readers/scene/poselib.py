"""Motions of poselib, as Isaac Gym's AMP, ASE, PHC and what takes after them keep them: a skeleton, and how its joints
are turned.

`np.save` of a dictionary: `rotation` (T, N, 4), quaternions, w last, in the parents' axes if `is_local`, else in the
world's; `root_translation` (T, 3); `skeleton_tree` with `node_names`, `parent_indices`, `local_translation` (N, 3);
`fps`. Arrays are under `arr` (https://github.com/nv-tlabs/ASE, ase/poselib/poselib/skeleton/skeleton3d.py).

Legend: N joints, T frames.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.tree import Tree
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.other_rotations import from_xyzw
from mrhubo.motion.readers.scene.turned import Skeleton, in_parents, turned_motion
from mrhubo.motion.readers.smpl_names import search

_KEYS = {"rotation", "root_translation", "skeleton_tree"}
_TREE_KEYS = {"node_names", "parent_indices", "local_translation"}
_MAX_NUMBERS = 100_000_000
"""Of rotations as matrices."""


def read_poselib(tree: Tree, options: ReadOptions, find_rate: Callable[[list[str]], float]) -> Motion | None:
    """Reads such a motion, of whatever skeleton; None of anything else.

    Args:
        tree: the file.
        options: may tell which joint is which.
        find_rate: gives the frame rate, and may add to the notes.

    Raises:
        NoMotion: the skeleton is none of a human.
        UserError: the numbers are no motion, or the frame rate is not known.
    """
    node = search(tree, lambda node: node if _is_poselib(node) else None)
    if node is None:
        return None
    path, skeleton = tree.path, _skeleton(node["skeleton_tree"])
    turn, root_T3 = _array(node, "rotation"), _array(node, "root_translation")
    count = len(skeleton.names)
    if turn.ndim == 2:
        raise UserError(f"{path}: is a single pose of poselib's, 'rotation' {turn.shape}, and no motion")
    if turn.shape[1:] != (count, 4) or not 0 < 9 * turn[..., 0].size <= _MAX_NUMBERS:
        raise UserError(f"{path}: 'rotation' has shape {turn.shape}; expected (frames, {count}, 4)")
    if root_T3.shape != (len(turn), 3):
        raise UserError(f"{path}: 'root_translation' has shape {root_T3.shape}; expected ({len(turn)}, 3)")
    local_TN33 = from_xyzw(turn.astype(np.float64))
    if not (np.isfinite(root_T3).all() and np.isfinite(local_TN33).all()):
        raise UserError(f"{path}: holds NaN or infinite numbers, or quaternions that are 0")
    is_local = node.get("is_local")
    if is_local is not None and not is_local.number():
        local_TN33 = in_parents(local_TN33, skeleton.parents)
    notes: list[str] = []
    rate = find_rate(notes)
    return turned_motion(path, skeleton, local_TN33, root_T3, rate, "poselib's motion", options, notes)


def _is_poselib(node: Tree) -> bool:
    return _KEYS <= set(node.keys) and _TREE_KEYS <= set(node["skeleton_tree"].keys)


def _array(node: Tree, key: str) -> np.ndarray:
    """The array under a key, or under `arr` there."""
    found = node[key]
    return found["arr"].array() if found.is_mapping else found.array()


def _skeleton(node: Tree) -> Skeleton:
    names = node["node_names"].texts()
    parents, offset_N3 = _array(node, "parent_indices"), _array(node, "local_translation")
    count = len(names)
    if not count or parents.shape != (count,) or offset_N3.shape != (count, 3):
        raise UserError(
            f"{node.named}: has {count} names, 'parent_indices' of shape {parents.shape} and 'local_translation' of"
            f" shape {offset_N3.shape}; expected ({count},) and ({count}, 3)"
        )
    if not ((parents >= -1) & (parents < count)).all() or parents[0] != -1 or not np.isfinite(offset_N3).all():
        raise UserError(f"{node.named}: has parents that there are not, no root at first, or joints that are nowhere")
    return Skeleton(names, [int(parent) for parent in parents], offset_N3, "the pose in which no joint turns")
