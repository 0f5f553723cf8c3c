"""Motions in folders with a file of SMPL parameters a frame, a file a person and frame, or a folder a frame.

Who writes such folders, and what is in their files, is said in `mrhubo.motion.readers.frame_bodies`. Of `00012_1.npz`
and of `00012/001.pkl` the first number is that of the frame, and the second that of a person in it, who in the next
frame may be another.
"""

from __future__ import annotations

from pathlib import Path

from mrhubo.errors import UserError
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.body_tracks import body_tracks
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.frame_bodies import Body, bodies_in
from mrhubo.motion.readers.frame_files import Frames, numbers_of_files, read_frame_tree
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.readers.rate import asked_rate
from mrhubo.motion.readers.tracks import Kind, choose, motion_of
from mrhubo.motion.readers.world import ANY_WORLD, CAMERAS


def read_pose_files(folder: Path, frames: Frames, options: ReadOptions) -> Motion:
    """Reads one of the people in a folder.

    Args:
        folder: what the motion is called after.
        frames: its files.
        options: person, rate.

    Raises:
        NoMotion: nobody is there.
        UserError: a file is damaged, or of another kind than others; the order of the frames or the rate is not known.
    """
    notes: list[str] = []
    seen: list[tuple[int, Body]] = []
    files = frames.files
    for frame, file in zip(numbers_of_files(folder, frames), files, strict=True):
        bodies = bodies_in(read_frame_tree(file), frames.most_rows)
        if bodies is None:
            raise UserError(f"{file}: has no SMPL parameters of one frame, as other files of its folder have")
        seen += [(frame, body) for body in bodies]
    if not seen:
        raise NoMotion(f"{folder}: nobody is seen in its {len(files):,} frames")
    tracks, first = body_tracks(folder, seen, notes), seen[0][1]
    worlds = CAMERAS if first.source == "FrankMocap" else ANY_WORLD
    kind = Kind(f"{first.source}, a file a frame", first.family, worlds)
    arrays = choose(folder, tracks, options, notes).read()
    return motion_of(folder, arrays, kind, asked_rate(folder, options), notes)
