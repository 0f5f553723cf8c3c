"""Motions in NTU RGB+D's `.skeleton` files, which Kinect 2 saw.

A text of numbers: how many frames there are; of each, how many people; of each of those a line of ten numbers, the
first of which is theirs, then 25 and a line for each of Kinect 2's joints: x, y, z [m] as the camera sees it (y up),
places in pictures, a quaternion, and how well it was seen: 0 not, 1 guessed, 2 seen
(https://github.com/shahroudy/NTURGB-D, Matlab/read_skeleton_file.m).

Legend: T frames, K = 25 joints.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import read_regular
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import Content
from mrhubo.motion.readers.keypoint_arrays import Keypoints
from mrhubo.motion.readers.keypoint_dictionaries import kinect_rate
from mrhubo.motion.readers.keypoint_sets import SETS
from mrhubo.motion.readers.keypoints import motion_of_points
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.tracks import Person, choose

_END = r"[ \t\r]*+\n"
_BEGINNING = re.compile(rf"\s*+\d++{_END}(?:0{_END})*+\d++{_END}(?:[-+\d.eE]++[ \t]++){{9}}[-+\d.eE]++{_END}25{_END}")
_JOINTS, _BODY, _JOINT = 25, 10, 12
"""How many there are, and numbers of a person and of a joint."""
_MOST_PEOPLE = 10
_MAX_BYTES = 2**28
_MAX_FRAMES = 100_000
_SURE = np.array([0.0, 0.5, 1.0])
"""Confidence of what was not seen, guessed, seen."""


def is_skeleton(content: Content) -> bool:
    """Whether a file begins as NTU RGB+D's do."""
    return content.text is not None and bool(_BEGINNING.match(content.text))


def read_skeleton(path: Path, options: ReadOptions) -> Motion:
    """Reads one of the people in a file.

    Raises:
        UserError: the file is missing, damaged or too large, or nobody is in it.
    """
    words = read_regular(path, _MAX_BYTES).split()
    people, frames = _people(path, words)
    notes: list[str] = []
    tracks = [Person(name, len(seen)) for name, seen in people.items()]
    chosen = choose(path, tracks, options, notes)
    joint_TKX = np.full((frames, _JOINTS, _JOINT), np.nan)
    for frame, start in people[chosen.person].items():
        joint_TKX[frame] = _numbers(path, words, start, _JOINTS * _JOINT).reshape(_JOINTS, _JOINT)
    seen_T = np.isfinite(joint_TKX[:, :, :3]).all((1, 2))
    first, last = np.flatnonzero(seen_T)[[0, -1]] if seen_T.any() else (0, frames - 1)
    joint_TKX = joint_TKX[first : last + 1]
    state_TK = np.nan_to_num(joint_TKX[:, :, -1]).clip(0, len(_SURE) - 1).astype(int)
    rate = kinect_rate(options, notes)
    names = list(SETS["Kinect 2"])
    # what is not used has a name that is none of ours
    found = Keypoints(joint_TKX[..., :3], names, _SURE[state_TK], rate, f"of person {chosen.person}", notes)
    return motion_of_points(path, found, options)


def _people(path: Path, words: list[bytes]) -> tuple[dict[str, dict[int, int]], int]:
    """Where in the text the joints of each person in each frame begin, and how many frames there are."""
    frames, place = _count(path, words, 0, _MAX_FRAMES), 1
    people: dict[str, dict[int, int]] = {}
    for frame in range(frames):
        count, place = _count(path, words, place, _MOST_PEOPLE), place + 1
        for _ in range(count):
            if _count(path, words, place + _BODY, _JOINTS) != _JOINTS:
                raise UserError(f"{path}: somebody has not {_JOINTS} joints in frame {frame}")
            person, place = words[place].decode("latin1"), place + _BODY + 1
            people.setdefault(shortened(person, 40), {})[frame] = place
            place += _JOINTS * _JOINT
    if place > len(words):
        raise UserError(f"{path}: ends in the middle of a frame; the file is damaged")
    return people, frames


def _count(path: Path, words: list[bytes], place: int, most: int) -> int:
    word = words[place] if place < len(words) else b""
    if not word.isdigit() or len(word) > 9 or int(word) > most:
        what = f"'{shortened(word.decode('latin1'), 30)}'" if word else "its end"
        raise UserError(f"{path}: has {what} where a number up to {most} is expected; the file is damaged")
    return int(word)


def _numbers(path: Path, words: list[bytes], start: int, count: int) -> np.ndarray:
    try:
        return np.array([float(word) for word in words[start : start + count]])
    except ValueError as error:
        raise UserError(f"{path}: holds what is no number: {shortened(error, 80)}") from error
