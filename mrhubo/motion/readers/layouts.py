"""How estimators of human pose, and collections of motions, lay their files out: whom they see, and what they tell of
each.

Where each layout is defined is said at its function.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.regular import naming
from mrhubo.files.tree import Tree
from mrhubo.motion.readers.family import family_of
from mrhubo.motion.readers.linking import LINKED, link
from mrhubo.motion.readers.rotations import Form, find_form
from mrhubo.motion.readers.smpl_names import Found, find_here, find_inside, people_in, search
from mrhubo.motion.readers.tracks import Kind, SmplArrays, Track
from mrhubo.motion.readers.world import ANY_WORLD, CAMERAS

_SMALL = 1_000
"""Numbers that an array of one person in one frame has at most."""
_METRES, _BOXES = 1.0, 0.5
"""How far anybody gets from one frame to the next, with the noise of a depth that is guessed: in metres, and in heights
of the box around a person in a picture."""


@dataclass(frozen=True)
class Layout:
    """What a file was found to hold."""

    kind: Kind
    tracks: list[Track]
    notes: tuple[str, ...] = ()
    camera_beside: bool = False
    """Whether its writer keeps the camera's way through the world in a file of its own."""


def find_layout(tree: Tree) -> Layout | None:
    """The layout of a file; None where nobody knows it."""
    for find in _FINDERS:
        layout = find(tree)
        if layout is not None:
            return layout
    return None


def _phalp(tree: Tree) -> Layout | None:
    """4D-Humans and PHALP: a dictionary of frames, each with lists that have an entry a person.

    `joblib.dump(final_visuals_dic, ...)` of
    https://github.com/brjathu/PHALP/blob/master/phalp/trackers/PHALP.py; `smpl` has `global_orient` (1, 3, 3),
    `body_pose` (23, 3, 3) and `betas` (10,), `tid` the number of the track, `tracked_time` how many frames ago the
    person was seen, `time` the number of the frame.
    """
    if not tree.is_mapping or not len(tree):
        return None
    seen: dict[str, list[tuple[int, Tree]]] = {}
    for number, (_, frame) in enumerate(tree.items()):
        people, names = frame.get("smpl"), [frame.get(key) for key in ("tid", "tracked_ids")]
        if people is None or not people.is_list or not any(names):
            return None
        ages = frame.get("tracked_time")
        ids = next((list(given) for given in names if given is not None and len(given) == len(people)), None)
        if ids is None:
            raise UserError(
                f"{frame.named}: has {len(people)} bodies, and numbers of tracks for another number of people"
            )
        old = (
            [float(age.array()) > 0 for age in ages]
            if ages is not None and len(ages) == len(ids)
            else [False] * len(ids)
        )
        time = frame.get("time")
        place = number if time is None or time.shape() != () else int(time.array())
        for person, body, is_old in zip(ids, people, old, strict=True):
            if not is_old and body.is_mapping:
                seen.setdefault(f"{float(person.array()):g}", []).append((place, body))
    tracks = [Track(person, len(found), _phalp_reader(found)) for person, found in seen.items()]
    return Layout(Kind("4D-Humans or PHALP", "smpl", CAMERAS), tracks)


def _phalp_reader(found: list[tuple[int, Tree]]) -> Callable[[], SmplArrays]:
    def read() -> SmplArrays:
        pose, root, betas = (
            _stack([body[key] for _, body in found]) for key in ("body_pose", "global_orient", "betas")
        )
        frames = np.array([place for place, _ in found])
        form = _needed_form(pose, found[0][1]["body_pose"], (21, 23))
        return SmplArrays("smpl[body_pose]", pose, form, 0, root, None, betas, frames)

    return read


def _romp(tree: Tree) -> Layout | None:
    """ROMP and BEV: an .npz file whose `results` is a dictionary of frames, each with arrays that have a row a person;
    of people that were tracked, `sequence_results` is one of tracks.

    `save_video_results` of https://github.com/Arthur151/ROMP/blob/master/simple_romp/romp/utils.py: `smpl_thetas` (N,
    72), `smpl_betas`, `cam_trans` (N, 3). A picture's file has the arrays of one frame as its `results`.
    """
    results = tree.get("results")
    if results is None or not results.is_mapping:
        return None
    kind = Kind("ROMP or BEV", "smpl", CAMERAS)
    tracked = tree.get("sequence_results")
    people = None if tracked is None else people_in(tracked)
    if tracked is not None and people:
        return Layout(kind, _named(people))
    frames = [results] if "smpl_thetas" in results.keys else [frame for _, frame in results.items()]
    if not frames or not any("smpl_thetas" in frame.keys for frame in frames):
        return None
    rows = [_rows(frame, "smpl_thetas") for frame in frames]
    places = [_places(frame, "cam_trans", count) for frame, count in zip(frames, rows, strict=True)]
    seen: dict[int, list[tuple[int, Tree, int]]] = {}
    for number, people in enumerate(_linked(tree, places, _METRES)):
        for row, person in enumerate(people):
            seen.setdefault(person, []).append((number, frames[number], row))
    tracks = [Track(str(person), len(found), _romp_reader(found)) for person, found in seen.items()]
    return Layout(kind, tracks, (LINKED,) if max(rows) > 1 else ())


