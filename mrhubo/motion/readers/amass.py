"""Human motions from .npz files with the keys of AMASS, SMPL-X or SMPL-H.

Such files come from strangers: nothing in them is unpickled, sizes are checked against their headers before anything is
read, and whatever is wrong with what is needed becomes a UserError that names the file, the key and the frame. What is
not needed (the root, the body's shape, the description) is left out where it cannot be used, with a note.

The layout is that of https://amass.is.tue.mpg.de, whose files are told at https://github.com/nghorbani/amass.

Legend: T frames, X numbers of a row.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.npz import NpzFile, open_npz
from mrhubo.files.tree import Tree, tree_of
from mrhubo.motion.far_places import kept_places
from mrhubo.motion.motion import SOLE_POINTS, Motion
from mrhubo.motion.readers.assemble import (
    BLOCK,
    LARGEST_BETA,
    MAX_FRAMES,
    MAX_ROOT_TURN,
    in_metres,
    to_our_rest,
    upright,
)
from mrhubo.motion.readers.content import Content
from mrhubo.motion.readers.family import find_family
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import RATE_KEYS, TIME_KEYS, find_rate
from mrhubo.motion.readers.rotations import Form, find_form, read_local, to_matrices
from mrhubo.motion.readers.smpl_names import PLACES, ROOTS
from mrhubo.motion.readers.world import ANY_WORLD, Z_UP
from mrhubo.motion.writers.amass import CONTACT_KEY

_MAX_SMALL = 1_000_000
"""Bytes of an array that holds a number, some, or a text."""
_POSE_KEYS = ("pose_body", "poses")
_ITS_OWN = {"dmpls", "markers_latent", "latent_labels"}
"""Keys of AMASS's own files alone: of the soft tissue beside SMPL-H, or of the markers beside SMPL-X, of which files
that others wrote with its keys have none.
"""
_OTHER_NAMES = {"root_orient": {*ROOTS} - {"root_orient"}, "trans": {*PLACES} - {"trans"}}
"""What else files call what AMASS calls so; such files are read by `mrhubo.motion.readers.smpl_names`."""
_JOINTS = {
    "pose_body": {21: "body without root", 23: "SMPL without root"},
    "poses": {22: "body", 24: "SMPL", 52: "SMPL-H", 55: "SMPL-X"},
}
"""How many joints each has, and what has so many."""


def is_amass(content: Content) -> bool:
    """Whether a file has a pose under a key of AMASS, of one person, or is a zip archive too damaged to tell."""
    if not content.is_zip or content.is_torch:
        return False
    key = next((key for key in _POSE_KEYS if key in content.arrays), None)
    if "joint_names" in content.arrays:  # SOMA-X, whose joints are others
        return False
    if any(ours not in content.arrays and theirs & content.arrays for ours, theirs in _OTHER_NAMES.items()):
        return False
    return not content.names or (key is not None and not _has_people(content.path, key))


def _has_people(path: Path, key: str) -> bool:
    """Whether a pose has an axis for people before that of the frames, as SLAHMR's has."""
    try:
        with open_npz(path) as file:
            shape = file.shape(key)
    except UserError:
        return False
    return find_form(shape, _JOINTS[key]) is None and find_form(shape[1:], _JOINTS[key]) is not None


