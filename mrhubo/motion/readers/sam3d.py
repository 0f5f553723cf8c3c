"""Motions that SAM 3D Body's answers make, frame after frame: by its seventy named points.

The points are those of https://github.com/facebookresearch/sam-3d-body, sam_3d_body/metadata/mhr70.py; each answer of
`SAM3DBodyEstimator.process_one_image` has them as `pred_keypoints_3d` (70, 3) [m], as the camera sees them (y down),
and where the body is as `pred_cam_t` (3,). Who saves a video stacks them, (T, 70, 3), or keeps the answers in lists: of
frames, and of people in each.

Both sides of the elbow are among the points, so that even a straight arm tells how it is turned about itself: the
forearm bends to where the pit of the elbow (`cubital_fossa`) is seen from its tip (`olecranon`).

Legend: T frames, K = 70 points.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mrhubo.body.joints import SIDES
from mrhubo.errors import UserError
from mrhubo.fast.plain.human import cross, normalize
from mrhubo.files.tree import Tree
from mrhubo.motion.far_places import FARTHEST
from mrhubo.motion.motion import Motion
from mrhubo.motion.positions import BodyPoints, motion_from_points
from mrhubo.motion.readers.assemble import MAX_FRAMES
from mrhubo.motion.readers.frame_numbers import in_order
from mrhubo.motion.readers.linking import LINKED, link_in
from mrhubo.motion.readers.names import motion_name
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.smpl_names import search
from mrhubo.motion.readers.tracks import Person, check_span, choose
from mrhubo.motion.readers.world import ANY_WORLD, find_up

KEY, CAMERA = "pred_keypoints_3d", "pred_cam_t"
_LISTS = ("data", "outputs", "results")
"""What files of a frame call their list of answers."""
_POINTS = 70
_REACH = 1.0
"""How far anybody gets from one frame to the next [m], with the noise of a depth that is guessed."""
_FACE = ("nose", "left_eye", "right_eye", "left_ear", "right_ear")
_BODY = tuple(f"{side}_{name}" for name in ("shoulder", "elbow", "hip", "knee", "ankle") for side in SIDES)
_PLACES: dict[str, tuple[int, ...]] = {
    **{name: (place,) for place, name in enumerate((*_FACE, *_BODY))},
    "left_toe": (15, 16), "left_heel": (17,), "right_toe": (18, 19), "right_heel": (20,),
    "right_thumb": (24,), "right_index": (28,), "right_middle": (32,), "right_pinky": (40,), "right_wrist": (41,),
    "left_thumb": (45,), "left_index": (49,), "left_middle": (53,), "left_pinky": (61,), "left_wrist": (62,),
    "neck": (69,),
}  # fmt: skip
"""Which points, or the mean of which, are our keypoints; fingers are told by their knuckles, toes by the tips of the
big and the small one."""
_ELBOWS = {"left": (63, 65), "right": (64, 66)}
"""The tip and the pit of each elbow."""


@dataclass(frozen=True)
class _Seen:
    """A person's points (T, 70, 3) and where they are (T, 3) [m]; NaN where they are not seen."""

    points: np.ndarray
    camera: np.ndarray | None


def read_sam3d(tree: Tree, options: ReadOptions, find_rate: Callable[[list[str]], float]) -> Motion | None:
    """Reads a motion of SAM 3D Body's points; None of anything else.

    Args:
        tree: the file.
        options: which person.
        find_rate: gives the frame rate, and may add to the notes.

    Raises:
        UserError: the points are no motion, or the frame rate is not known.
    """
    notes: list[str] = []
    people = _people(tree, notes)
    if not people:
        return None
    tracks = [Person(name, count) for name, (count, _) in people.items()]
    chosen = choose(tree.path, tracks, options, notes)
    seen = people[chosen.person][1]()
    points_TK3 = seen.points.astype(np.float64)
    if not (np.abs(np.nan_to_num(points_TK3)) < FARTHEST).all():
        raise UserError(f"{tree.path}: '{KEY}' holds infinite numbers, or some beyond {FARTHEST:g} m")
    if seen.camera is not None:
        points_TK3 = points_TK3 + seen.camera.astype(np.float64)[:, None]
    up_T3 = points_TK3[:, [5, 6]].mean(axis=1) - points_TK3[:, [9, 10]].mean(axis=1)
    known_T = np.isfinite(up_T3).all(-1)
    if not known_T.any():
        raise UserError(f"{tree.path}: in no frame of '{KEY}' are both shoulders and hips known")
    up, turn_33 = find_up(up_T3[known_T], ANY_WORLD)
    points_TK3 = points_TK3 @ turn_33.T
    points = {name: points_TK3[:, list(places)].mean(axis=1) for name, places in _PLACES.items()}
    body = BodyPoints(points, hinges={f"{side}_shoulder": _hinge(points_TK3, points, side) for side in SIDES})
    source = f"SAM 3D Body's points, '{KEY}', {up}"
    return motion_from_points(body, motion_name(tree.path), find_rate(notes), source, tuple(notes))


