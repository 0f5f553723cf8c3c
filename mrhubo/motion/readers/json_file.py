"""Motions in JSON: of DeepMimic's humanoid, SMPL parameters, or else keypoints; also with a line of JSON a frame.

Fit3D and CHI3D have `transl` (T, 3), `global_orient` (T, 1, 3, 3), `body_pose` (T, 21, 3, 3) and `betas` in lists
(https://github.com/sminchisescu-research/imar_vision_datasets_tools); others what they would save as .npz.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from mrhubo.errors import UserError, shortened
from mrhubo.files.regular import read_regular
from mrhubo.files.tree import tree_of
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import Content
from mrhubo.motion.readers.deepmimic import read_deepmimic
from mrhubo.motion.readers.estimators import smpl_motion
from mrhubo.motion.readers.frame_bodies import refuse_frame
from mrhubo.motion.readers.keypoint_files import POSE_KEYS, checked
from mrhubo.motion.readers.keypoint_json import points_of_json
from mrhubo.motion.readers.keypoints import motion_of_points
from mrhubo.motion.readers.options import ReadOptions

_BEGINNING = re.compile(r"\s*+(?:\[\s*+[\[{]|\{\s*+\")")
_POSES = re.compile(rb'"\w*(?:' + "|".join(sorted(POSE_KEYS)).encode() + rb')"\s*+:')
_MAX_BYTES = 2**27


def is_json(content: Content) -> bool:
    """Whether a file begins as a list or a dictionary in JSON does."""
    return content.text is not None and bool(_BEGINNING.match(content.text))


def read_json(path: Path, options: ReadOptions) -> Motion:
    """Reads SMPL parameters, as from any other container, or points of a body.

    Raises:
        NoMotion: it holds neither; says what it holds.
        UserError: the file is damaged, too large, or what it holds is no motion.
    """
    text = read_regular(path, _MAX_BYTES)
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as error:
        lines = _lines(text)
        if lines is None:
            raise UserError(f"{path}: is no JSON: {shortened(str(error), 80)}") from error
        value = lines
    found = read_deepmimic(path, value, options)
    if found is None and _POSES.search(text):
        tree = tree_of(value, path, "")
        found = smpl_motion(path, tree, options)
        if found is None:
            refuse_frame(tree)
    return found or motion_of_points(path, checked(path, points_of_json(path, value, options)), options)


def _lines(text: bytes) -> list[Any] | None:
    """What lines of JSON hold; None of any other text."""
    try:
        values = [json.loads(line) for line in text.splitlines() if line.strip()]
    except (ValueError, RecursionError):
        return None
    return values if len(values) > 1 and all(isinstance(value, dict | list) for value in values) else None