@np.errstate(all="ignore")  # what overflows is found out below
def read_amass(path: Path, options: ReadOptions) -> Motion:
    """Reads `pose_body` (T, 63), or `poses` (T, 66 or more) with the root's three numbers first.

    Joints may have an axis of their own, and be matrices: (T, 21, 3), (T, 52, 3, 3).

    The root is read from `root_orient` or from `poses`, and from `trans`. AMASS's world has its z axis up; of other
    files of this kind, the body tells: y or z is up, or y is down, as in the cameras' worlds of BEHAVE
    (https://virtualhumans.mpi-inf.mpg.de/behave), HuMoR (https://github.com/davrempe/humor) and who saves what an
    estimator saw.

    Rotations refer to the rest pose of the body model that the file says it is of; they are told in our skeleton's.

    Raises:
        UserError: the file is missing, damaged, hostile, too large, or not a motion.
    """
    notes = options.of_one()
    with open_npz(path) as file:
        key, form, local_TJ33 = _read_pose(file)
        frame_rate = find_rate(path, [_rates(file)], options, notes)
        description = _read_description(file, notes)
        root_rotation_T33, root_position_T3 = _read_root(file, key, form, len(local_TJ33), notes)
        betas = _read_betas(file, notes)
        contact_T4 = _read_contacts(file, len(local_TJ33), notes)
        family, rest = find_family(file, betas)
        worlds = Z_UP if _ITS_OWN & file.keys else ANY_WORLD
    name = motion_name(path)
    motion = Motion.of(
        name=name,
        local_TJ33=local_TJ33,
        frame_rate=frame_rate,
        description=description or name,
        root_rotation_T33=root_rotation_T33,
        root_position_T3=root_position_T3,
        betas=betas,
        contact_T4=contact_T4,
        source=f"SMPL-family .npz with '{key}'",
        family=family,
        notes=tuple(notes),
    )
    return to_our_rest(in_metres(upright(motion, worlds, rest), "'trans'"))


def _read_pose(file: NpzFile) -> tuple[str, Form, np.ndarray]:
    """The key that holds the pose, its form, and local rotations (T, 21, 3, 3), float32."""
    path, keys = file.path, file.keys
    key = next((key for key in _POSE_KEYS if key in keys), None)
    if key is None:
        found = ", ".join(map(shortened, sorted(keys)[:12])) or "nothing"
        raise UserError(f"{path}: holds neither 'pose_body' nor 'poses', so it is no human motion; it holds: {found}")
    shape, counts = file.shape(key, max_rows=MAX_FRAMES), _JOINTS[key]
    if "root_orient" in keys:
        counts = {**_JOINTS["pose_body"], **counts}
    form = find_form(shape, counts)
    if form is None:
        expected = " or ".join(f"(frames, {3 * joints}) ({what})" for joints, what in counts.items())
        raise UserError(f"{path}: '{key}' has shape {shape}; expected {expected}, or matrices (frames, joints, 3, 3)")
    first = 0 if form.joints in _JOINTS["pose_body"] else 1
    return key, form, read_local(path, key, shape[0], _blocks(file, key), form, first)


def _rates(file: NpzFile) -> Tree:
    """What may tell the frame rate; `None` in place of what cannot be read, or is pickled."""
    told: dict[str, Any] = {}
    for key in (*RATE_KEYS, *TIME_KEYS):
        if key in file.keys:
            try:
                told[key] = file.read_any(key, lambda _: None, _MAX_SMALL)
            except UserError:
                told[key] = None
    return tree_of(told, file.path, "")


def _blocks(file: NpzFile, key: str) -> Iterator[tuple[int, np.ndarray]]:
    """The rows of an array (T, ...), float64, block by block (N, X), each with the number of its first frame."""
    start = 0
    for block in file.blocks(key, BLOCK, MAX_FRAMES):
        yield start, block.astype(np.float64)
        start += len(block)