def answers_in(frame: Tree) -> list[Tree] | None:
    """The answers of a frame that is a file of its own: it is one itself, or has a list of them; None of any other, and
    of those of several frames in arrays.
    """
    listed = frame if frame.is_list else frame.get(*_LISTS) if frame.is_mapping else None
    people = [frame] if listed is None or not listed.is_list else list(listed)
    if (not people and listed is frame) or not all(map(_is_person, people)):
        return None
    return people if all(math.prod(person[KEY].shape() or ()) == 3 * _POINTS for person in people) else None


def _hinge(points_TK3: np.ndarray, points: dict[str, np.ndarray], side: str) -> np.ndarray:
    """The axis (T, 3) about which an elbow bends: across the upper arm and the way from the elbow's tip to its pit."""
    tip, pit = _ELBOWS[side]
    upper_T3 = points[f"{side}_elbow"] - points[f"{side}_shoulder"]
    return normalize(np.nan_to_num(cross(upper_T3, points_TK3[:, pit] - points_TK3[:, tip])))


def _people(tree: Tree, notes: list[str]) -> dict[str, tuple[int, Callable[[], _Seen]]]:
    """Who is in a file: in how many frames, and what reads them."""
    stacked = search(tree, _stacked)
    if stacked is not None:
        return {"": (len(stacked.points), lambda: stacked)}
    people: list[tuple[str, list[Tree]]] = []
    for name, frame in tree.items() if tree.is_mapping else (("", frame) for frame in tree):
        people.append((name, [person for person in (frame if frame.is_list else (frame,)) if _is_person(person)]))
    if not any(here for _, here in people):
        return {}
    frames = in_order(tree.path, people)
    count = frames[-1][0] + 1
    check_span(tree.path, len(frames), count)
    places = [np.stack([_place(person) for person in here]) if here else np.zeros((0, 3)) for _, here in frames]
    numbers = link_in(tree.path, places, _REACH, [time for time, _ in frames])
    if max(map(len, places)) > 1:
        notes.append(LINKED)
    seen: dict[int, dict[int, Tree]] = {}
    for (time, here), found in zip(frames, numbers, strict=True):
        for person, number in zip(here, found, strict=True):
            seen.setdefault(number, {})[time] = person
    return {str(name): (len(found), lambda found=found: _gathered(found, count)) for name, found in seen.items()}


def _is_person(node: Tree) -> bool:
    """Whether somebody has points of this name that may be these: 4D-Humans' HMR2 calls its 44 so."""
    shape = node[KEY].shape() if KEY in node.keys else None
    return shape is not None and (len(shape) < 2 or shape[-2] == _POINTS)


def _place(person: Tree) -> np.ndarray:
    """Where somebody is, (3,); the origin where it is not told."""
    place = person.find_array(CAMERA)
    return place.reshape(3).astype(np.float64) if place is not None and place.size == 3 else np.zeros(3)


def _stacked(node: Tree) -> _Seen | None:
    """Points of one person that are in a single array."""
    shape = node[KEY].shape() if KEY in node.keys else None
    if shape is None or shape[-2:] != (_POINTS, 3) or len(shape) not in (3, 4) or (len(shape) == 4 and shape[1] != 1):
        return None
    points = node[KEY].array().reshape(-1, _POINTS, 3)
    place = node.find_array(CAMERA)
    if not 0 < len(points) <= MAX_FRAMES:
        raise UserError(f"{node.path}: '{KEY}' has {len(points):,} frames; expected 1 to {MAX_FRAMES:,}")
    return _Seen(points, place.reshape(-1, 3) if place is not None and place.size == 3 * len(points) else None)


def _gathered(found: dict[int, Tree], frames: int) -> _Seen:
    points, camera = np.full((frames, _POINTS, 3), np.nan), np.full((frames, 3), np.nan)
    for number, person in found.items():
        array = person[KEY].array()
        if array.size != _POINTS * 3:
            raise UserError(f"{person.named}: '{KEY}' has shape {array.shape}; expected ({_POINTS}, 3)")
        points[number] = array.reshape(_POINTS, 3)
        camera[number] = _place(person)
    return _Seen(points, camera)