def _romp_reader(found: list[tuple[int, Tree, int]]) -> Callable[[], SmplArrays]:
    def read() -> SmplArrays:
        pose, betas, position = (
            _stack_rows([(frame, row) for _, frame, row in found], key)
            for key in ("smpl_thetas", "smpl_betas", "cam_trans")
        )
        if pose is None:
            raise UserError(f"{found[0][1].named}: 'smpl_thetas' is missing in some frame, or not always as long")
        form = _needed_form(pose, found[0][1]["smpl_thetas"], (22, 24))
        frames = np.array([number for number, _, _ in found])
        return SmplArrays("smpl_thetas", pose, form, 1, None, position, betas, frames)

    return read


def _pymaf(tree: Tree) -> Layout | None:
    """PyMAF-X: arrays with a row for each person in each frame, whom it does not track.

    `joblib.dump(pred_results, ...)` of https://github.com/HongwenZhang/PyMAF-X/blob/master/apps/demo_smplx.py: `pose`
    (N, 72), `betas` (N, 10), `bboxes` (N, 4), `frame_ids`, and `person_ids`, texts that number the people of a frame.
    """
    people, found = tree.get("person_ids"), find_here(tree)
    if (
        people is None
        or found is None
        or found.people is not None
        or not {"smplx_params", "smplx_verts"} & set(tree.keys)
    ):
        return None
    whole = found.read()
    boxes, order = tree.get("bboxes"), whole.frames
    if len(people) != len(whole.pose) or order is None:
        raise UserError(f"{tree.path}: has {len(people)} names of people and {len(whole.pose)} poses")
    box_N4 = None if boxes is None or boxes.shape() != (len(people), 4) else boxes.array().astype(np.float64)
    # places in heights of the person's box, so that near and far people go alike far
    place_N2 = np.zeros((len(people), 2)) if box_N4 is None else box_N4[:, :2] / np.maximum(box_N4[:, 3:], 1.0)
    order = order.reshape(-1)
    frames = [np.flatnonzero(order == frame) for frame in np.unique(order)]
    rows: dict[int, list[int]] = {}
    for here, numbers in zip(frames, _linked(tree, [place_N2[here] for here in frames], _BOXES), strict=True):
        for row, number in zip(here, numbers, strict=True):
            rows.setdefault(number, []).append(int(row))

    def of(chosen: list[int]) -> SmplArrays:
        taken = (None if array is None else array[chosen] for array in (whole.pose, whole.betas, whole.frames))
        pose, betas, frames = taken
        assert pose is not None
        return SmplArrays(whole.key, pose, whole.form, whole.first, None, None, betas, frames)

    tracks = [Track(str(name), len(chosen), lambda chosen=chosen: of(chosen)) for name, chosen in rows.items()]
    several = max(map(len, frames), default=0) > 1
    return Layout(Kind("PyMAF-X", "smplx", CAMERAS), tracks, (LINKED,) if several else ())


def _people(tree: Tree) -> Layout | None:
    """WHAM, and VIBE and its kin: a dictionary of people, each with arrays over the frames in which they are seen.

    `joblib.dump(results, ...)` of https://github.com/yohanshin/WHAM/blob/main/demo.py: `pose_world` (T, 72) and
    `trans_world` (T, 3) in the world, `pose` and `trans` as the camera sees them, `betas`, `frame_ids`. Those of
    https://github.com/mkocabas/VIBE/blob/master/demo.py have `pose`, and no world. PromptHMR has `people`, each with
    `frames`, and `pose` (T, 165), `shape` and `trans` in `smplx_world` and `smplx_cam`
    (https://github.com/yufu-wang/PromptHMR).
    """
    people = search(tree, people_in, deepest=1)
    if not people:
        return None
    _, first = people[0]
    keys, inside = set(first.node.keys), first.node is not first.outer
    if "pose_world" in keys:
        kind = Kind("WHAM", "smpl", ANY_WORLD)
    elif "pred_cam" in keys or "orig_cam" in keys:
        kind = Kind("VIBE or one of its kin", "smpl", CAMERAS)
    else:
        kind = _kind("SMPL parameters of people", first, first.node)
    if inside and first.node.where.endswith(("_cam]", "_incam]")):
        kind = replace(kind, worlds=CAMERAS)
    return Layout(kind, _named(people))


