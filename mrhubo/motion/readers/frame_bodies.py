"""SMPL parameters of whoever is seen in one frame, in a file that has nothing else, or in one place of a file.

* EasyMocap: a list, or `annots`, of people with `id`, `Rh` (1, 3), `Th` (1, 3), `shapes` and `poses`, (1, 72) of SMPL's
  joints, (1, 78) of SMPL-H's and (1, 87) of SMPL-X's body with coefficients of hands and face, the first three 0. The
  body turns by `Rh` about the model's origin, not about the pelvis, and then goes to `Th`
  (https://github.com/zju3dv/EasyMocap/blob/master/doc/02_output.md).
* SMPLer-X and its kin: `global_orient` (1, 3), `body_pose` (21, 3), `transl` (1, 3), `betas`, a file a person
  (https://github.com/SMPLCap/SMPLer-X, main/inference.py).
* FrankMocap: `pred_output_list`, an entry a person, `None` or with `pred_body_pose` (1, 72), and `smpl_type` and
  `body_bbox_list`, rows of x, y, width and height (https://github.com/facebookresearch/frankmocap,
  mocap_utils/demo_utils.py).
* Human3R: `rotvec` (N, 53, 3), `transl` (N, 3) and `shape` of N people in the folder `smpl`
  (https://github.com/fanegg/Human3R, demo.py).
* Multi-HMR: a list of people with `rotvec` (53, 3) of SMPL-X's joints, the root first, without eyes, `transl_pelvis`
  (1, 3) and `shape` (https://github.com/naver/multi-hmr, model.py); those of its data, and SOKE's
  (https://github.com/2000ZRL/SOKE), `smplx_root_pose`, `smplx_body_pose`, `smplx_transl` or `cam_trans`.
* 4D-Humans' HMR2: `pred_smpl_params` with `global_orient` (N, 1, 3, 3) and `body_pose` (N, 23, 3, 3) of N people, and
  beside it `pred_cam_t` (N, 3) (https://github.com/shubham-goel/4D-Humans, hmr2/models/hmr2.py).

Legend: K joints, N people, X numbers of a row.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np

from mrhubo.body.rest_directions import FAMILIES
from mrhubo.errors import UserError
from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.files.tree import Tree
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.family import family_of
from mrhubo.motion.readers.key_words import by_usual_names, model_named, usual_name, without_world
from mrhubo.motion.readers.rotations import WITH_ROOT, WITHOUT_ROOT, Form, find_form
from mrhubo.motion.readers.sightings import person_called

_COUNTS = WITHOUT_ROOT + WITH_ROOT
_POSES = (
    "pred_rotmat", "pred_body_pose", "rotvec", "body_pose", "pose_body", "smpl_pose", "pose", "poses", "thetas",
)  # fmt: skip
_ROOTS = ("global_orient", "root_pose", "root_orient")
_PLACES = ("transl_pelvis", "transl", "trans", "pred_cam_t", "cam_t", "cam_trans")
_LISTS = ("pred_output_list", "annots", "people", "persons", "instances", "humans")
"""What frames call a list of whoever is in them."""
_IDS = ("id", "personID", "person_id", "track_id", "smpl_id")
"""What files call a pose, the rotation of its root, where that is, and who it is."""
_EASYMOCAP = {78: "smplh", 87: "smplx"}
"""How many numbers a pose of EasyMocap has that ends with coefficients, and of which model it is."""
_BODY = 66
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


def bodies_in(tree: Tree, most_rows: int = 1) -> list[Body] | None:
    """Everybody in a frame, which is a file or a part of one; None where it is no frame.

    Args:
        tree: the frame.
        most_rows: how many people arrays may have along their first axis.

    Raises:
        UserError: there are too many, or something in it is no array that can be used.
    """
    listed = tree.get(*_LISTS) if tree.is_mapping else tree if tree.is_list else None
    if listed is None or (listed is not tree and not listed.is_list):
        people = _people(tree)
        named = [_bodies(child, child, None, 1, name) for name, child in people]
        if people and all(named):
            return [body for bodies in named if bodies is not None for body in bodies]
        return _bodies(tree, tree, None, most_rows)
    if len(listed) > _MOST:
        raise UserError(f"{listed.named} has {len(listed):,} people; expected at most {_MOST}")
    boxes = tree.get("body_bbox_list") if tree.is_mapping else None
    frames_boxes = [*boxes] if boxes is not None and len(boxes) == len(listed) else [None] * len(listed)
    here = [(node, box) for node, box in zip(listed, frames_boxes, strict=True) if not node.is_none]
    found = [_bodies(node, tree, box, most_rows) for node, box in here]
    if any(bodies is None for bodies in found) or (not found and tree is listed):
        return None
    return [body for bodies in found if bodies is not None for body in bodies]


def refuse_frame(tree: Tree) -> None:
    """Refuses a file of a single frame, which is a motion beside others.

    Raises:
        NoMotion: it is one; says so.
    """
    if bodies_in(tree) is not None:
        raise NoMotion(
            f"{tree.path}: holds SMPL parameters of a single frame; name the folder that holds a file for each frame"
        )


def _people(frame: Tree) -> list[tuple[str, Tree]]:
    """Entries of a frame that are a person each, called by a number, or several with parameters, of which none are the
    same in the world and as a camera sees them, or of another model; none of any other frame.
    """
    if not frame.is_mapping or _pose_in(frame) is not None:
        return []
    found = [
        (name, child)
        for name, child in islice(frame.items(), _MOST)
        if child.is_mapping and any(_pose_in(one) is not None for one in _with_children(child))
    ]
    bare = {without_world(usual_name(name)) for name, _ in found}
    numbered = bool(found) and all(name.isdecimal() for name, _ in found)
    return found if numbered or len(bare) == len(found) > 1 else []


def _bodies(node: Tree, around: Tree, box: Tree | None, most_rows: int, called: str | None = None) -> list[Body] | None:
    """Parameters in a dictionary, or in one in it, of somebody, or of several along the first axis of its arrays; None
    where it has none, or those of several frames.

    Args:
        node: the dictionary.
        around: what it is in.
        box: around them in the picture.
        most_rows: how many people there may be along that axis.
        called: what the file calls them, where it is not said beside the parameters.
    """
    if {"Rh", "Th", "poses"} <= set(node.keys):
        body = _easymocap(node)
        return None if body is None else [body]
    told = next(((one, found) for one in _with_children(node) if (found := _pose_in(one)) is not None), None)
    if told is None:
        return None
    inner, (key, pose) = told
    found = _rows(pose, most_rows)
    if found is None:
        return None
    pose_NX, form = found
    count = len(pose_NX)
    if not count:
        return []
    homes = (inner, node, by_usual_names(inner), by_usual_names(node))

    def rows(names: tuple[str, ...]) -> np.ndarray | None:
        told = next((found for home in homes if (found := home.get(*names)) is not None), None)
        numbers = None if told is None else _numbers(told)
        return None if numbers is None or numbers.size % count else numbers.reshape(count, -1)

    root_NX, place_NX, betas_NX = rows(_ROOTS), rows(_PLACES), rows(("betas", "shape"))
    if root_NX is not None and root_NX.shape[1] not in (3, 9):
        return None
    if root_NX is None and (form.joints not in WITH_ROOT or inner.get(*_ROOTS) is not None):
        return None
    said = around.get("smpl_type") if around.is_mapping else None
    named, keys = model_named(pose.where) if said is None else said.text() or "", {*inner.keys, *node.keys}
    betas = None if betas_NX is None else betas_NX[0].tolist()
    family = family_of(named, form.joints, keys, betas)
    source = "FrankMocap" if key.startswith("pred_") and around is not node else "SMPL parameters"
    people = _names(node, count)
    middle = _middle(box)
    return [
        Body(
            people[n] if called is None else called, key, pose_NX[n], form, None if root_NX is None else root_NX[n],
            None if place_NX is None or place_NX.shape[1] != 3 else place_NX[n],
            None if betas_NX is None else betas_NX[n], middle, source, family,
        )
        for n in range(count)
    ]  # fmt: skip


def _pose_in(node: Tree) -> tuple[str, Tree] | None:
    """What a dictionary has for a pose, and what that is usually called; None where it has none."""
    for home in (node, by_usual_names(node)):
        key = next((key for key in _POSES if key in home.keys), None)
        if key is not None:
            return key, home[key]
    return None


def _with_children(node: Tree) -> Iterator[Tree]:
    yield node
    for _, child in node.items():
        if child.is_mapping:
            yield child


def _rows(node: Tree, most: int) -> tuple[np.ndarray, Form] | None:
    """Rows (N, X) of a pose of each of some people, and their form; None where they are none, or more than `most`."""
    shape = node.shape()
    if shape is not None and len(shape) > 1 and shape[0] == 0 and math.prod(shape[1:]) <= _LONGEST:
        form = find_form((1, *shape[1:]), _COUNTS)
        return None if form is None else (np.zeros((0, form.width)), form)
    if shape is None or len(shape) < 1 or not 0 < math.prod(shape) <= most * _LONGEST:
        return None
    while len(shape) > 1 and shape[0] == 1:
        shape = shape[1:]
    form, count = find_form((1, *shape), _COUNTS), 1
    if form is None:
        form, count = find_form(shape, _COUNTS), shape[0]
    return None if form is None or count > most else (node.array().reshape(count, -1).astype(np.float64), form)


def _numbers(node: Tree) -> np.ndarray | None:
    shape = node.shape()
    if shape is None or not 0 < math.prod(shape) <= _MOST * _LONGEST:
        return None
    return node.array().astype(np.float64).reshape(-1)


def _names(node: Tree, count: int) -> list[str | None]:
    """What a file calls each of some people; None where it does not."""
    told = node.get(*_IDS)
    shape = None if told is None else told.shape()
    if told is not None and count > 1 and shape == (count,):
        return [person_called(number) for number in told.array().tolist()]
    return [_person(node) if count == 1 else None] * count


def _person(node: Tree) -> str | None:
    """What a file calls somebody; None where it does not."""
    number = node.get(*_IDS)
    if number is None:
        return None
    text = number.text()
    return (
        person_called(text if text is not None else number.number()) if text or number.shape() in ((), (1,)) else None
    )


def _easymocap(node: Tree) -> Body | None:
    pose, turn, place = (_one_frame(node[key]) for key in ("poses", "Rh", "Th"))
    if pose is None or turn is None or place is None or turn.size != 3 or place.size != 3:
        return None
    family = _EASYMOCAP.get(pose.size, "")
    pose = pose[:_BODY] if family else pose
    form = find_form((1, pose.size), _COUNTS)
    if form is None or form.matrices:
        return None
    family = family or family_of("", form.joints, node.keys, None) or "smplx"
    pelvis_3 = np.array(FAMILIES[family].pelvis)
    place = place + axis_angle_to_matrix(turn.astype(np.float64)) @ pelvis_3
    betas = _one_frame(node.get("shapes"))
    return Body(_person(node), "poses", pose, form, turn, place, betas, None, "EasyMocap", family)


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


def _middle(box: Tree | None) -> np.ndarray | None:
    corner = _one_frame(box)
    if corner is None or corner.size < 4 or not corner[3] > 0:
        return None
    return (corner[:2] + corner[2:4] / 2) / corner[3]
