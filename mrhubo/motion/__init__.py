"""Human motion in: AMASS and SMPL-X files."""

from mrhubo.motion.amass import Motion, find_motions, read_folder, read_motion, write_motion

__all__ = ["Motion", "find_motions", "read_folder", "read_motion", "write_motion"]
