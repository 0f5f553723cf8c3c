"""SMPL parameters in a dictionary of arrays, under the names that are in use.

Where a name is from: `pose_world` WHAM, `smpl_poses` AIST++ (https://google.github.io/aistplusplus_dataset),
`smpl_thetas` ROMP, `pred_rotmat` TRAM, `pred_thetas` HybrIK (https://github.com/Jeff-sjtu/HybrIK), `body_pose` the
package smplx (https://github.com/vchoutas/smplx), `pose_body` AMASS, `poses_body` EMDB
(https://github.com/eth-ait/emdb), `pose_aa` PHC (https://github.com/ZhengyiLuo/PHC), `fullpose` GRAB
(https://github.com/otaheri/GRAB), `smpl_pose` GLAMR (https://github.com/NVlabs/GLAMR), `local_rot_mats` Kimodo,
`rotvec` Multi-HMR (https://github.com/naver/multi-hmr), `body_pose_axis` TalkSHOW
(https://github.com/yhw-yhw/TalkSHOW), `bodyPose` Meshcapade's .smpl (https://pypi.org/project/smplcodec), `poses` and
`pose` everybody.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from mrhubo.files.tree import Tree
from mrhubo.motion.readers.rotations import WITH_ROOT, WITHOUT_ROOT, Form, find_form
from mrhubo.motion.readers.tracks import SmplArrays, Track

T = TypeVar("T")
_ROOTS = ("global_orient", "root_orient", "root_pose")
_PLACES = ("trans", "transl", "translation", "root_trans", "root_trans_offset", "trans_orig", "global_t")
_FRAMES = ("frame_ids", "frame_id", "frame", "frames", "frame_idx")
_ENTRIES = 50
_DEEPEST = 3
"""Dictionaries in dictionaries."""
_WORLD, _CAMERA = ("global", "world"), ("incam", "cam", "camera")
"""Words in the names of parameters in the world, which are preferred, and of those that a camera sees."""


@dataclass(frozen=True)
class _Names:
    """What the arrays of one way of writing are called."""

    pose: str
    root: tuple[str, ...] = ()
    """Empty: it is in the pose, or else called as usual."""
    position: tuple[str, ...] = _PLACES
    betas: tuple[str, ...] = ("betas", "beta", "shape")


_NAMES = (
    _Names("pose_world", position=("trans_world",)),
    _Names("smpl_poses", position=("smpl_trans",)),
    _Names("smpl_thetas", position=("cam_trans",), betas=("smpl_betas",)),
    _Names("pred_rotmat", position=("pred_trans",), betas=("pred_shape",)),
    _Names("pred_thetas", position=("transl_camsys", "transl"), betas=("pred_betas",)),
    _Names(
        "smpl_pose",
        root=("smpl_orient_world", "smpl_orient_cam"),
        position=("root_trans_world", "root_trans_cam"),
        betas=("smpl_beta",),
    ),
    _Names("body_pose"),
    _Names("body_pose_axis"),
    _Names("pose_body"),
    _Names("poses_body", root=("poses_root",)),
    _Names("pose_aa"),
    _Names("fullpose"),
    _Names("poses"),
    _Names("pose"),
    _Names("thetas"),
    _Names("rotations"),
    _Names("rotvec", position=("transl_pelvis", "transl")),
    _Names("bodyPose", position=("bodyTranslation",), betas=("shapeParameters",)),
    _Names("local_rot_mats", position=("root_positions",)),
)


@dataclass(frozen=True)
class Found:
    """Where SMPL parameters are."""

    node: Tree
    """The dictionary that has them."""
    names: _Names
    form: Form
    frames: int
    """How many frames there are."""
    people: int | None
    """How many people there are, where the arrays have an axis for them beside that of the frames."""
    people_first: bool = True
    """Whether that axis is the first; else it is the second."""
    outer: Tree | None = None
    """The dictionary around it, if that is the person's."""

    def read(self, person: int | None = None) -> SmplArrays:
        """The arrays, of one of the people where there are several."""
        node, names = self.node, self.names
        pose = node[names.pose]
        array = pose.array() if person is None else pose.array().take(person, 0 if self.people_first else 1)
        first = 1 if self.form.joints in WITH_ROOT else 0
        roots = names.root or (() if first else _ROOTS)
        root, position, betas = (self._array(keys, person) for keys in (roots, names.position, names.betas))
        frames = self._array(_FRAMES, person)
        if frames is None and self.outer is not None:
            frames = replace(self, node=self.outer)._array(_FRAMES, person)
        scaling = node.get("smpl_scaling") if names.pose == "smpl_poses" else None
        if position is not None and scaling is not None and scaling.number() > 0:
            position = position / scaling.number()  # AIST++ has places in units of a scaled body
        frames = frames if frames is not None and frames.size == len(array) else None
        return SmplArrays(pose.where, array, self.form, first, root, position, betas, frames)

    def shape(self) -> list[float] | None:
        """The body's shape, of the first of the people or frames that have one; None where there is none."""
        betas = self.node.find_array(*self.names.betas)
        if betas is None or betas.ndim == 0 or not betas.size:
            return None
        return betas.reshape(-1, betas.shape[-1])[0].tolist()

    def tracks(self, person: str = "") -> list[Track]:
        """One for each of the people; the name is for a single one."""
        homes = (self.node,) if self.outer is None else (self.node, self.outer)
        if self.people is None:
            return [Track(person, self.frames, self.read, homes)]
        return [Track(str(n), self.frames, lambda n=n: self.read(n), homes) for n in range(self.people)]

    def _array(self, keys: tuple[str, ...], person: int | None) -> np.ndarray | None:
        array = self.node.find_array(*keys)
        if array is None or person is None or array.ndim < 2:
            return array
        axes = (0,) if self.people_first else (1, 0)  # a shape has people alone
        axis = next((axis for axis in axes if array.shape[axis] == self.people), None)
        return array if axis is None else array.take(person, axis)


