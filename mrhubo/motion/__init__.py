"""Human motion: what it is in memory, how it is read and written."""

from mrhubo.motion.editing import mirror, trim
from mrhubo.motion.load import find_motions, motion_files, read_folder, read_motion
from mrhubo.motion.motion import Motion
from mrhubo.motion.poses import NOT_FINITE, MotionLike, Poses, read_poses, refuse_frames, to_tensor
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.resample import resample
from mrhubo.motion.resharing import reshare
from mrhubo.motion.writers.amass import write_motion

__all__ = [
    "NOT_FINITE",
    "Motion",
    "MotionLike",
    "NoMotion",
    "Poses",
    "ReadOptions",
    "find_motions",
    "mirror",
    "motion_files",
    "read_folder",
    "read_motion",
    "read_poses",
    "refuse_frames",
    "resample",
    "reshare",
    "to_tensor",
    "trim",
    "write_motion",
]
