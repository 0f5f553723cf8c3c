"""Which folders are motions with a file a frame: of points as OpenPose lays them out, which `frame_folders` reads, of
SMPL parameters (`pose_folders`), of SAM 3D Body's answers (`sam3d_folders`), or of other points (`point_folders`); told
by names, and by what the first and the last file hold.

SMPLify-X, and collections that were made with it (PROX, EgoBody, RICH), have a folder a frame, with a file a person.
"""

from __future__ import annotations

import json
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import check_regular, read_regular
from mrhubo.files.tree import Tree, read_tree, tree_of
from mrhubo.motion.readers.frame_bodies import bodies_in
from mrhubo.motion.readers.frame_numbers import frame_numbers_in
from mrhubo.motion.readers.keypoint_arrays import NAME_KEYS, point_key
from mrhubo.motion.readers.keypoint_rows import counts_of_frame
from mrhubo.motion.readers.sam3d import answers_in

MAX_BYTES = 10_000_000
"""Of a frame."""
_MAX_FRAMES = 100_000
_POINTS = re.compile(
    rb'\s*+(?:\{.{0,300}?"(?:people|bodies)"\s*:\s*\[|\[\s*(?:\]\s*$|\{(?=.{0,300}?"keypoints3d"))).*', re.DOTALL
)
_MOST_PEOPLE = 100
"""In the folder of a frame."""
_MANY, _MOST_ROWS = 20, 20
"""So many files that are called by nothing but a number are frames, whose arrays may be of so many people; fewer may be
motions of some frames."""
_FEWEST_POINTS, _MOST_NUMBERS = 12, 100_000
"""Of a body, and in a frame."""
_ENDINGS = (".json", ".npz", ".npy", ".pkl")
_NUMBER = re.compile(r"[0-9]")
_DETECTION = re.compile(r"(.*[0-9].*?)[_-]([0-9]{1,3})")


@dataclass(frozen=True)
class Frames:
    """The files of a folder with one a frame, by name."""

    files: list[Path]
    kind: str
    """What they hold: `points`, as OpenPose and its kin lay them out, `poses`, which are SMPL parameters, `answers`, of
    SAM 3D Body, or `others`, which are points too."""
    most_rows: int = 1
    """How many people arrays in a file may have along their first axis."""
    in_folders: bool = False
    """Whether each frame has a folder of its own, with a file a person."""


def frame_files(folder: Path) -> Frames | None:
    """The files of a folder with one a frame; None where it is no such folder. Does not raise."""
    if not os.path.isdir(folder):
        return None
    by_ending: dict[str, list[Path]] = {ending: [] for ending in _ENDINGS}
    folders: list[Path] = []
    try:
        for file in folder.iterdir():
            if file.suffix.lower() in by_ending and not file.name.startswith("."):
                by_ending[file.suffix.lower()].append(file)
            elif _NUMBER.search(file.name) and os.path.isdir(file):
                folders.append(file)
    except OSError:
        return None
    for files in by_ending.values():
        if not 2 <= len(files) <= _MAX_FRAMES or not all(_NUMBER.search(file.stem) for file in files):
            continue
        files.sort(key=lambda file: file.name)
        if _is_points(files[0]) and _is_points(files[-1]):
            return Frames(files, "points")
        many = len(files) >= _MANY
        rows = _MOST_ROWS if many and all(file.stem.isdecimal() for file in files) else 1
        if _is_pose(files[0], rows) and _is_pose(files[-1], rows):
            return Frames(files, "poses", most_rows=rows)
        if _is_answer(files[0]) and _is_answer(files[-1]):
            return Frames(files, "answers")
        if many and _has_points(files[0]) and _has_points(files[-1]):
            return Frames(files, "others")
    return None if any(by_ending.values()) else _in_folders(sorted(folders, key=lambda inner: inner.name))


def _in_folders(folders: list[Path]) -> Frames | None:
    """The files of folders with one a frame; None where some of the first and the last are no such."""
    if not 2 <= len(folders) <= _MAX_FRAMES:
        return None
    if not all(any(map(_is_pose, _frame_of(folder))) for folder in (folders[0], folders[-1])):
        return None
    try:
        return Frames([file for folder in folders for file in _frame_of(folder)], "poses", in_folders=True)
    except OSError:
        return None


