"""A camera's way through the world, in a file of its own beside a person's: what the camera saw, in the world.

TRAM writes `results/VIDEO/camera.npy` and `results/VIDEO/hps/hps_track_0.npy`: rotations `pred_cam_R` (X, 3, 3) and
places `pred_cam_T` (X, 3) [m] of the camera in the world, a row for each frame of the video, so that what it sees at c
is at R c + T (https://github.com/yufu-wang/tram/blob/main/lib/pipeline/visualization.py). The world is that of the
camera in the first frame.

Legend: X frames of the video, S frames in which somebody is seen.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from mrhubo.errors import UserError
from mrhubo.files.tree import read_tree
from mrhubo.motion.readers.rotations import Form, to_matrices
from mrhubo.motion.readers.tracks import SmplArrays

_FILE = "camera.npy"
_ROTATION, _PLACE = "pred_cam_R", "pred_cam_T"


def in_world(path: Path, arrays: SmplArrays, notes: list[str]) -> SmplArrays:
    """A person's parameters with the root in the world, where the camera's file lies beside theirs or a folder above;
    else as they are. A note says which; a camera's file that cannot be used is left out.

    Args:
        path: the person's file.
        arrays: as the camera sees them; used where they are matrices, the root first.
        notes: gets one more.
    """
    file = next((folder / _FILE for folder in (path.parent, path.parent.parent) if (folder / _FILE).is_file()), None)
    if not arrays.form.matrices or arrays.first != 1:
        return arrays
    if file is None or file == path:
        notes.append(f"how the camera moves is not known: no {_FILE} lies beside the file or in the folder above")
        return arrays
    try:
        turn_S33, place_S3 = _camera(file, arrays)
    except UserError as error:
        notes.append(f"the camera's way is left out: {error}")
        return arrays
    seen = len(arrays.pose)
    root_S33 = arrays.pose.reshape(seen, -1, 3, 3)[:, 0].astype(np.float64)
    position = arrays.position
    if position is not None and position.size == 3 * seen:
        seen_S3 = position.reshape(seen, 3).astype(np.float64)
        position = (turn_S33 @ seen_S3[..., None])[..., 0] + place_S3
    notes.append(f"the root is in the world, by the camera's way in {file.name}")
    return replace(arrays, root=turn_S33 @ root_S33, position=position)


def _camera(file: Path, arrays: SmplArrays) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (S, 3, 3) and places (S, 3) [m] of the camera in the frames in which the person is seen.

    Raises:
        UserError: the file is damaged, or does not tell them.
    """
    tree = read_tree(file)
    turn, place = (tree.find_array(key) if tree.is_mapping else None for key in (_ROTATION, _PLACE))
    if turn is None or place is None or turn.shape != (len(turn), 3, 3) or place.shape != (len(turn), 3):
        raise UserError(f"{file}: has no '{_ROTATION}' (frames, 3, 3) and '{_PLACE}' (frames, 3)")
    numbers = np.arange(len(arrays.pose)) if arrays.frames is None else arrays.frames.reshape(-1)
    if not ((numbers >= 0) & (numbers < len(turn))).all():
        raise UserError(f"{file}: has {len(turn):,} frames, and the person is seen in others")
    frames = numbers.astype(np.int64)
    turn_S133 = to_matrices(turn[frames].reshape(-1, 9), Form(1, True), np.inf)
    place_S3 = place[frames].astype(np.float64)
    if turn_S133 is None or not np.isfinite(place_S3).all():
        raise UserError(f"{file}: holds NaN, infinite numbers, or what is no rotation")
    return turn_S133[:, 0].astype(np.float64), place_S3
