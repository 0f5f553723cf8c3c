"""The text of ASF and AMC files, Acclaim's, to a tree of joints and its numbers.

The format is described in J. Lander, "Working with Motion Capture File Formats" (Game Developer, January 1998), and at
http://mocap.cs.cmu.edu/. An .asf file has the skeleton: of each bone its direction and length in the world at rest, the
axes about which it turns, and which angles it has. An .amc file has the angles, frame by frame.

A bone begins where the one above ends. Here it is a joint at its beginning, and each last bone has an end. With C the
turn of its axes and A that of its angles, about x first, then y, then z where the order is XYZ, it turns by C A C^-1.

Legend: T frames, C numbers a frame. Angles in degrees; unit and axes are the file's own.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import read_regular
from mrhubo.motion.readers.tree.hierarchy import Joint, JointTree

_MAX_ASF, _MAX_AMC = 4_000_000, 2**28
_MAX_BONES = 500
_MAX_FRAMES = 500_000
_MAX_NUMBERS = 100_000_000
_LARGEST = 1e7
_ROOT = "root"
_ORDER = ("tx", "ty", "tz", "rx", "ry", "rz")


@dataclass
class _Bone:
    direction: tuple[float, float, float] = (0.0, 0.0, 0.0)
    length: float = 0.0
    axis: tuple[float, ...] = (0.0, 0.0, 0.0)
    axis_order: str = "xyz"
    dof: tuple[str, ...] = ()
    parent: str = ""

    @property
    def vector(self) -> tuple[float, float, float]:
        """From its beginning to its end."""
        x, y, z = self.direction
        return self.length * x, self.length * y, self.length * z


@dataclass(frozen=True)
class Skeleton:
    """An .asf file."""

    path: Path
    bones: dict[str, _Bone]
    """In the order of the hierarchy, the root first."""
    degrees: bool


def read_asf(path: Path) -> Skeleton:
    """Reads a skeleton.

    Raises:
        UserError: it is missing, damaged, too large, or no .asf file; says where.
    """
    text = read_regular(path, _MAX_ASF).decode("latin1")
    sections: dict[str, list[list[str]]] = {}
    current: list[list[str]] = []
    for line in text.splitlines():
        words = re.sub(r"[(),]", " ", line.partition("#")[0]).split()
        if words and words[0].startswith(":"):
            current = sections.setdefault(words[0][1:].lower(), [])
            words = words[1:]
        if words:
            current.append(words)
    for section in ("root", "bonedata", "hierarchy"):
        if section not in sections:
            raise UserError(f"{path}: has no section ':{section}', so it is no whole .asf file")
    units = {words[0].lower(): words[1] for words in sections.get("units", []) if len(words) > 1}
    found = {_ROOT: _read_root(path, sections["root"]), **_read_bones(path, sections["bonedata"])}
    return Skeleton(path, _ordered(path, found, sections["hierarchy"]), units.get("angle", "deg").lower() != "rad")


def read_amc(path: Path, skeleton: Skeleton) -> tuple[JointTree, list[str]]:
    """Reads a motion of a skeleton: the tree, and notes.

    Raises:
        UserError: it is missing, damaged, too large, no .amc file, or of another skeleton; says where.
    """
    columns = {bone: len(data.dof) for bone, data in skeleton.bones.items() if data.dof}
    starts = dict(zip(columns, np.cumsum([0, *columns.values()]).tolist(), strict=False))
    width = sum(columns.values())
    rows: list[np.ndarray] = []
    seen: set[str] = set()
    degrees = skeleton.degrees
    for number, line in enumerate(read_regular(path, _MAX_AMC).decode("latin1").splitlines(), start=1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if words[0].startswith(":"):
            degrees = {":degrees": True, ":radians": False}.get(words[0].lower(), degrees)
        elif len(words) == 1 and words[0].isdigit():
            _check_whole(path, rows, seen, columns)
            rows.append(np.zeros(width, dtype=np.float32))
            seen = set()
            if len(rows) > _MAX_FRAMES or len(rows) * width > _MAX_NUMBERS:
                raise UserError(f"{path}: has more than {len(rows) - 1} frames; cut it")
        else:
            if words[0] not in columns:
                raise UserError(
                    f"{path}: line {number}: '{shortened(words[0], 30)}' is no bone that moves in {skeleton.path.name}"
                )
            values = _numbers(path, words[1:], f"line {number}")
            if len(values) != columns[words[0]] or not rows:
                raise UserError(
                    f"{path}: line {number}: '{words[0]}' has {len(values)} numbers; {skeleton.path.name} says "
                    f"{columns[words[0]]}"
                )
            rows[-1][starts[words[0]] : starts[words[0]] + len(values)] = values
            seen.add(words[0])
    notes = []
    if rows and seen < columns.keys():  # the last frame may have been cut off
        rows.pop()
        notes.append("the last frame is not whole and is left out; the file may have been cut off")
    if not rows:
        raise UserError(f"{path}: holds no whole frame")
    return _tree(skeleton, starts, np.stack(rows), degrees), notes


def _check_whole(path: Path, rows: list[np.ndarray], seen: set[str], columns: dict[str, int]) -> None:
    if rows and seen < columns.keys():
        missing = next(bone for bone in columns if bone not in seen)
        raise UserError(f"{path}: frame {len(rows) - 1} has no line for '{missing}'")


def _tree(skeleton: Skeleton, starts: dict[str, int], value_TC: np.ndarray, degrees: bool) -> JointTree:
    """Joints of the bones: at their beginnings, and one at each last end."""
    bones, place = skeleton.bones, {name: i for i, name in enumerate(skeleton.bones)}
    joints: list[Joint] = []
    for name, bone in bones.items():
        above = bones[bone.parent] if bone.parent else None
        offset = (0.0, 0.0, 0.0) if above is None else above.vector
        turns = [(dof[1], starts[name] + i) for i, dof in enumerate(bone.dof) if dof[0] == "r"]
        moves = [(dof[1], starts[name] + i) for i, dof in enumerate(bone.dof) if dof[0] == "t"]
        if not degrees:
            for _, column in turns:
                value_TC[:, column] = np.degrees(value_TC[:, column])
        axes = tuple(zip(bone.axis_order, bone.axis, strict=True))[::-1] if any(bone.axis) else ()
        parent = place[bone.parent] if bone.parent else -1
        joints.append(Joint(name, parent, offset, tuple(turns[::-1]), tuple(moves), axes))
    parents = {bone.parent for bone in bones.values()}
    for name, bone in bones.items():
        if name not in parents and bone.length:
            joints.append(Joint(f"end of {name}", place[name], bone.vector))
    return JointTree(tuple(joints), value_TC)


def _read_root(path: Path, lines: list[list[str]]) -> _Bone:
    entries = {words[0].lower(): words[1:] for words in lines}
    order = tuple(word.lower() for word in entries.get("order", _ORDER))
    if sorted(order) != sorted(_ORDER):
        raise UserError(f"{path}: the root's order is '{shortened(' '.join(order), 60)}'; expected TX TY TZ RX RY RZ")
    turns = _numbers(path, entries.get("orientation", ["0"] * 3), "the root's orientation")
    return _Bone(axis=_three(path, turns, "the root's orientation"), dof=order)


def _read_bones(path: Path, lines: list[list[str]]) -> dict[str, _Bone]:
    found: dict[str, _Bone] = {}
    bone, name = None, ""
    for words in lines:
        key, rest = words[0].lower(), words[1:]
        if key == "begin":
            bone, name = _Bone(), ""
        elif bone is None:
            raise UserError(f"{path}: ':bonedata': '{shortened(' '.join(words), 60)}' stands outside begin and end")
        elif key == "end":
            if not name or name in found or name == _ROOT or len(found) >= _MAX_BONES:
                raise UserError(f"{path}: a bone has no name or one that another has, or there are too many: '{name}'")
            found[name], bone = bone, None
        elif key == "name" and rest:
            name = shortened(rest[0])
        elif key == "direction":
            bone.direction = _three(path, _numbers(path, rest, f"bone '{name}'"), f"direction of '{name}'")
        elif key == "length":
            bone.length = (_numbers(path, rest, f"bone '{name}'") or [0.0])[0]
        elif key == "axis":
            bone.axis = _three(path, _numbers(path, rest[:3], f"bone '{name}'"), f"axis of '{name}'")
            bone.axis_order = rest[3].lower() if len(rest) > 3 else "xyz"
            if sorted(bone.axis_order) != ["x", "y", "z"]:
                raise UserError(
                    f"{path}: axis of '{name}': order '{shortened(bone.axis_order, 30)}'; expected e.g. XYZ"
                )
        elif key == "dof":
            bone.dof = tuple(word.lower() for word in rest if word.lower() in _ORDER)
            if len(bone.dof) < sum(word.lower() != "l" for word in rest) or len(set(bone.dof)) < len(bone.dof):
                raise UserError(f"{path}: dof of '{name}': '{shortened(' '.join(rest), 60)}' is not known")
    return found


def _ordered(path: Path, bones: dict[str, _Bone], lines: list[list[str]]) -> dict[str, _Bone]:
    """The bones with their parents, parents first."""
    children: dict[str, list[str]] = {}
    for words in lines:
        if words[0].lower() in ("begin", "end"):
            continue
        for child in words[1:]:
            if child not in bones or words[0] not in bones or bones[child].parent or child == _ROOT:
                raise UserError(f"{path}: ':hierarchy': '{shortened(' '.join(words), 80)}' does not fit the bones")
            bones[child].parent = words[0]
        children.setdefault(words[0], []).extend(words[1:])
    order, waiting = {}, [_ROOT]
    while waiting:
        name = waiting.pop()
        order[name] = bones[name]
        waiting += children.get(name, [])[::-1]
    return order


def _three(path: Path, numbers: list[float], what: str) -> tuple[float, float, float]:
    if len(numbers) != 3:
        raise UserError(f"{path}: {what}: expected three numbers, found {len(numbers)}")
    return numbers[0], numbers[1], numbers[2]


def _numbers(path: Path, words: list[str], where: str) -> list[float]:
    try:
        values = [float(word) for word in words]
    except ValueError as error:
        raise UserError(f"{path}: {where}: '{shortened(' '.join(words), 60)}' are no numbers") from error
    if not all(math.isfinite(value) and abs(value) <= _LARGEST for value in values):
        raise UserError(f"{path}: {where}: '{shortened(' '.join(words), 60)}' is not finite, or too large")
    return values