def _read_root(
    file: NpzFile, pose_key: str, form: Form, frames: int, notes: list[str]
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Rotations (T, 3, 3) and places (T, 3) of the root, as the file has them."""
    rotation_T33 = None
    if "root_orient" in file.keys:
        rows_TX = _read_rows(file, "root_orient", frames, (3, 9), notes)
        rotation_T33 = _root_matrices("root_orient", rows_TX, notes)
    elif pose_key == "poses":
        rotation_T33 = _root_matrices("poses", _read_rows(file, "poses", frames, (form.numbers,), notes, True), notes)
    position_T3 = None
    if "trans" in file.keys:
        if rotation_T33 is None:
            notes.append("'trans' is left out: without the root's rotation its up axis is not known")
            return None, None
        position_T3 = _read_rows(file, "trans", frames, (3,), notes)
    return rotation_T33, None if position_T3 is None else kept_places(position_T3, "'trans'", notes)


def _read_contacts(file: NpzFile, frames: int, notes: list[str]) -> np.ndarray | None:
    """Whether soles are planted (T, 4), of `contact`, whose columns are `SOLE_POINTS`, as mrhubo writes it."""
    if CONTACT_KEY not in file.keys:
        return None
    try:
        shape = file.shape(CONTACT_KEY, "fiub", max_rows=MAX_FRAMES)
        if shape != (frames, len(SOLE_POINTS)):
            raise UserError(f"has shape {shape}; expected {(frames, len(SOLE_POINTS))}")
        return file.read(CONTACT_KEY, "fiub") != 0
    except UserError as error:
        notes.append(f"'{CONTACT_KEY}' is left out: {shortened(str(error), 200)}")
        return None


def _root_matrices(key: str, rows_TX: np.ndarray | None, notes: list[str]) -> np.ndarray | None:
    """Rotations (T, 3, 3) of rows (T, 3 or 9); None, and a note, where they are none."""
    if rows_TX is None:
        return None
    rotation_T133 = to_matrices(rows_TX, Form(1, rows_TX.shape[1] == 9), MAX_ROOT_TURN)
    if rotation_T133 is None:
        notes.append(f"'{key}' is left out: it holds NaN, infinite numbers, or what is no rotation in radians")
        return None
    return rotation_T133[:, 0]


def _read_rows(
    file: NpzFile, key: str, frames: int, widths: tuple[int, ...], notes: list[str], more: bool = False
) -> np.ndarray | None:
    """The rows (T, X), float64, of an array that a motion can do without; None, and a note, where it cannot be used.

    Args:
        file: the file.
        key: the array.
        frames: T.
        widths: which X there may be.
        notes: is told what is left out.
        more: whether a row may have more numbers than the first X, which are taken.
    """
    try:
        shape = file.shape(key, max_rows=MAX_FRAMES)
        width = int(np.prod(shape[1:]))
        if len(shape) < 2 or shape[0] != frames or not (more or width in widths):
            expected = " or ".join(f"({frames}, {width})" for width in widths)
            notes.append(f"'{key}' is left out: its shape is {shape}; expected {expected}")
            return None
        return np.concatenate([rows[:, : widths[0] if more else width] for _, rows in _blocks(file, key)])
    except UserError as error:
        notes.append(f"'{key}' is left out: {error}")
        return None


def _read_betas(file: NpzFile, notes: list[str]) -> tuple[float, ...] | None:
    """The body's shape, if the file has one."""
    if "betas" not in file.keys:
        return None
    try:
        array = file.read("betas", max_bytes=_MAX_SMALL)
    except UserError as error:
        notes.append(f"'betas' is left out: {error}")
        return None
    if array.ndim == 2:  # a row a frame, or one for all
        array = array.mean(axis=0)
    if array.ndim != 1 or len(array) > 400 or not (np.abs(array) < LARGEST_BETA).all():
        notes.append(f"'betas' is left out: expected up to 400 finite numbers, found the shape {array.shape}")
        return None
    return tuple(float(number) for number in array.astype(np.float64))


def _read_description(file: NpzFile, notes: list[str]) -> str:
    """The description, or nothing where the file has none that is text."""
    if "description" not in file.keys:
        return ""
    try:
        array = file.read("description", kinds="U", max_bytes=_MAX_SMALL)
    except UserError as error:
        notes.append(f"'description' is left out: {error}")
        return ""
    text = str(array.reshape(())) if array.size == 1 else ""
    return " ".join("".join(c for c in text[:1000] if c.isprintable() or c.isspace()).split())
