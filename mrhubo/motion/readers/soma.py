"""Motions of SOMA's skeleton, as Kimodo, GEM-X and SOMA-X write them.

SOMA's rotations refer to a T-pose whose axes are the world's, as ours do: x to the body's left, y up, z forward
(https://github.com/NVlabs/SOMA-X, soma/soma.py, "Pose tensor"). Which joint is which is told by names: SOMA calls a
thigh `LeftLeg`, and an upper arm `LeftArm`. Where a file has the joints' places too, limbs point exactly as they say.

Legend: T frames, K joints of SOMA's, J = 21: SMPL's joints 1..21.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mrhubo.body.joints import JOINT_NAMES, OFFSETS_J3, POSED_JOINT_NAMES, SIDES, local_rotations
from mrhubo.errors import UserError
from mrhubo.fast.plain.human import normalize
from mrhubo.fast.rotations import orthonormal, shortest_turn
from mrhubo.files.tree import Tree
from mrhubo.motion.far_places import kept_places
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.assemble import MAX_FRAMES, MAX_ROOT_TURN, upright
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rotations import find_form, rows_of, to_matrices
from mrhubo.motion.readers.smpl_names import search
from mrhubo.motion.readers.world import WORLDS

_FINGERS = tuple(
    f"Hand{finger}{part}"
    for finger, parts in (("Thumb", "123"), ("Index", "1234"), ("Middle", "1234"), ("Ring", "1234"), ("Pinky", "1234"))
    for part in (*parts, "End")
)
_FEW_FINGERS = ("HandThumbEnd", "HandMiddleEnd")


def _names(fingers: tuple[str, ...], head: tuple[str, ...], toes: tuple[str, ...]) -> tuple[str, ...]:
    """SOMA's joints in its order, whatever of fingers, face and toes a variant has."""
    arm, leg = ("Shoulder", "Arm", "ForeArm", "Hand", *fingers), ("Leg", "Shin", "Foot", "ToeBase", *toes)
    trunk = ("Hips", "Spine1", "Spine2", "Chest", "Neck1", "Neck2", "Head", *head)
    return (*trunk, *(f"{side}{name}" for part in (arm, leg) for side in ("Left", "Right") for name in part))


_ALL = _names(_FINGERS, ("HeadEnd", "Jaw", "LeftEye", "RightEye"), ("ToeEnd",))
_ORDERS = {
    77: _ALL,
    78: ("Root", *_ALL),
    30: _names(_FEW_FINGERS, ("Jaw", "LeftEye", "RightEye"), ()),
}
"""By how many joints there are; https://github.com/nv-tlabs/kimodo, kimodo/skeleton/definitions.py."""
_CHAIN = {
    "Hips": "", "Spine1": "Hips", "Spine2": "Spine1", "Chest": "Spine2",
    "Neck1": "Chest", "Neck2": "Neck1", "Head": "Neck2",
    **{
        f"{side}{name}": f"{side}{parent}" if parent not in ("Chest", "Hips") else parent
        for side in ("Left", "Right")
        for name, parent in (
            ("Shoulder", "Chest"), ("Arm", "Shoulder"), ("ForeArm", "Arm"), ("Hand", "ForeArm"),
            ("Leg", "Hips"), ("Shin", "Leg"), ("Foot", "Shin"), ("ToeBase", "Foot"),
        )
    },
}  # fmt: skip
"""The joints that are read, parents first, and their parents."""
_OURS = {
    "pelvis": "Hips", "spine1": "Spine1", "spine2": "Spine2", "spine3": "Chest", "neck": "Neck2", "head": "Head",
    **{
        f"{side}_{ours}": f"{side.capitalize()}{theirs}"
        for side in SIDES
        for ours, theirs in (
            ("collar", "Shoulder"), ("shoulder", "Arm"), ("elbow", "ForeArm"), ("wrist", "Hand"),
            ("hip", "Leg"), ("knee", "Shin"), ("ankle", "Foot"), ("foot", "ToeBase"),
        )
    },
}  # fmt: skip
"""Which of SOMA's joints turns what each of SMPL's does."""
_LIMBS = {
    f"{side}_{joint}": f"{side}_{end}"
    for side in SIDES
    for joint, end in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
}
"""The joint at the end of each limb, by the joint that turns it."""


