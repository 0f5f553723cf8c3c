"""Motions of SMPL's humanoid in simulators: ProtoMotions' and MimicKit's.

Their 24 bodies are SMPL's joints in an order of their own, and are turned as those are, but with axes x forward, y
left, z up where SMPL's are x left, y up, z forward. World: z up.

Legend: T frames, F some of them, J = 24 bodies, L motions.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.files.tree import Tree, tree_of
from mrhubo.motion.readers.other_rotations import from_xyzw
from mrhubo.motion.readers.rotations import Form
from mrhubo.motion.readers.scene.mimickit import frames_of
from mrhubo.motion.readers.scene.turned import in_parents
from mrhubo.motion.readers.tracks import Kind, Layout, SmplArrays, Track
from mrhubo.motion.readers.world import Z_UP

_JOINTS = (0, 1, 4, 7, 10, 2, 5, 8, 11, 3, 6, 9, 12, 15, 13, 16, 18, 20, 22, 14, 17, 19, 21, 23)
"""SMPL's joints in the order of the bodies: left leg, right leg, trunk and head, left arm, right arm."""
_PARENTS = (-1, 0, 1, 2, 3, 0, 5, 6, 7, 0, 9, 10, 11, 12, 11, 14, 15, 16, 17, 11, 19, 20, 21, 22)
_AXES_33 = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""From the bodies' axes to SMPL's."""
_FORM = Form(len(_JOINTS), True)
_LOOSE_M = 0.02
"""By more than that [m] the places of joints on the bodies that carry them do not vary."""
_STRAIGHT = 0.8
"""Cosine between a limb at rest and the axis along which it points."""
_MOST = 100_000
"""Motions that are packed."""


def read_protomotions(tree: Tree) -> Layout | None:
    """ProtoMotions' `.motion`, by `torch.save`: `rigid_body_pos` (T, J, 3) and `rigid_body_rot` (T, J, 4), quaternions
    in the world, w last; or what it packs of many, `gts` and `grs`, of which motion i has `motion_num_frames[i]`
    frames from `length_starts[i]` on, `motion_dt[i]` seconds each, and came from `motion_files[i]` (https://github.com/NVlabs/ProtoMotions,
    protomotions/components/motion_lib.py). None of other characters, such as robots, and of anything else.
    """
    place, turn = (tree.find_array(*keys) for keys in (("rigid_body_pos", "gts"), ("rigid_body_rot", "grs")))
    count = len(_JOINTS)
    if place is None or turn is None or place.ndim != 3 or place.shape[1:] != (count, 3) or not len(place):
        return None
    if turn.shape != (len(place), count, 4) or not _is_smpl(place, turn):
        return None

    def read(first: int, end: int) -> SmplArrays:
        local_TJ33 = in_parents(from_xyzw(turn[first:end].astype(np.float64)), _PARENTS)
        return _smpl("rigid_body_rot", local_TJ33, place[first:end, 0])

    kind = Kind("ProtoMotions' humanoid of SMPL", "smpl", Z_UP)
    if "length_starts" in tree.keys:
        return Layout(kind, _packed(tree, len(place), read))
    return Layout(kind, [Track("", len(place), partial(read, 0, len(place)))])


def _packed(tree: Tree, count: int, read: Callable[[int, int], SmplArrays]) -> list[Track]:
    """The motions that are packed into so many frames, by the names of the files that they came from, or else by their
    numbers.
    """
    start_L, frames_L, step_L = (tree.find_array(key) for key in ("length_starts", "motion_num_frames", "motion_dt"))
    if start_L is None or frames_L is None or start_L.ndim != 1 or start_L.shape != frames_L.shape:
        raise UserError(f"{tree.path}: 'length_starts' and 'motion_num_frames' are no lists of the same length")
    if not 0 < len(start_L) <= _MOST or (start_L % 1).any() or (frames_L % 1).any():
        raise UserError(f"{tree.path}: 'length_starts' and 'motion_num_frames' are no lists of whole numbers")
    if (start_L < 0).any() or (frames_L < 1).any() or (start_L.astype(np.float64) + frames_L > count).any():
        raise UserError(f"{tree.path}: 'length_starts' and 'motion_num_frames' do not fit 'gts' of {count:,} frames")
    told = tree.get("motion_files")
    names = [] if told is None else [Path(name).stem for name in told.texts()]
    if not len(set(names)) == len(names) == len(start_L):
        names = [str(number) for number in range(len(start_L))]
    tracks = []
    for number, name in enumerate(names):
        first, length = int(start_L[number]), int(frames_L[number])
        step = float(step_L[number]) if step_L is not None and step_L.shape == start_L.shape else 0.0
        homes = (tree_of({"fps": round(1 / step, 3)}, tree.path, f"motion_dt[{number}]"),) if step > 0 else ()
        tracks.append(Track(name, length, partial(read, first, first + length), homes))
    return tracks


def read_mimickit_smpl(tree: Tree) -> Layout | None:
    """MimicKit's, as `mrhubo.motion.readers.scene.mimickit` says, `frames` (T, 75): the root's place [m], and axis
    times angle [rad] of each body in the axes of the one before (tools/smpl_to_mimickit). None of anything else.
    """
    row_TX = frames_of(tree)
    if row_TX is None or row_TX.shape[1] != 3 + 3 * len(_JOINTS):
        return None

    def read() -> SmplArrays:
        local_TJ33 = axis_angle_to_matrix(row_TX[:, 3:].reshape(len(row_TX), -1, 3))
        return _smpl("frames", local_TJ33, row_TX[:, :3])

    return Layout(Kind("MimicKit's humanoid of SMPL", "smpl", Z_UP), [Track("", len(row_TX), read)])


def _smpl(key: str, local_TJ33: np.ndarray, place_T3: np.ndarray) -> SmplArrays:
    """SMPL's parameters of how bodies are turned in the axes of those that carry them."""
    pose_TJ33 = np.empty_like(local_TJ33)
    pose_TJ33[:, _JOINTS] = _AXES_33 @ local_TJ33 @ _AXES_33.T
    pose_TJ33[:, 0] = local_TJ33[:, 0] @ _AXES_33.T
    return SmplArrays(key, pose_TJ33, _FORM, 1, None, place_T3)


def _is_smpl(place_TJ3: np.ndarray, turn_TJ4: np.ndarray) -> bool:
    """Whether bodies hang on each other as SMPL's do: then each keeps its place on the one that carries it, at rest
    legs point down and arms to the sides. Robots may have as many bodies.
    """
    some_F = np.unique(np.linspace(0, len(place_TJ3) - 1, 64).astype(int))
    place_FJ3, turn_FJ33 = place_TJ3[some_F].astype(np.float64), from_xyzw(turn_TJ4[some_F].astype(np.float64))
    parents = list(_PARENTS[1:])
    away_FX3 = (turn_FJ33[:, parents].mT @ (place_FJ3[:, 1:] - place_FJ3[:, parents])[..., None])[..., 0]
    offset_X3 = np.median(away_FX3, axis=0)
    if not np.isfinite(away_FX3).all() or np.abs(away_FX3 - offset_X3).max() > _LOOSE_M:
        return False
    unit_X3 = offset_X3 / np.maximum(np.linalg.norm(offset_X3, axis=-1, keepdims=True), 1e-6)
    down = [-unit_X3[body - 1, 2] for body in (2, 3, 6, 7)]
    left = [unit_X3[body - 1, 1] * sign for body, sign in ((16, 1), (17, 1), (21, -1), (22, -1))]
    return min(*down, *left) > _STRAIGHT
