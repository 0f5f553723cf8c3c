"""The text of a BVH file, to a tree of joints and its numbers; what the joints stand for is not asked here.

The format is described in J. Meredith and S. Maddock, "Motion Capture File Formats Explained" (University of Sheffield,
2001): a hierarchy of offsets and channels, then a line of numbers a frame. Writers differ in capitals, spaces in names,
commas for points, what stands after `Frames`, and in the number of frames that they promise.

Legend: T frames, C channels. Angles in degrees; unit and axes are whatever the writer had.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import open_regular
from mrhubo.motion.far_places import compact
from mrhubo.motion.readers.tree.hierarchy import Joint, JointTree
from mrhubo.robot_motion.clock import rate_of_step, usual_rates

MAX_BYTES = 2**30
"""Largest file."""
MAX_FRAMES = 500_000
"""Longest motion that is read: 70 minutes at 120 frames a second."""
_MAX_HEADER = 4_000_000
_MAX_JOINTS = 5_000
_MAX_DEPTH = 100
"""Joints on the way from a root to an end."""
_MAX_CHANNELS = 12
"""Of one joint."""
_MAX_NUMBERS = 100_000_000
_LARGEST = 1e7
"""No angle and no coordinate is beyond this."""
_BLOCK = 2**24
_MOTION = re.compile(rb"(?:\A|[\r\n])[ \t]*MOTION\b", re.IGNORECASE)
_FRAMES = re.compile(rb"\s*+Frames\s*+:?\s*+(\d+)", re.IGNORECASE)
_TIME = re.compile(rb"\s*+Frame\s*+Time\s*+:?[ \t]*+([^\s]*+)", re.IGNORECASE)
_TOKEN = re.compile(r"[{}]|[^\s{}]+")
_CUT = re.compile(rb"[-+]?\d*\.?\d*(?:[eE][-+]?)?")
"""The beginning of a number."""


def read_bvh_file(path: Path) -> tuple[JointTree, tuple[float, ...], list[str]]:
    """Reads a BVH file: the tree, the frames per second that it may tell, the likeliest first (none where it does not
    say), and notes.

    Raises:
        UserError: it is missing, damaged, too large, or no BVH file; says where.
    """
    with open_regular(path, MAX_BYTES) as handle:
        start = handle.read(_MAX_HEADER)
        found = _MOTION.search(start)
        if found is None:
            raise UserError(
                f"{path}: has no line 'MOTION' in its first {_MAX_HEADER // 10**6} MB, so it is no whole BVH file"
            )
        joints, columns = _read_hierarchy(path, _decoded(start[: found.start()]))
        after = start[found.end() :]
        frames, rates, rest = _read_counts(path, after)
        handle.seek(found.end() + rest)
        value_TC, notes = _read_numbers(path, handle, columns, frames)
    return JointTree(tuple(joints), value_TC), rates, notes


def _decoded(content: bytes) -> str:
    """The hierarchy as text: names stand in UTF-8, in what programs in Japan wrote before that, or in Latin 1."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        japanese = content.decode("cp932", "replace")
        return japanese if "\u5de6" in japanese or "\u53f3" in japanese else content.decode("latin1")  # left, right