@dataclass(frozen=True)
class _Arrays:
    """What a file has of somebody."""

    source: str
    key: str
    local: np.ndarray
    """Rotations (T, K, 3) or (T, K, 3, 3), each relative to its parent."""
    names: tuple[str, ...]
    """Of the K joints."""
    places: np.ndarray | None = None
    """Of the joints (T, K, 3) [m]."""
    root: np.ndarray | None = None
    """Places of the hips (T, 3) [m]."""


def read_soma(tree: Tree, options: ReadOptions, find_rate: Callable[[list[str]], float]) -> Motion | None:
    """Reads a motion of SOMA's skeleton; None of anything else.

    Args:
        tree: the file.
        options: may ask for a person, of whom there is one only.
        find_rate: gives the frame rate, and may add to the notes.

    Raises:
        UserError: the numbers are no motion, or the frame rate is not known.
    """
    arrays = search(tree, _find)
    if arrays is None:
        return None
    missing = sorted(set(_CHAIN) - set(arrays.names) - {"Neck2"})
    if missing:
        raise UserError(f"{tree.path}: is of SOMA's skeleton, but has no joint {', '.join(missing)}")
    notes = options.of_one()
    world = _world(tree, arrays)
    if arrays.places is not None:
        _point(world, arrays, notes)
    local_TJ33 = local_rotations(np.stack([world[_OURS[joint]] for joint in JOINT_NAMES], axis=1))
    name = motion_name(tree.path)
    motion = Motion.of(
        name=name,
        local_TJ33=orthonormal(local_TJ33).astype(np.float32),
        frame_rate=find_rate(notes),
        description=name,
        root_rotation_T33=world["Hips"].astype(np.float32),
        root_position_T3=_root(arrays, len(local_TJ33), notes),
        source=f"{arrays.source}, '{arrays.key}'",
        notes=tuple(notes),
    )
    limbs = "limbs point as the joints' places say" if arrays.places is not None else "rotations refer to a T-pose"
    return upright(motion, WORLDS, limbs)


def _find(node: Tree) -> _Arrays | None:
    """What is SOMA's in a dictionary.

    Kimodo: `local_rot_mats` (T, 77, 3, 3), `posed_joints` (T, 77, 3), `root_positions`, of 30 joints in older files
    (https://research.nvidia.com/labs/sil/projects/kimodo/docs/user_guide/output_formats.html). GEM-X: `body_pose` (T,
    76 x 3), `global_orient` (T, 3), `transl` (https://github.com/NVlabs/GEM-X). SOMA-X: `poses` (T, 77, 3) or (T, 77,
    3, 3), `joint_names`, `transl`, `unit`, and whether rotations are without the T-pose's, `absolute_pose`
    (https://github.com/NVlabs/SOMA-X, soma/io.py).
    """
    if not node.is_mapping:
        return None
    keys = set(node.keys)
    if "local_rot_mats" in keys:
        shape = node["local_rot_mats"].shape() or ()
        if len(shape) == 4 and shape[1] in _ORDERS:
            names, places = _ORDERS[shape[1]], node.get("posed_joints")
            joints = places.array() if places is not None and places.shape() == (*shape[:2], 3) else None
            local, root = node["local_rot_mats"].array(), node.find_array("root_positions")
            return _Arrays("Kimodo", "local_rot_mats", local, names, joints, root)
    if {"body_pose", "global_orient"} <= keys:
        body, root = node.find_array("body_pose"), node.find_array("global_orient")
        frames = len(body) if body is not None and body.ndim else 0
        if body is not None and root is not None and frames and (body.size, root.size) == (76 * 3 * frames, 3 * frames):
            local = np.concatenate((root.reshape(-1, 1, 3), body.reshape(-1, 76, 3)), axis=1)
            return _Arrays("GEM-X", f"{node.where}[body_pose]", local, _ALL, None, node.find_array("transl"))
    if {"poses", "joint_names"} <= keys:
        names = tuple(node["joint_names"].texts())
        poses = node.find_array("poses")
        if poses is not None and poses.ndim in (3, 4) and len(names) == poses.shape[1] and "Hips" in names:
            return _soma_x(node, poses, names)
    return None


