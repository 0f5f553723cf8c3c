"""SMPL parameters in a dictionary of arrays, under the names that are in use.

Where a name is from: `pose_world` WHAM, `smpl_poses` AIST++ (https://google.github.io/aistplusplus_dataset),
`smpl_thetas` ROMP, `pred_rotmat` TRAM, `pred_thetas` HybrIK (https://github.com/Jeff-sjtu/HybrIK), `body_pose` the
package smplx (https://github.com/vchoutas/smplx), `pose_body` AMASS, `poses_body` EMDB
(https://github.com/eth-ait/emdb), `pose_aa` PHC (https://github.com/ZhengyiLuo/PHC), `fullpose` GRAB
(https://github.com/otaheri/GRAB), `smpl_pose` GLAMR (https://github.com/NVlabs/GLAMR), `local_rot_mats` Kimodo,
`rotvec` Multi-HMR (https://github.com/naver/multi-hmr), `body_pose_axis` TalkSHOW
(https://github.com/yhw-yhw/TalkSHOW), `bodyPose` Meshcapade's .smpl (https://pypi.org/project/smplcodec),
`pose_est_fullposes` SAMP (https://samp.is.tue.mpg.de), `local_rot_aa` CHOIS
(https://github.com/lijiaman/chois_release), `poses` and `pose` everybody. Names with words of a model or an estimator
in them, such as `smplx_pose`, are told by `mrhubo.motion.readers.key_words`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from mrhubo.files.tree import Tree
from mrhubo.motion.readers.key_words import by_usual_names, in_world, rank
from mrhubo.motion.readers.rotations import WITH_ROOT, WITHOUT_ROOT, Form, find_form
from mrhubo.motion.readers.tracks import SmplArrays, Track

T = TypeVar("T")
ROOTS = (
    "global_orient", "root_orient", "root_pose", "global_orientation", "root_orientation", "root_rotation", "root_rot",
    "root_aa", "global_rot", "global_rotation", "global_root_orient", "pose_root", "poses_root", "orient",
)  # fmt: skip
PLACES = (
    "trans", "transl", "tran", "translation", "translations", "root_trans", "root_transl", "root_translation",
    "root_trans_offset", "trans_orig", "global_t", "global_trans", "global_transl", "global_translation",
    "root_position", "root_positions", "root_pos",
)  # fmt: skip
_BETAS = ("betas", "beta", "shape")
"""What files call the rotation of the root, its place, and the body's shape."""
_FRAMES = ("frame_ids", "frame_id", "frame", "frames", "frame_idx")
_ROBOT = {"dof", "dofs", "dof_pos", "dof_positions", "joint_pos", "joint_vel", "dof_vel"}
"""What files of robots call the angles of their joints, or how fast those turn."""
_ENTRIES = 50
_MOST_CLIPS = 100_000
_DEEPEST = 3
"""Dictionaries in dictionaries."""


@dataclass(frozen=True)
class _Names:
    """What the arrays of one way of writing are called."""

    pose: str
    root: tuple[str, ...] = ()
    """Before the usual names."""
    position: tuple[str, ...] = ()
    """Before the usual names."""
    betas: tuple[str, ...] = ()
    """Before the usual names."""
    alone: bool = False
    """Whether the usual names of the place are those of something else."""

    @property
    def positions(self) -> tuple[str, ...]:
        """All names of the place."""
        return self.position if self.alone else (*self.position, *PLACES)

    @property
    def shapes(self) -> tuple[str, ...]:
        """All names of the shape."""
        return (*self.betas, *_BETAS)


