"""SMPL parameters whose rotations are neither axis-angle nor matrices.

* MDM, and what takes after it: of `smpl_params.npy`, a dictionary with `thetas` (24, 6, T), the first two rows of each
  joint's matrix, and `root_translation` (3, T) (https://github.com/GuyTevet/motion-diffusion-model,
  visualize/vis_utils.py; 6D numbers as in PyTorch3D). MoMask's `motions.npy` is an array (1, 25, 6, T) of them, whose
  last joint has the place in its first three numbers (https://github.com/EricGuo5513/momask-codes,
  visualization/vis_utils.py). World: y up.
* EgoAllo: `body_quats` (samples, T, 21, 4), w first, each relative to its parent, and `Ts_world_root` (samples, T, 7),
  a quaternion and a place, of SMPL-H; `timestamps_ns` (T,) (https://github.com/brentyi/egoallo, 3_aria_inference.py).
  World: z up.

Legend: T frames, J joints.
"""

from __future__ import annotations

import numpy as np

from mrhubo.fast.plain.human import orthonormal_columns
from mrhubo.fast.rotations import quaternion_to_matrix
from mrhubo.files.tree import Tree, tree_of
from mrhubo.motion.readers.rotations import Form
from mrhubo.motion.readers.tracks import Kind, Layout, SmplArrays, Track
from mrhubo.motion.readers.world import Y_UP, Z_UP

_JOINTS, _WITH_PLACE = 24, 25
_BODY = 21
_SHORTEST = 0.1
"""Of quaternions that are none to be normalised."""


def read_six(tree: Tree) -> Layout | None:
    """MDM's and MoMask's; None of anything else."""
    if tree.is_mapping:
        theta, place = (tree.get(key) for key in ("thetas", "root_translation"))
        shape = None if theta is None else theta.shape()
        if theta is None or place is None or shape is None or shape[:2] != (_JOINTS, 6) or len(shape) != 3:
            return None
        frames, where = shape[2], theta.where
    else:
        shape = None if tree.is_list else tree.shape()
        if shape is None or shape[:3] != (1, _WITH_PLACE, 6) or len(shape) != 4:
            return None
        theta, place, frames, where = tree, None, shape[3], "the array"

    def read() -> SmplArrays:
        six_J6T = theta.array().reshape(-1, 6, frames).astype(np.float64)
        place_3T = six_J6T[-1, :3] if place is None else place.array()
        matrix_TJ33 = from_rows(six_J6T[:_JOINTS].transpose(2, 0, 1))
        position = place_3T.T if place_3T.shape == (3, frames) else None
        return SmplArrays(where, matrix_TJ33, Form(_JOINTS, True), 1, None, position)

    return Layout(Kind("MDM's or MoMask's SMPL parameters", "smpl", Y_UP), [Track("", frames, read)])


def read_egoallo(tree: Tree) -> Layout | None:
    """EgoAllo's; None of anything else."""
    body, root = (tree.get(key) for key in ("body_quats", "Ts_world_root"))
    if body is None or root is None:
        return None
    shape = body.shape()
    if shape is None or len(shape) != 4 or shape[2:] != (_BODY, 4) or root.shape() != (*shape[:2], 7):
        return None
    frames = shape[1]

    def read(sample: int) -> SmplArrays:
        local_TJ33 = from_quaternions(body.array()[sample].astype(np.float64))
        root_T7 = root.array()[sample].astype(np.float64)
        betas = tree.find_array("betas")
        if betas is not None:
            betas = betas[sample] if betas.ndim == 3 and len(betas) == shape[0] else None
        turn_T33 = from_quaternions(root_T7[:, :4])
        return SmplArrays("body_quats", local_TJ33, Form(_BODY, True), 0, turn_T33, root_T7[:, 4:], betas)

    rate = _rate(tree.find_array("timestamps_ns"))
    homes = () if rate is None else (tree_of({"fps": rate}, tree.path, "timestamps_ns"),)
    tracks = [
        Track(str(sample) if shape[0] > 1 else "", frames, lambda sample=sample: read(sample), homes)
        for sample in range(shape[0])
    ]
    return Layout(Kind("EgoAllo", "smplh", Z_UP), tracks)


def _rate(time_T: np.ndarray | None) -> float | None:
    """Frames per second of times [ns]; None where they do not tell it."""
    if time_T is None or time_T.ndim != 1 or len(time_T) < 2:
        return None
    step = float(np.median(np.diff(time_T.astype(np.float64))))
    return round(1e9 / step, 2) if step > 0 else None


def from_rows(six_TJ6: np.ndarray) -> np.ndarray:
    """Matrices (T, J, 3, 3) of their first two rows; no rotations where those are 0 or on one line."""
    return orthonormal_columns(six_TJ6.reshape(*six_TJ6.shape[:-1], 2, 3).mT).mT


def from_quaternions(quaternion_X4: np.ndarray) -> np.ndarray:
    """Matrices (..., 3, 3) of quaternions (..., 4), w first; NaN where one is 0."""
    return from_xyzw(np.roll(quaternion_X4, -1, axis=-1))


def from_xyzw(quaternion_X4: np.ndarray) -> np.ndarray:
    """The same, w last."""
    length_X = np.linalg.norm(quaternion_X4, axis=-1)
    return quaternion_to_matrix(quaternion_X4 / np.where(length_X > _SHORTEST, length_X, np.nan)[..., None])