def find_here(node: Tree) -> Found | None:
    """SMPL parameters that are entries of a dictionary; None where there are none."""
    if not node.is_mapping:
        return None
    keys = set(node.keys)
    for names in _NAMES:
        shape = node[names.pose].shape() if names.pose in keys else None
        if shape is None or len(shape) < 2:
            continue
        counts = WITH_ROOT + WITHOUT_ROOT
        form = find_form(shape, counts)
        if form is not None:
            return Found(node, names, form, shape[0], None)
        form = find_form(shape[1:], counts) if len(shape) > 2 else None
        if form is not None:  # there are more frames than people
            people, frames = sorted(shape[:2])
            return Found(node, names, form, frames, people, people_first=shape[0] == people)
    return None


def forms_in(node: Tree) -> Iterator[Form]:
    """The forms of all that a dictionary calls a pose."""
    for names in _NAMES:
        shape = node[names.pose].shape() if names.pose in node.keys else None
        form = None if shape is None or len(shape) < 2 else find_form(shape, WITH_ROOT + WITHOUT_ROOT)
        if form is not None:
            yield form


def find_inside(node: Tree) -> Found | None:
    """The first SMPL parameters in a dictionary or in those in it; those in the world go before what a camera sees."""
    return search(node, find_here)


def search(node: Tree, find: Callable[[Tree], T | None], deepest: int = _DEEPEST) -> T | None:
    """What is found first in a dictionary or in those in it; what is in the world goes before what a camera sees."""
    found = find(node)
    if found is not None or deepest == 0:
        return found
    entries = [(name, child) for name, child in first_entries(node) if child.is_mapping]
    for _, child in sorted(entries, key=lambda entry: _rank(entry[0])):
        found = search(child, find, deepest - 1)
        if found is not None:
            return found
    return None


def first_entries(node: Tree) -> Iterator[tuple[str, Tree]]:
    """The first fifty entries of a dictionary, which tell what the others are."""
    for number, entry in enumerate(node.items()):
        if number == _ENTRIES:
            return
        yield entry


def without_world(name: str) -> str:
    """A name without the words that tell whether its parameters are in the world or as a camera sees them."""
    return "_".join(word for word in words_of(name) if word not in (*_WORLD, *_CAMERA))


def _rank(name: str) -> int:
    words = words_of(name)
    if any(word in words for word in _WORLD):
        return 0
    return 2 if any(word in words for word in _CAMERA) else 1


def words_of(name: str) -> list[str]:
    """The words of a name in small letters: of `smpl_params-incam` and `smplParamsIncam` the same."""
    return re.findall(r"[^\W_]+", re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower())
