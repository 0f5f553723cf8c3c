"""Skeletons of the official body models: SMPL-X (.npz), SMPL and SMPL-H (.pkl or .npz), for those who have them.

Joints at rest are linear in the mean mesh and the shape directions, so no mesh is posed:

    joints = J_regressor (v_template + shapedirs[:, :, :B] betas)

Source: Loper et al., "SMPL" (SIGGRAPH Asia 2015), equation 10; Pavlakos et al. (CVPR 2019) for SMPL-X. Pickles are read
without executing anything (`mrhubo.files.safe_pickle`). Their licences forbid passing the files on: see
docs/official-files.md.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_JOINT, KEYPOINT_NAMES, PARENTS, POINT_NAMES, Skeleton
from mrhubo.errors import UserError, shortened
from mrhubo.files.npz import open_npz
from mrhubo.files.regular import check_regular
from mrhubo.files.safe_pickle import MAX_BYTES, read_pickle, to_array
from mrhubo.files.storage import read_tensors, write_tensors

SCHEMA = "mrhubo.skeleton/1"
_KEYS = ("v_template", "shapedirs", "J_regressor", "kintree_table")
_PICKLE_MODULES = ("numpy", "scipy", "chumpy", "copy_reg", "copyreg", "_codecs", "__builtin__", "collections")
_BODY = len(JOINT_NAMES)
_MAX_BETA = 20.0
_MAX_ARRAY = 2**29
"""Largest array; SMPL-X's shape directions take 100 MB."""


@dataclass(frozen=True)
class _Kind:
    """A body model, told by its number of joints; which of its joints are our fixed points."""

    name: str
    points: dict[str, int]


def _hands(first_left: int, first_right: int) -> dict[str, int]:
    """Knuckles: each hand's fingers come as index, middle, pinky, ring, thumb, with three joints each."""
    fingers = {"index": 0, "middle": 3, "pinky": 6, "thumb": 13}
    sides = (("left", first_left), ("right", first_right))
    return {f"{side}_{finger}": first + at for side, first in sides for finger, at in fingers.items()}


_KINDS = {
    24: _Kind("SMPL", {}),
    52: _Kind("SMPL-H", _hands(22, 37)),
    55: _Kind("SMPL-X", {"left_eye": 23, "right_eye": 24, **_hands(25, 40)}),
}


def open_skeleton(path: Path, betas: Sequence[float] = ()) -> Skeleton:
    """The skeleton of a body model with the given shape, or one that `save_skeleton` wrote.

    Its 22 body joints replace ours; so do the knuckles (SMPL-X, SMPL-H) and eyes (SMPL-X). Toes, heels and what the
    model does not have stay ours.

    Args:
        path: SMPL-X `.npz`, SMPL or SMPL-H `.pkl` or `.npz`, or `.safetensors`.
        betas: first shape coefficients; those left out are 0.

    Raises:
        UserError: the file is missing, damaged, hostile, of another kind, or has fewer shape directions than betas.
    """
    path = Path(path)
    if path.suffix == ".safetensors":
        return _read_saved(path)
    readers = {".npz": _read_npz, ".pkl": _read_pickle}
    if os.path.isdir(path):
        raise UserError(f"{path}: is a folder; name the body model in it, for instance SMPLX_NEUTRAL.npz")
    if path.suffix not in readers:
        raise UserError(f"{path}: expected a body model .npz (SMPL-X, SMPL-H, SMPL) or .pkl (SMPL, SMPL-H)")
    arrays = readers[path.suffix](path)
    try:
        return _build(arrays, betas)
    except UserError as error:
        raise UserError(f"{path}: {error}") from error


def save_skeleton(path: Path, skeleton: Skeleton) -> None:
    """Writes a skeleton's lengths atomically."""
    tensors = {"offsets": skeleton.offsets_J3, "point_offsets": skeleton.point_offsets_E3}
    write_tensors(path, tensors, {"schema": SCHEMA})


def _read_saved(path: Path) -> Skeleton:
    tensors, metadata = read_tensors(path)
    if metadata.get("schema") != SCHEMA:
        raise UserError(f"{path}: schema is '{metadata.get('schema')}', expected '{SCHEMA}' (a skeleton of mrhubo)")
    try:
        return Skeleton(tensors["offsets"], tensors["point_offsets"])
    except KeyError as error:
        raise UserError(f"{path}: is no skeleton of mrhubo: {error} is missing") from error
    except UserError as error:
        raise UserError(f"{path}: {error}") from error


