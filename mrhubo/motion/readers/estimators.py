"""Motions that an estimator of human pose wrote, or whoever else keeps SMPL parameters in dictionaries of arrays."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mrhubo.errors import listed, shortened
from mrhubo.files.matlab import is_matlab
from mrhubo.files.packed import is_packed
from mrhubo.files.tree import Tree, read_tree
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.bare_poses import read_bare_poses
from mrhubo.motion.readers.camera import in_world
from mrhubo.motion.readers.content import Content, NoMotion
from mrhubo.motion.readers.frame_bodies import refuse_frame
from mrhubo.motion.readers.humanml import read_features
from mrhubo.motion.readers.interhuman import read_interhuman
from mrhubo.motion.readers.key_words import nested
from mrhubo.motion.readers.keypoint_dictionaries import points_in
from mrhubo.motion.readers.keypoint_files import checked
from mrhubo.motion.readers.keypoint_json import points_of_frames
from mrhubo.motion.readers.keypoints import motion_of_points
from mrhubo.motion.readers.layouts import find_layout
from mrhubo.motion.readers.markers.recording import read_recording
from mrhubo.motion.readers.motionstreamer import read_streamed
from mrhubo.motion.readers.nymeria import read_nymeria
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.people import holds_parameters
from mrhubo.motion.readers.rate import find_rate
from mrhubo.motion.readers.rows import read_rows
from mrhubo.motion.readers.sam3d import read_sam3d
from mrhubo.motion.readers.scene.mimickit import read_mimickit
from mrhubo.motion.readers.scene.poselib import read_poselib
from mrhubo.motion.readers.six_rows import read_six_rows
from mrhubo.motion.readers.smpl_names import first_entries, is_robot
from mrhubo.motion.readers.soma import read_soma
from mrhubo.motion.readers.tracks import choose, motion_of

_MAX_PROTOCOL = 5
_OLD_STARTS = (b"(dp", b"(lp", b"}q", b"]q", b"ccollections\n", b"cnumpy")
"""How pickles of protocols 0 and 1 begin."""


def is_container(content: Content) -> bool:
    """Whether a file holds a dictionary or list of arrays, as programs in Python write them."""
    start = content.start
    is_pickle = start[:1] == b"\x80" and len(start) > 1 and start[1] <= _MAX_PROTOCOL
    return (
        is_pickle
        or start.startswith(_OLD_STARTS)
        or is_packed(start)
        or is_matlab(start)
        or content.is_torch
        or bool(content.arrays)
        or content.is_npy
    )


@np.errstate(all="ignore")  # what overflows is found out where it matters
def read_estimated(path: Path, options: ReadOptions) -> Motion:
    """Reads SMPL parameters from a pickle, a PyTorch file, an .npz or an .npy file, whose layout one of
    `mrhubo.motion.readers.layouts` knows.

    Raises:
        NoMotion: nobody knows it; says what the file holds.
        UserError: the file is damaged, hostile, too large, or what it tells is no motion.
    """
    tree = nested(read_tree(path))

    def rate(notes: list[str]) -> float:
        return find_rate(path, (tree, *(child for _, child in first_entries(tree))), options, notes)

    found = (
        read_recording(tree, options)
        or read_rows(tree, options)
        or read_bare_poses(tree, options)
        or read_features(tree, options)
        or read_interhuman(tree, options)
        or read_six_rows(tree, options)
        or read_streamed(tree, options)
        or read_soma(tree, options, rate)
        or read_sam3d(tree, options, rate)
        or read_nymeria(tree, rate)
        or read_poselib(tree, options, rate)
        or read_mimickit(tree, options, rate)
    )
    found = found or smpl_motion(path, tree, options)
    points = points_in(tree, options) or points_of_frames(tree, options) if found is None else None
    if points is not None:
        return motion_of_points(path, checked(path, points), options)
    if found is None:
        refuse_frame(tree)
        _refuse_robot(tree)
        content = Content.open(path)
        what = content.described if content.arrays else f"{content.described} of {tree.described}"
        raise NoMotion(
            f"{path}: is {what}, in which there is no human motion that is known here; expected what WHAM, GVHMR, GEM,"
            " 4D-Humans, TRAM, ROMP, PyMAF-X, SAM 3D Body or another writes, SMPL's 'poses' (frames, 72), say, or"
            " 'keypoints' (frames, points, 3); docs/formats.md says how each is laid out"
        )
    return found


def smpl_motion(path: Path, tree: Tree, options: ReadOptions) -> Motion | None:
    """The motion of SMPL parameters, whatever container they were in; None where nobody knows the layout.

    Raises:
        UserError: what it tells is no motion.
    """
    layout = find_layout(tree)
    if layout is None:
        return None
    notes = list(layout.notes)
    track = choose(path, layout.tracks, options, notes)
    arrays = track.read()
    if layout.camera_beside:
        arrays = in_world(path, arrays, notes)
    rate = find_rate(path, (*track.homes, *_whole(tree)), options, notes)
    return motion_of(path, arrays, layout.kind, rate, notes)


def _refuse_robot(tree: Tree) -> None:
    """Refuses a robot's motion, or a dictionary of such.

    Raises:
        NoMotion: it is one; says so.
    """
    robot = next((node for node in (tree, *(child for _, child in first_entries(tree))) if is_robot(node)), None)
    if robot is not None:
        raise NoMotion(
            f"{robot.named}: tells the angles of a robot's joints ({shortened(listed(robot.keys), 120)}), and no human"
            " motion; name the one from which it was made"
        )


def _whole(tree: Tree) -> Iterator[Tree]:
    """Dictionaries that may tell what goes for all: the file's own, and those in it, but none of a person."""
    yield tree
    for _, child in first_entries(tree):
        if child.is_mapping and not holds_parameters(child):
            yield child
