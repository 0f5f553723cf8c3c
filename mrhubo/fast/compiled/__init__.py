"""The run-time path as numba compiles it, one frame after the other: microseconds, where NumPy takes milliseconds.

Each module says what one of `mrhubo.fast.plain` says, for a single frame, in loops over numbers.
"""

from mrhubo.fast.kept import make_room

make_room()
