"""Which form of the run-time path answers a motion, so that nobody waits for a compiler that does not pay."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mrhubo.fast import Description, FastRetargeter
from mrhubo.fast.kept import is_kept, numba_is_there
from mrhubo.robot_motion import RobotMotion

if TYPE_CHECKING:
    from mrhubo.motion import Motion

_NUMPY_S = 5e-4
"""What a frame takes in NumPy [s], compiled a quarter of it."""
_START_S, _COMPILE_S = 1.5, 30.0
"""What it takes until the compiled form answers [s]: importing numba, and compiling where nothing has been kept."""


class Forms:
    """A package in NumPy, until as much has been asked as takes as long as making the compiled form ready: then, if
    numba is there, compiled. So both together take at most twice as long as the quicker one alone would.
    """

    def __init__(self, description: Description, avoid_collisions: bool = True) -> None:
        self.fast, self._avoid = FastRetargeter(description, "numpy"), avoid_collisions
        self._left = float("inf")
        """Time [s] that NumPy may still take."""
        if numba_is_there():
            self._left = _START_S if is_kept(description.universal is not None) else _COMPILE_S

    def __call__(self, motion: Motion) -> RobotMotion:
        """The answer to a motion as a whole."""
        self._left -= _NUMPY_S * len(motion)
        if self._left < 0:
            self.fast, self._left = FastRetargeter(self.fast.description, "compiled"), float("inf")
        return self.fast(motion, avoid_collisions=self._avoid)
