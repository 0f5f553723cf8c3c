"""Human motion: what it is in memory, how it is read and written.

What works with PyTorch is imported when it is first asked for: reading a motion needs none.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mrhubo.lazy import lazy_names
from mrhubo.motion.editing import mirror, trim
from mrhubo.motion.load import find_motions, motion_files, read_folder, read_motion
from mrhubo.motion.motion import Motion
from mrhubo.motion.readers.content import NoMotion
from mrhubo.motion.readers.options import ReadOptions
from mrhubo.motion.resample import resample
from mrhubo.motion.writers.amass import write_motion

if TYPE_CHECKING:
    from mrhubo.motion.poses import NOT_FINITE, MotionLike, Poses, read_poses, refuse_frames, to_tensor
    from mrhubo.motion.resharing import reshare

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
_HOMES = {
    "NOT_FINITE": ".poses",
    "MotionLike": ".poses",
    "Poses": ".poses",
    "read_poses": ".poses",
    "refuse_frames": ".poses",
    "reshare": ".resharing",
    "to_tensor": ".poses",
}
"""Module of each name that needs PyTorch."""

__getattr__ = lazy_names(__name__, _HOMES)
