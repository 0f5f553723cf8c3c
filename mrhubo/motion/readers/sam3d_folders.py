"""Motions in folders with a file of SAM 3D Body's answers a frame, or a file a person and frame.

A file is an answer with `pred_keypoints_3d` (70, 3), or has a list of them, itself or as `data`, as `np.savez(path,
data=outputs)` keeps what `process_one_image` of https://github.com/facebookresearch/sam-3d-body gives. Of
`00012_1.npz` the first number is that of the frame, and the second that of a person in it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mrhubo.errors import UserError
from mrhubo.files.tree import Tree, tree_of
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.frame_files import Frames, numbers_of_files, read_frame_tree
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import asked_rate
from mrhubo.motion.readers.sam3d import CAMERA, KEY, answers_in, read_sam3d


def read_sam3d_files(folder: Path, frames: Frames, options: ReadOptions) -> Motion:
    """Reads one of the people in a folder.

    Args:
        folder: what the motion is called after.
        frames: its files.
        options: person, rate.

    Raises:
        NoMotion: nobody is there.
        UserError: a file is damaged, or of another kind than others; the order of the frames or the rate is not known.
    """
    seen: dict[int, list[dict[str, Any]]] = {}
    for number, file in zip(numbers_of_files(folder, frames), frames.files, strict=True):
        answers = answers_in(read_frame_tree(file))
        if answers is None:
            raise UserError(f"{file}: has no answer of SAM 3D Body, as other files of its folder have")
        seen.setdefault(number, []).extend(map(_kept, answers))
    if not any(seen.values()):
        raise NoMotion(f"{folder}: nobody is seen in its {len(seen):,} frames")
    tree = tree_of({f"{number:09}": here for number, here in seen.items()}, folder, "")
    motion = read_sam3d(tree, options, lambda notes: asked_rate(folder, options))
    if motion is None:
        raise NoMotion(f"{folder}: has no '{KEY}' of people in frames")
    return motion


def _kept(answer: Tree) -> dict[str, Any]:
    """What is needed of an answer, without the skin's thousands of points."""
    arrays = {name: answer.find_array(name) for name in (KEY, CAMERA)}
    return {name: array for name, array in arrays.items() if array is not None}
