"""Motions in folders with a file of points a frame: JSON laid out as frames of a JSON file are, or an array.

An array, alone or under a usual name, is (K, 3) or (K, 4), of people (N, K, 3), or one of each person by name, as
EgoHumans' and Harmony4D's `poses3d` have them (https://github.com/rawalkhirodkar/egohumans).

Legend: K keypoints, N people.
"""

from __future__ import annotations

from pathlib import Path

from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.frame_files import Frames, plain_frame
from mrhubo.motion.readers.keypoint_files import checked
from mrhubo.motion.readers.keypoint_json import points_of_json
from mrhubo.motion.readers.keypoints import motion_of_points
from mrhubo.motion.readers.options import ReadOptions


def read_point_files(folder: Path, frames: Frames, options: ReadOptions) -> Motion:
    """Reads one of the people in a folder.

    Args:
        folder: what the motion is called after.
        frames: its files.
        options: person, rate.

    Raises:
        NoMotion: there are no points.
        UserError: a file is damaged, or of another kind than others; the order of the frames or the rate is not known.
    """
    content = {file.stem: plain_frame(file) for file in frames.files}
    return motion_of_points(folder, checked(folder, points_of_json(folder, content, options)), options)
