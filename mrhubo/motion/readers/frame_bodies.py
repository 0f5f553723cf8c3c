"""SMPL parameters of whoever is seen in one frame, in a file that has nothing else.

* EasyMocap: a list, or `annots`, of people with `id`, `Rh` (1, 3), `Th` (1, 3), `shapes` and `poses`, (1, 72) of SMPL's
  joints, (1, 78) of SMPL-H's and (1, 87) of SMPL-X's body with coefficients of hands and face, the first three 0. The
  body turns by `Rh` about the model's origin, not about the pelvis, and then goes to `Th`
  (https://github.com/zju3dv/EasyMocap/blob/master/doc/02_output.md).
* SMPLer-X and its kin: `global_orient` (1, 3), `body_pose` (21, 3), `transl` (1, 3), `betas`, a file a person
  (https://github.com/SMPLCap/SMPLer-X, main/inference.py).
* FrankMocap: `pred_output_list`, an entry a person, `None` or with `pred_body_pose` (1, 72), and `smpl_type` and
  `body_bbox_list`, rows of x, y, width and height (https://github.com/facebookresearch/frankmocap,
  mocap_utils/demo_utils.py).

Legend: K joints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mrhubo.errors import UserError
from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.files.tree import Tree
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.family import family_of
from mrhubo.motion.readers.rotations import Form
from mrhubo.motion.readers.sightings import person_called

_FORMS = {
    **{3 * joints: Form(joints, False) for joints in (21, 22, 23, 24, 52, 55)},
    **{9 * joints: Form(joints, True) for joints in (21, 22, 23, 24, 52, 55)},
}
"""By how many numbers a pose has."""
_EASYMOCAP = {78: "smplh", 87: "smplx"}
"""How many numbers a pose of EasyMocap has that ends with coefficients, and of which model it is."""
_BODY = 66
_PELVIS = {"smplx": (0.0, -0.35, 0.01)}
_SMPL_PELVIS = (0.0, -0.22, 0.03)
"""Where the pelvis of a mean body at rest is from the model's origin [m], from the sources of
`mrhubo.body.rest_directions`."""
_MOST, _LONGEST = 100, 9 * 55
"""People in a frame, and numbers of a pose."""


@dataclass(frozen=True)
class Body:
    """Somebody in a frame."""

    person: str | None
    """What the file calls them; None where it does not."""
    key: str
    """What the file calls their pose."""
    pose: np.ndarray
    """Numbers of a row, as `form` says."""
    form: Form
    root: np.ndarray | None
    """Rotation of the root, 3 or 9 numbers; None where the pose has it."""
    place: np.ndarray | None
    """Where the root is (3,) [m]."""
    betas: np.ndarray | None
    box: np.ndarray | None
    """Where the middle of the box around them is in the picture (2,), in heights of the box."""
    source: str
    family: str


def bodies_in(tree: Tree) -> list[Body] | None:
    """Everybody in a file of one frame; None where it is no such file.

    Raises:
        UserError: there are too many, or something in it is no array that can be used.
    """
    listed = tree.get("pred_output_list", "annots") if tree.is_mapping else tree if tree.is_list else None
    if listed is None:
        body = _body(tree, tree, None)
        return None if body is None else [body]
    if not listed.is_list:
        return None
    if len(listed) > _MOST:
        raise UserError(f"{listed.named} has {len(listed):,} people; expected at most {_MOST}")
    boxes = tree.get("body_bbox_list") if tree.is_mapping else None
    frames_boxes = [*boxes] if boxes is not None and len(boxes) == len(listed) else [None] * len(listed)
    found = [(node, _body(node, tree, box)) for node, box in zip(listed, frames_boxes, strict=True) if not node.is_none]
    if any(body is None for node, body in found) or (not found and tree is listed):
        return None
    return [body for _, body in found if body is not None]


def refuse_frame(tree: Tree) -> None:
    """Refuses a file of a single frame, which is a motion beside others.

    Raises:
        NoMotion: it is one; says so.
    """
    if bodies_in(tree) is not None:
        raise NoMotion(
            f"{tree.path}: holds SMPL parameters of a single frame; name the folder that holds a file for each frame"
        )


def _body(node: Tree, around: Tree, box: Tree | None) -> Body | None:
    """Somebody's parameters in a dictionary; None where it has none, or those of several frames."""
    keys = set(node.keys)
    if {"Rh", "Th", "poses"} <= keys:
        return _easymocap(node)
    for pose_key, root_keys in (
        ("pred_rotmat", ()),
        ("pred_body_pose", ()),
        ("body_pose", ("global_orient", "root_pose", "root_orient")),
    ):
        if pose_key not in keys:
            continue
        root = next((node[key] for key in root_keys if key in keys), None)
        pose = _one_frame(node[pose_key])
        turn = None if root is None else _one_frame(root)
        form = None if pose is None else _FORMS.get(pose.size)
        if pose is None or form is None or (bool(root_keys) and (turn is None or turn.size not in (3, 9))):
            return None
        betas = _one_frame(node.get("betas", "pred_betas", "shape"))
        said = around.get("smpl_type")
        named = "" if said is None else said.text() or ""
        family = family_of(named, form.joints, keys, None if betas is None else betas.tolist())
        source = "FrankMocap" if not root_keys else "SMPL parameters"
        place = _three(_one_frame(node.get("transl", "trans")))
        return Body(None, pose_key, pose, form, turn, place, betas, _middle(box), source, family)
    return None


def _easymocap(node: Tree) -> Body | None:
    pose, turn, place = (_one_frame(node[key]) for key in ("poses", "Rh", "Th"))
    if pose is None or turn is None or place is None or turn.size != 3 or place.size != 3:
        return None
    family = _EASYMOCAP.get(pose.size, "")
    pose = pose[:_BODY] if family else pose
    form = _FORMS.get(pose.size)
    if form is None or form.matrices:
        return None
    family = family or family_of("", form.joints, node.keys, None) or "smplx"
    pelvis_3 = np.array(_PELVIS.get(family, _SMPL_PELVIS))
    place = place + axis_angle_to_matrix(turn.astype(np.float64)) @ pelvis_3
    number = node.get("id", "personID")
    person = None if number is None else person_called(number.text() or number.number())
    betas = _one_frame(node.get("shapes"))
    return Body(person, "poses", pose, form, turn, place, betas, None, "EasyMocap", family)


def _one_frame(node: Tree | None) -> np.ndarray | None:
    """The numbers of one frame in a row: of an array (X,), (K, 3) or (K, 3, 3), perhaps with axes of one before them;
    None of anything else, such as several frames.
    """
    shape = None if node is None else node.shape()
    if node is None or shape is None or not 0 < math.prod(shape) <= _LONGEST:
        return None
    while len(shape) > 1 and shape[0] == 1:
        shape = shape[1:]
    if len(shape) > 3 or (len(shape) > 1 and set(shape[1:]) != {3}):
        return None
    return node.array().reshape(-1).astype(np.float64)


def _three(place: np.ndarray | None) -> np.ndarray | None:
    return place if place is not None and place.size == 3 else None


def _middle(box: Tree | None) -> np.ndarray | None:
    corner = _one_frame(box)
    if corner is None or corner.size < 4 or not corner[3] > 0:
        return None
    return (corner[:2] + corner[2:4] / 2) / corner[3]