def _frame_of(folder: Path) -> list[Path]:
    """The files of a folder that may be people in one frame; none where there are too many for that."""
    files = [file for file in sorted(folder.iterdir()) if file.suffix.lower() in _ENDINGS and os.path.isfile(file)]
    return files if len(files) <= _MOST_PEOPLE else []


def read_frame_tree(file: Path) -> Tree:
    """What a file of a frame holds.

    Raises:
        UserError: it is damaged, hostile, or too large.
    """
    if file.suffix.lower() == ".json":
        return tree_of(read_frame_json(file), file, "")
    check_regular(file, MAX_BYTES)
    return read_tree(file)


def read_frame_json(file: Path) -> Any:
    """What a JSON file of a frame holds.

    Raises:
        UserError: it is damaged or too large.
    """
    try:
        return json.loads(read_regular(file, MAX_BYTES))
    except (ValueError, RecursionError) as error:
        raise UserError(f"{file}: is no JSON: {shortened(str(error), 80)}") from error


def _is_points(file: Path) -> bool:
    if file.suffix.lower() != ".json":
        return False
    try:
        return bool(_POINTS.match(read_regular(file, MAX_BYTES)[:4096]))
    except UserError:
        return False


def _is_pose(file: Path, most_rows: int = 1) -> bool:
    try:
        return bodies_in(read_frame_tree(file), most_rows) is not None
    except UserError:
        return False


def _is_answer(file: Path) -> bool:
    try:
        return answers_in(read_frame_tree(file)) is not None
    except UserError:
        return False


def _has_points(file: Path) -> bool:
    try:
        counts = counts_of_frame(file, plain_frame(file))
    except UserError:
        return False
    return 0 < len(counts) <= _MOST_ROWS and min(counts) >= _FEWEST_POINTS


def plain_frame(file: Path) -> Any:
    """What a file of a frame holds, in dictionaries and lists: of one that is no JSON, its arrays of points.

    Raises:
        UserError: it is damaged, hostile, or too large.
    """
    if file.suffix.lower() == ".json":
        return _called(read_frame_json(file))
    tree = read_frame_tree(file)
    if not tree.is_mapping:
        return _numbers(tree)
    key = point_key(tree.keys)
    if key is not None:
        return _numbers(tree[key])
    return [{"id": name, "keypoints": _numbers(child)} for name, child in tree.items()]


def _called(frame: Any) -> Any:
    """A frame in JSON whose points have names in a list beside them, with the points by name; any other as it is."""
    names = next((frame[key] for key in NAME_KEYS if key in frame), None) if isinstance(frame, dict) else None
    key = point_key(frame) if isinstance(frame, dict) else None
    points = None if key is None else frame[key]
    if not isinstance(names, list) or not isinstance(points, list) or len(set(map(str, names))) != len(points):
        return frame
    return dict(zip(map(str, names), points, strict=False))


def _numbers(node: Tree) -> Any:
    array = node.array()
    if array.ndim not in (2, 3) or array.shape[-1] not in (3, 4) or array.size > _MOST_NUMBERS:
        raise UserError(f"{node.named} is {node.described}; expected points of a frame")
    return array.astype(float).tolist()


def numbers_of_files(folder: Path, frames: Frames) -> list[int]:
    """The number of each file's frame; several files have the same, where the last number in a name is a person's.

    Raises:
        UserError: the order of the frames is not known.
    """
    if frames.in_folders:
        return _of_heads(folder, [file.parent.name for file in frames.files])
    stems = [file.stem for file in frames.files]
    parts = [_DETECTION.fullmatch(stem) for stem in stems]
    heads = [part[1] for part in parts if part is not None]
    tails = {part[2] for part in parts if part is not None}
    if len(heads) < len(stems) or not 1 < len(set(heads)) >= len(tails) or len(tails) > _MOST_PEOPLE:
        return frame_numbers_in(folder, stems)
    return _of_heads(folder, heads)


def _of_heads(folder: Path, heads: list[str]) -> list[int]:
    """The number of each frame of which there are several names alike."""
    once = sorted(set(heads))
    numbers = dict(zip(once, frame_numbers_in(folder, once), strict=True))
    return [numbers[head] for head in heads]