_NAMES = (
    _Names("pose_world", position=("trans_world",), alone=True),
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
    _Names("pose_est_fullposes", position=("pose_est_trans",), betas=("shape_est_betas",)),
    _Names("local_rot_aa"),
    *map(_Names, ("full_pose", "body_poses", "theta", "rotmats", "rot_mats", "gt")),
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

    @property
    def pose(self) -> Tree:
        """The rotations."""
        own = self.node.get(self.names.pose)
        return by_usual_names(self.node)[self.names.pose] if own is None else own

    def read(self, person: int | None = None) -> SmplArrays:
        """The arrays, of one of the people where there are several."""
        node, names, pose = self.node, self.names, self.pose
        array = pose.array() if person is None else pose.array().take(person, 0 if self.people_first else 1)
        first = 1 if self.form.joints in WITH_ROOT else 0
        in_pose = first and in_world(node).get(*ROOTS) is None
        roots = names.root if in_pose else (*names.root, *ROOTS)
        root, position, betas = (self._array(keys, person) for keys in (roots, names.positions, names.shapes))
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
        betas = self._find(self.names.shapes)
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
        array = self._find(keys)
        if array is None or person is None or array.ndim < 2:
            return array
        axes = (0,) if self.people_first else (1, 0)  # a shape has people alone
        axis = next((axis for axis in axes if array.shape[axis] == self.people), None)
        return array if axis is None else array.take(person, axis)

    def _find(self, keys: tuple[str, ...]) -> np.ndarray | None:
        """The array that is called by one of some names; that in the world, where pose or root are told in it."""
        world = in_world(self.node)
        pose_told = self.names.pose in world.keys and self.node.get(self.names.pose) is None
        homes = (world,) if pose_told or world.get(*ROOTS) is not None else ()
        found = (home.find_array(*keys) for home in (*homes, self.node, by_usual_names(self.node)))
        return next((array for array in found if array is not None), None)


def find_here(node: Tree) -> Found | None:
    """SMPL parameters that are entries of a dictionary; None where there are none."""
    if not node.is_mapping or is_robot(node):
        return None
    return _found(node, node) or _found(by_usual_names(node), node)


def _found(named: Tree, node: Tree) -> Found | None:
    """The parameters of a dictionary, by names that are its own or the usual ones of its own."""
    keys = set(named.keys)
    for names in _NAMES:
        shape = named[names.pose].shape() if names.pose in keys else None
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


def is_robot(node: Tree) -> bool:
    """Whether a dictionary is of a robot's motion: its joints are told by angles. What such files call `pose_aa` turns
    the robot's links, as many as some person's joints (https://github.com/LeCAR-Lab/human2humanoid).
    """
    return bool(_ROBOT & set(node.keys))


def forms_in(node: Tree) -> Iterator[Form]:
    """The forms of all that a dictionary calls a pose."""
    for names in _NAMES:
        shape = node[names.pose].shape() if names.pose in node.keys else None
        form = None if shape is None or len(shape) < 2 else find_form(shape, WITH_ROOT + WITHOUT_ROOT)
        if form is not None:
            yield form


def clips_in(node: Tree) -> list[Found]:
    """SMPL parameters of several clips, of a dictionary whose entries are lists with an array a clip, as those of
    HumanAct12 and UESTC are (https://github.com/Mathux/ACTOR); none of any other.
    """
    keys = set(node.keys) if node.is_mapping else set()
    key = next((names.pose for names in _NAMES if names.pose in keys and node[names.pose].is_list), None)
    if key is None or not 0 < len(node[key]) <= _MOST_CLIPS:
        return []
    found = [find_here(place) for place in node.places(len(node[key]))]
    return [one for one in found if one is not None] if None not in found else []


def find_inside(node: Tree) -> Found | None:
    """The first SMPL parameters in a dictionary or in those in it; those in the world go before what a camera sees."""
    return search(node, find_here)


def search(node: Tree, find: Callable[[Tree], T | None], deepest: int = _DEEPEST) -> T | None:
    """What is found first in a dictionary or in those in it; what is in the world goes before what a camera sees."""
    found = find(node)
    if found is not None or deepest == 0:
        return found
    entries = [(name, child) for name, child in first_entries(node) if child.is_mapping]
    for _, child in sorted(entries, key=lambda entry: rank(entry[0])):
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