def _soma_x(node: Tree, poses: np.ndarray, names: tuple[str, ...]) -> _Arrays:
    absolute = node.find_array("absolute_pose")
    if absolute is not None and absolute.size == 1 and bool(absolute.reshape(-1)[0]):
        raise UserError(
            f"{node.path}: its rotations are absolute ('absolute_pose'), which only SOMA's own rig can read; save them"
            " relative to the T-pose, with 'joint_orient'"
        )
    unit = node.get("unit")
    metres = {"centimeters": 0.01, "millimeters": 0.001}.get((unit.text() or "") if unit is not None else "", 1.0)
    root = node.find_array("transl")
    return _Arrays("SOMA-X", "poses", poses, names, None, None if root is None else root * metres)


def _world(tree: Tree, arrays: _Arrays) -> dict[str, np.ndarray]:
    """Rotations (T, 3, 3) in the world, float64, of the joints that are read."""
    frames, joints = arrays.local.shape[:2]
    form = find_form(arrays.local.shape, (joints,))
    if form is None or not 0 < frames <= MAX_FRAMES:
        raise UserError(
            f"{tree.path}: '{arrays.key}' has shape {arrays.local.shape}; expected (frames, {joints}, 3, 3)"
        )
    local_TK33 = to_matrices(arrays.local.reshape(frames, -1), form, MAX_ROOT_TURN)
    if local_TK33 is None:
        raise UserError(f"{tree.path}: '{arrays.key}' holds NaN, infinite numbers, or what is no rotation")
    identity_T33 = np.broadcast_to(np.eye(3), (frames, 3, 3))
    world: dict[str, np.ndarray] = {"": identity_T33}
    for name, parent in _CHAIN.items():
        turn_T33 = local_TK33[:, arrays.names.index(name)].astype(np.float64) if name in arrays.names else identity_T33
        world[name] = world[parent] @ turn_T33
    return world


def _point(world: dict[str, np.ndarray], arrays: _Arrays, notes: list[str]) -> None:
    """Turns limbs by the shortest way so that they point as the joints' places say."""
    assert arrays.places is not None
    if not np.isfinite(arrays.places).all():
        notes.append("'posed_joints' is left out: it holds NaN or infinite numbers")
        return
    offsets = dict(zip(POSED_JOINT_NAMES, OFFSETS_J3.astype(np.float64), strict=True))
    for joint, end in _LIMBS.items():
        start_T3, end_T3 = (
            arrays.places[:, arrays.names.index(_OURS[name])].astype(np.float64) for name in (joint, end)
        )
        limb_T3 = normalize(end_T3 - start_T3)
        rest_3 = normalize(offsets[end])
        world[_OURS[joint]] = shortest_turn(world[_OURS[joint]] @ rest_3, limb_T3) @ world[_OURS[joint]]


def _root(arrays: _Arrays, frames: int, notes: list[str]) -> np.ndarray | None:
    root = arrays.root
    if root is None:
        return None
    rows_TX = rows_of(root)
    if rows_TX.shape != (frames, 3):
        notes.append(f"where the root goes is left out: its shape is {root.shape}")
        return None
    return kept_places(rows_TX, "where the root goes", notes)