def _read_hierarchy(path: Path, text: str) -> tuple[list[Joint], int]:
    """The joints, parents before children, and how many channels there are."""
    lines = [line for line in text.replace("\r", "\n").split("\n") if line.strip()]
    if not lines or lines[0].split()[0].upper() != "HIERARCHY":
        raise UserError(f"{path}: does not begin with 'HIERARCHY', so it is no BVH file")
    joints: list[Joint] = []
    open_joints: list[int] = []
    pending: tuple[str, bool] | None = None
    columns = 0
    for number, line in enumerate(lines[1:], start=2):
        words = _TOKEN.findall(line)
        while words:
            keyword = words[0].upper()
            if keyword == "HIERARCHY" and not open_joints:  # of another person
                words = words[1:]
            elif keyword == "{":
                if pending is None:
                    raise _broken(path, line, "a brace without a joint")
                parent = open_joints[-1] if open_joints else -1
                name = pending[0] or f"end of {joints[parent].name}" if parent >= 0 else pending[0]
                joints.append(Joint(name, parent, (0.0, 0.0, 0.0)))
                open_joints.append(len(joints) - 1)
                pending, words = None, words[1:]
                if len(joints) > _MAX_JOINTS or len(open_joints) > _MAX_DEPTH:
                    raise UserError(
                        f"{path}: has more than {_MAX_JOINTS:,} joints, or more than {_MAX_DEPTH} one inside the other"
                    )
            elif keyword == "}":
                if not open_joints:
                    raise _broken(path, line, "a closing brace too many")
                open_joints.pop()
                words = words[1:]
            elif keyword in ("ROOT", "JOINT") or (keyword == "END" and len(words) > 1 and words[1].upper() == "SITE"):
                if keyword != "ROOT" and not open_joints:
                    raise _broken(path, line, "a joint outside a root")
                end = words.index("{") if "{" in words else len(words)
                name = "" if keyword == "END" else " ".join(words[1:end])
                pending, words = (shortened(name), keyword == "END"), words[end:]
            elif keyword == "OFFSET" and open_joints:
                place, offset = open_joints[-1], [_number(path, line, word) for word in words[1:4]]
                if len(offset) != 3:
                    raise _broken(path, line, "an offset of three numbers is expected")
                joints[place] = replace(joints[place], offset_3=(offset[0], offset[1], offset[2]))
                words = words[4:]
            elif keyword == "CHANNELS" and open_joints:
                place = open_joints[-1]
                joints[place], taken = _read_channels(path, line, words, joints[place], columns)
                columns, words = columns + taken, words[2 + taken :]
            else:
                raise _broken(path, line, f"'{shortened(words[0], 30)}' is not expected here (line {number})")
    if open_joints:
        raise UserError(
            f"{path}: its hierarchy ends inside joint '{joints[open_joints[-1]].name}'; the file is damaged"
        )
    if not columns:
        raise UserError(f"{path}: no joint has channels, so nothing moves")
    return joints, columns


def _read_channels(path: Path, line: str, words: list[str], joint: Joint, first: int) -> tuple[Joint, int]:
    try:
        count = int(words[1])
        channels = words[2 : 2 + count]
        if not 0 <= count <= _MAX_CHANNELS or len(channels) < count or joint.rotation or joint.position:
            raise ValueError
    except (ValueError, IndexError) as error:
        raise _broken(path, line, "the number of channels does not agree with the channels") from error
    rotation, position = [], []
    for column, word in enumerate(channels, start=first):
        axis, kind = word[:1].lower(), word[1:].lower()
        if axis not in "xyz" or kind not in ("rotation", "position"):
            raise _broken(path, line, f"channel '{shortened(word, 30)}' is not known; expected for instance Xrotation")
        (rotation if kind == "rotation" else position).append((axis, column))
    return replace(joint, rotation=tuple(rotation), position=tuple(position)), count


def _read_counts(path: Path, after: bytes) -> tuple[int | None, tuple[float, ...], int]:
    """How many frames are promised, how many a second there may be, and where the numbers begin."""
    frames, rates, place = None, (), 0
    for pattern in (_FRAMES, _TIME):
        found = pattern.match(after, place)
        if found is None:
            continue
        place = found.end()
        if pattern is _FRAMES:
            frames = int(found[1][:12])
        else:
            text = found[1].decode("latin1")
            try:
                rates = _rates(text.replace(",", "."))
            except ValueError as error:
                raise UserError(f"{path}: 'Frame Time' is '{shortened(text)}'") from error
    return frames, rates, place


def _rates(step: str) -> tuple[float, ...]:
    """Frames per second of a step [s]: the rate that has it, and usual ones that may, if it has a single digit; the
    first of these goes before a rate that is no whole number.
    """
    rate, usual = rate_of_step(step), usual_rates(step)
    if rate is None:
        return ()
    others = [other for other in usual if abs(other / rate - 1) > 1e-3]
    return (rate, *others) if not others or round(rate, 3) == round(rate) else (*others, rate)