def _single(tree: Tree) -> Layout | None:
    """SMPL parameters of one person, or with an axis for people, somewhere in the file.

    TRAM: `np.save` of a dictionary, `pred_rotmat` (T, 24, 3, 3), `pred_trans` (T, 1, 3), `frame`, as the camera sees it
    (https://github.com/yufu-wang/tram/blob/main/scripts/estimate_humans.py). GVHMR: `smpl_params_global` and
    `smpl_params_incam`, of SMPL-X (https://github.com/zju3dv/GVHMR/blob/main/tools/demo/demo.py). GENMO and GEM:
    `body_params_global` (https://github.com/NVlabs/GENMO). AIST++, EDGE, SLAHMR, EMDB, GRAB, PHC and others: see
    `mrhubo.motion.readers.smpl_names`.
    """
    found = find_inside(tree)
    if found is None:
        return None
    keys = set(found.node.keys)
    if "params_global" in found.node.where or "params_incam" in found.node.where:
        name = "GVHMR" if "smpl_params" in found.node.where else "GENMO or GEM"
        worlds = CAMERAS if "incam" in found.node.where else ANY_WORLD
        return Layout(Kind(name, "smplx", worlds), found.tracks())
    if "pred_rotmat" in keys:
        return Layout(Kind("TRAM", "smpl", CAMERAS), found.tracks(), camera_beside=True)
    if found.names.pose == "local_rot_mats":
        return Layout(Kind("Kimodo with SMPL-X's skeleton", "smplx", ANY_WORLD), found.tracks())
    if "pred_thetas" in keys:
        return Layout(Kind("HybrIK", "smpl", CAMERAS), found.tracks())
    if "smpl_scaling" in keys:
        return Layout(Kind("AIST++", "smpl", ANY_WORLD), found.tracks())
    return Layout(_kind("SMPL parameters", found, tree), found.tracks())


_FINDERS = (_phalp, _romp, _pymaf, _people, _single)


def _kind(source: str, found: Found, tree: Tree) -> Kind:
    """What is known of parameters that nobody in particular wrote."""
    said = next((text for node in (found.node, tree) if (text := _said(node))), "")
    keys = {*found.node.keys, *tree.keys}
    return Kind(source, family_of(said, found.form.joints, keys), ANY_WORLD)


def _said(node: Tree) -> str:
    """What a file calls its body model."""
    model = node.get("surface_model_type", "model_type", "smpl_type", "body_model")
    return (model.text() or "") if model is not None else ""


def _named(people: list[tuple[str, Found]]) -> list[Track]:
    return [track for name, found in people for track in found.tracks(name)]


def _needed_form(array: np.ndarray | None, node: Tree, counts: tuple[int, ...]) -> Form:
    form = None if array is None else find_form(array.shape, counts)
    if form is None:
        raise UserError(f"{node.named} is {node.described}, and no pose of SMPL's")
    return form


def _rows(node: Tree, key: str) -> int:
    """How many rows an array of a frame has; none where it is missing."""
    shape = node[key].shape() if key in node.keys else None
    return shape[0] if shape is not None and len(shape) == 2 else 0


def _places(node: Tree, key: str, people: int) -> np.ndarray:
    """Where the people of a frame are (N, 3); at one place where it does not tell."""
    shape = node[key].shape() if key in node.keys else None
    return node[key].array().astype(np.float64) if shape == (people, 3) else np.zeros((people, 3))


def _linked(tree: Tree, places: list[np.ndarray], reach: float) -> list[list[int]]:
    with naming(tree.path):
        return link(places, reach)


def _stack(nodes: list[Tree]) -> np.ndarray:
    """Small arrays of one shape as one, with a new first axis."""
    arrays = [node.array() for node in nodes]
    odd = next((n for n, array in enumerate(arrays) if array.shape != arrays[0].shape or array.size > _SMALL), None)
    if odd is not None:
        raise UserError(f"{nodes[odd].named} has shape {arrays[odd].shape}; others have {arrays[0].shape}")
    return np.stack(arrays)


def _stack_rows(places: list[tuple[Tree, int]], key: str) -> np.ndarray | None:
    """A row of an array of each of some frames; None where some have none, or others."""
    rows = []
    for frame, row in places:
        array = frame.find_array(key)
        if array is None or array.ndim != 2 or len(array) <= row or array.shape[1] > _SMALL:
            return None
        rows.append(array[row])
    return np.stack(rows) if len({row.shape for row in rows}) == 1 else None