def _read_npz(path: Path) -> dict[str, np.ndarray]:
    with open_npz(path) as file:
        missing = [key for key in _KEYS if key not in file.keys]
        if missing:
            raise UserError(_missing(path, missing[0], file.keys))
        return {key: file.read(key, max_bytes=_MAX_ARRAY) for key in _KEYS}


def _read_pickle(path: Path) -> dict[str, np.ndarray]:
    check_regular(path, MAX_BYTES)
    try:
        content = read_pickle(path, _PICKLE_MODULES)
    except UserError as error:
        raise UserError(f"{path}: cannot be read as a body model: {error}") from error
    if not isinstance(content, dict):
        raise UserError(f"{path}: expected a dictionary, found {type(content).__name__}; it is no body model")
    arrays = {}
    for key in _KEYS:
        if key not in content:
            raise UserError(_missing(path, key, {k for k in content if isinstance(k, str)}))
        try:
            arrays[key] = to_array(content[key])
        except UserError as error:
            raise UserError(f"{path}: '{key}': {error}") from error
    return arrays


def _missing(path: Path, key: str, found: set[str]) -> str:
    holds = ", ".join(map(shortened, sorted(found)[:12])) or "nothing"
    return f"{path}: has no '{key}', so it is no body model; it holds: {holds}"


@np.errstate(all="ignore")  # what overflows is found out below
def _build(arrays: dict[str, np.ndarray], betas: Sequence[float]) -> Skeleton:
    regressor_JV, template_V3, shapes_V3S = (arrays[k] for k in ("J_regressor", "v_template", "shapedirs"))
    if regressor_JV.ndim != 2 or regressor_JV.shape[0] not in _KINDS:
        kinds = ", ".join(f"{kind.name} has {count}" for count, kind in _KINDS.items())
        raise UserError(f"'J_regressor' has shape {regressor_JV.shape}; expected (joints, vertices), where {kinds}")
    joints, vertices = regressor_JV.shape
    for key, array, expected in (
        ("v_template", template_V3, (vertices, 3)),
        ("shapedirs", shapes_V3S[:, :, :1] if shapes_V3S.ndim == 3 else shapes_V3S, (vertices, 3, 1)),
        ("kintree_table", arrays["kintree_table"], (2, joints)),
    ):
        if array.shape != expected:
            shape = arrays[key].shape
            raise UserError(f"'{key}' has shape {shape}, which does not fit {joints} joints and {vertices} vertices")
    parents = arrays["kintree_table"][0, 1:_BODY].astype(np.int64).tolist()
    if tuple(parents) != PARENTS[1:]:
        raise UserError("'kintree_table' is not the tree of SMPL's body joints")
    shape_B = _check_betas(betas, joints, shapes_V3S.shape[2])
    mesh_V3 = template_V3.astype(np.float64) + shapes_V3S[..., : len(shape_B)].astype(np.float64) @ shape_B
    rest_J3 = regressor_JV.astype(np.float64) @ mesh_V3
    if not np.isfinite(rest_J3).all():
        raise UserError("its joints are not finite: 'v_template', 'shapedirs' or 'J_regressor' holds NaN")
    offsets_J3 = rest_J3[1:_BODY] - rest_J3[list(PARENTS[1:])]
    points_E3 = Skeleton().point_offsets_E3.double().numpy().copy()
    for name, joint in _KINDS[joints].points.items():
        parent = KEYPOINT_JOINT[KEYPOINT_NAMES.index(name)]
        points_E3[POINT_NAMES.index(name)] = rest_J3[joint] - rest_J3[parent]
    return Skeleton(torch.from_numpy(offsets_J3).float(), torch.from_numpy(points_E3).float())


def _check_betas(betas: Sequence[float], joints: int, directions: int) -> np.ndarray:
    shape_B = np.asarray(betas, dtype=np.float64)
    # SMPL-X keeps shape and expression in one array: 300 + 100, or 10 + 10 in its first version.
    limit = {400: 300, 20: 10}.get(directions, directions) if joints == max(_KINDS) else directions
    if len(shape_B) > limit:
        raise UserError(f"has {limit} shape directions, but body.betas gives {len(shape_B)} numbers")
    if not (np.abs(shape_B) <= _MAX_BETA).all():
        raise UserError(f"body.betas must be numbers from {-_MAX_BETA:g} to {_MAX_BETA:g}, found {list(betas)}")
    return shape_B
