"""How estimators lay out files that go frame by frame: what they tell of whoever is seen in each.

Where each layout is defined is said at its function.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.tree import Tree
from mrhubo.files.values import name_of
from mrhubo.motion.readers.frame_numbers import frame_numbers_in, in_order
from mrhubo.motion.readers.linking import LINKED, link_in
from mrhubo.motion.readers.people import people_in
from mrhubo.motion.readers.rotations import Form, find_form
from mrhubo.motion.readers.tracks import Kind, Layout, SmplArrays, Track
from mrhubo.motion.readers.world import CAMERAS

_SMALL = 1_000
"""Numbers that an array of one person in one frame has at most."""
_METRES = 1.0
"""How far [m] anybody gets from one frame to the next, with the noise of a depth that is guessed."""


def read_phalp(tree: Tree) -> Layout | None:
    """4D-Humans and PHALP: a dictionary of frames, each with lists that have an entry a person.

    `joblib.dump(final_visuals_dic, ...)` of
    https://github.com/brjathu/PHALP/blob/master/phalp/trackers/PHALP.py; `smpl` has `global_orient` (1, 3, 3),
    `body_pose` (23, 3, 3) and `betas` (10,), `tid` the number of the track, `tracked_time` how many frames ago the
    person was seen, `time` the number of the frame.
    """
    if not tree.is_mapping or not len(tree):
        return None
    seen: dict[str, list[tuple[int, Tree]]] = {}
    times: list[int | None] = []
    for number, (_, frame) in enumerate(tree.items()):
        people, names = frame.get("smpl"), [frame.get(key) for key in ("tid", "tracked_ids")]
        if people is None or not people.is_list or all(given is None for given in names):
            return None
        ages = frame.get("tracked_time")
        ids = next((list(given) for given in names if given is not None and len(given) == len(people)), None)
        if ids is None:
            raise UserError(
                f"{frame.named}: has {len(people)} bodies, and numbers of tracks for another number of people"
            )
        old = [age.number() > 0 for age in ages] if ages is not None and len(ages) == len(ids) else [False] * len(ids)
        time = frame.get("time")
        times.append(None if time is None or time.is_none or time.text() is not None else int(time.number()))
        for person, body, is_old in zip(ids, people, old, strict=True):
            if not is_old and body.is_mapping:
                seen.setdefault(_name(person), []).append((number, body))
    told = [time for time in times if time is not None]
    frames = told if len(told) == len(times) else frame_numbers_in(tree.path, tree.keys)
    tracks = [
        Track(person, len(found), _phalp_reader([(frames[number], body) for number, body in found]))
        for person, found in seen.items()
    ]
    return Layout(Kind("4D-Humans or PHALP", "smpl", CAMERAS), tracks)


def _name(person: Tree) -> str:
    """What a person is called, by a text or a number."""
    text = person.text()
    return text if text is not None else str(name_of(person.number()))


def _phalp_reader(found: list[tuple[int, Tree]]) -> Callable[[], SmplArrays]:
    def read() -> SmplArrays:
        pose, root, betas = (
            _stack([body[key] for _, body in found]) for key in ("body_pose", "global_orient", "betas")
        )
        frames = np.array([place for place, _ in found])
        form = _needed_form(pose, found[0][1]["body_pose"], (21, 23))
        return SmplArrays("smpl[body_pose]", pose, form, 0, root, None, betas, frames)

    return read


def read_romp(tree: Tree) -> Layout | None:
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
    if people is not None:
        return Layout(kind, people.tracks, people.notes)
    named = [("", results)] if "smpl_thetas" in results.keys else list(results.items())
    if not any("smpl_thetas" in frame.keys for _, frame in named):
        return None
    times, frames = zip(*in_order(tree.path, named), strict=True)
    rows = [_rows(frame, "smpl_thetas") for frame in frames]
    places = [_places(frame, "cam_trans", count) for frame, count in zip(frames, rows, strict=True)]
    seen: dict[int, list[tuple[int, Tree, int]]] = {}
    for time, frame, here in zip(times, frames, link_in(tree.path, places, _METRES, times), strict=True):
        for row, person in enumerate(here):
            seen.setdefault(person, []).append((time, frame, row))
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