def _read_numbers(path: Path, handle: BinaryIO, columns: int, promised: int | None) -> tuple[np.ndarray, list[str]]:
    """The frames (T, C), block by block; those that the file does not hold whole are left out, with a note.

    Raises:
        UserError: something is no number, or numbers are missing in the middle of the frames, or too many.
    """
    blocks, ends, total, left = [], [np.zeros(1, int)], 0, b""
    notes: list[str] = []
    while True:
        block = handle.read(_BLOCK)
        text = left + block
        if block:  # a number may be cut at the end of a block
            cut = max(text.rfind(b"\n"), text.rfind(b" "), text.rfind(b"\t")) + 1
            text, left = text[:cut], text[cut:]
        if b"," in text:
            text = text.replace(b",", b".") if b"." not in text else text.replace(b",", b" ")
        after = None
        if text.strip():
            ends.append(total + _line_ends(text))
            numbers, after = _numbers(text)
            blocks.append(numbers)
            total += len(numbers)
        if total > _MAX_NUMBERS or total // columns > MAX_FRAMES:
            raise UserError(
                f"{path}: has more than {min(MAX_FRAMES, _MAX_NUMBERS // columns)} frames of {columns} numbers; cut it"
            )
        if after is not None and not block and total % columns and _CUT.fullmatch(after):
            break
        if after is not None:
            word = shortened(after.split()[0].decode("latin1"), 30)
            if not promised or total < promised * columns:
                raise UserError(f"{path}: frame {total // columns} holds '{word}', no number")
            notes.append(f"what follows the frames is left out: '{word}'")
            break
        if not block:
            break
    frames = total // columns
    if frames == 0:
        raise UserError(f"{path}: holds {total} numbers after 'MOTION', less than one frame of {columns}")
    if total != (promised or 0) * columns:
        _check_lines(path, np.concatenate(ends), columns, min(frames, promised or frames))
    value_TC = np.concatenate(blocks)[: frames * columns].reshape(frames, columns)
    if promised and promised < frames:
        notes.append(f"{frames - promised} frames beyond the {promised} that the file promises are left out")
        value_TC = value_TC[:promised]
    elif (promised and promised > frames) or total % columns:
        notes.append(f"the file promises {promised} frames and holds {frames}; it may have been cut off")
    bad_TC = ~(np.abs(value_TC) <= _LARGEST)
    if bad_TC.any():
        frame, column = np.argwhere(bad_TC)[0].tolist()
        raise UserError(f"{path}: frame {frame} holds {value_TC[frame, column]:g} in column {column}")
    return value_TC, notes


def _line_ends(text: bytes) -> np.ndarray:
    """How many words of a text stand before the end of each of its lines."""
    byte_X = np.frombuffer(text, np.uint8)
    word_X = byte_X > ord(" ")
    starts = np.flatnonzero(word_X & ~np.concatenate(([False], word_X[:-1])))
    return np.searchsorted(starts, np.flatnonzero((byte_X == ord("\n")) | (byte_X == ord("\r"))))


def _check_lines(path: Path, ends: np.ndarray, columns: int, frames: int) -> None:
    """Refuses frames that do not end where a line does: a number that is missing, or one too many, moves all that
    follow to other joints. Frames that stand in one line are not told apart so.

    Args:
        path: the file.
        ends: how many numbers stand before the end of each line.
        columns: C.
        frames: how many are whole.
    """
    ends = np.unique(ends)
    last = np.arange(1, frames + 1) * columns
    place = np.searchsorted(ends, last)
    wrong = np.flatnonzero((place < len(ends)) & (ends[np.minimum(place, len(ends) - 1)] != last))
    if len(wrong):
        frame = int(wrong[0])
        held = ends[[place[frame] - 1, place[frame]]] - frame * columns
        raise UserError(
            f"{path}: frame {frame} holds {held[0] if held[0] > 0 else held[1]} numbers, and the joints have {columns}"
            " channels; numbers are missing, or there are too many"
        )


def _numbers(text: bytes) -> tuple[np.ndarray, bytes | None]:
    """The numbers with which a block of text begins, and what follows from a word that is none, if there is
    one.
    """
    try:
        with warnings.catch_warnings(action="error"):
            return compact(np.fromstring(text.decode("latin1"), dtype=np.float64, sep=" ")), None
    except (ValueError, DeprecationWarning, RuntimeWarning):
        numbers, after, words = [], None, text.split()
        for place, word in enumerate(words):
            try:
                numbers.append(float(word))
            except ValueError:
                after = b" ".join(words[place:])
                break
        return compact(np.array(numbers, np.float64)), after


def _number(path: Path, line: str, word: str) -> float:
    try:
        value = float(word.replace(",", "."))
    except ValueError as error:
        raise _broken(path, line, f"'{shortened(word, 30)}' is no number") from error
    if not abs(value) <= _LARGEST:
        raise _broken(path, line, f"'{shortened(word, 30)}' is no length of a bone")
    return value


def _broken(path: Path, line: str, what: str) -> UserError:
    return UserError(f"{path}: '{shortened(line.strip(), 60)}': {what}")
