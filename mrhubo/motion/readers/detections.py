"""Estimators that write a row for each person whom they detect in each frame, and do not say who is who.

Where each layout is defined is said at its function.

Legend: N rows, of all people in all frames.
"""

from __future__ import annotations

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.tree import Tree
from mrhubo.motion.readers.linking import LINKED, link_in
from mrhubo.motion.readers.smpl_names import find_here
from mrhubo.motion.readers.tracks import Kind, Layout, SmplArrays, Track
from mrhubo.motion.readers.world import CAMERAS

_REACH = 0.5
"""How far anybody gets from one frame to the next, in heights of the box around a person in a picture."""


def read_pymaf(tree: Tree) -> Layout | None:
    """PyMAF-X: `joblib.dump(pred_results, ...)` of
    https://github.com/HongwenZhang/PyMAF-X/blob/master/apps/demo_smplx.py: `pose` (N, 72), `betas` (N, 10), `bboxes`
    (N, 4), centre and size, `frame_ids`, and `person_ids`, texts that number the people of a frame.
    """
    people = tree.get("person_ids")
    if people is None or not {"smplx_params", "smplx_verts"} & set(tree.keys):
        return None
    whole = _rows(tree)
    if whole is None:
        return None
    boxes = tree.get("bboxes")
    if len(people) != len(whole.pose) or whole.frames is None:
        raise UserError(f"{tree.path}: has {len(people)} names of people and {len(whole.pose)} poses")
    box_N4 = None if boxes is None or boxes.shape() != (len(people), 4) else boxes.array().astype(np.float64)
    # places in heights of the person's box, so that near and far people go alike far
    place_N2 = np.zeros((len(people), 2)) if box_N4 is None else box_N4[:, :2] / np.maximum(box_N4[:, 3:], 1.0)
    return _followed(tree, whole, whole.frames.reshape(-1), place_N2, Kind("PyMAF-X", "smplx", CAMERAS))


def read_cliff(tree: Tree) -> Layout | None:
    """CLIFF: `np.savez` of https://github.com/huawei-noah/noah-research/blob/master/CLIFF/demo.py: `pose` (N, 72),
    `shape`, `global_t` (N, 3), and `detection_all`, whose rows begin with the frame's number and the box's corners.
    """
    boxes = tree.get("detection_all")
    shape = None if boxes is None else boxes.shape()
    whole = None if boxes is None or shape is None or len(shape) != 2 or shape[1] < 5 else _rows(tree)
    if boxes is None or whole is None:
        return None
    if shape is None or shape[0] != len(whole.pose):
        raise UserError(f"{tree.path}: has {shape and shape[0]} detections and {len(whole.pose)} poses")
    box_NX = boxes.array().astype(np.float64)
    place_N2 = (box_NX[:, 1:3] + box_NX[:, 3:5]) / 2 / np.maximum(box_NX[:, 4:5] - box_NX[:, 2:3], 1.0)
    return _followed(tree, whole, box_NX[:, 0], place_N2, Kind("CLIFF", "smpl", CAMERAS))


def _rows(tree: Tree) -> SmplArrays | None:
    """SMPL parameters, a row a detection; None where there are none."""
    found = find_here(tree)
    return None if found is None or found.people is not None else found.read()


def _followed(tree: Tree, whole: SmplArrays, frame_N: np.ndarray, place_N2: np.ndarray, kind: Kind) -> Layout:
    """The people of all rows, by the number of each row's frame, and by where it is."""
    frame_T, frame_of_N, count_T = np.unique(frame_N, return_inverse=True, return_counts=True)
    frames = np.split(np.argsort(frame_of_N, kind="stable"), np.cumsum(count_T)[:-1])
    rows: dict[int, list[int]] = {}
    followed = link_in(tree.path, [place_N2[here] for here in frames], _REACH, frame_T.tolist())
    for here, numbers in zip(frames, followed, strict=True):
        for row, number in zip(here, numbers, strict=True):
            rows.setdefault(number, []).append(int(row))

    def of(chosen: list[int]) -> SmplArrays:
        position, betas = (
            array[chosen] if array is not None and array.ndim and len(array) == len(frame_N) else None
            for array in (whole.position, whole.betas)
        )
        return SmplArrays(
            whole.key, whole.pose[chosen], whole.form, whole.first, None, position, betas, frame_N[chosen]
        )

    tracks = [Track(str(name), len(chosen), lambda chosen=chosen: of(chosen)) for name, chosen in rows.items()]
    several = max(map(len, frames), default=0) > 1
    return Layout(kind, tracks, (LINKED,) if several else ())
