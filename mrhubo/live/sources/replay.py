"""Any motion file as a stream, at its rate: how a session is tried without a camera or a headset."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrhubo.live.body import Root, SeenPose
from mrhubo.live.inbox import Inbox
from mrhubo.live.messages import Message
from mrhubo.live.named import NamedSource
from mrhubo.motion import Motion, ReadOptions, read_motion, resample
from mrhubo.motion.readers.options import NoRate

_NAME, _LOOP = "replay", "replay-loop"
_SLOWEST = 30.0
"""Frames per second: slower ones would look like a stream that breaks off again and again."""


class ReplaySource(NamedSource):
    """The frames of a motion, each when it is due; those that are over when they are asked for are left out."""

    has_heartbeat = False

    def __init__(self, motion: Motion, loop: bool = False) -> None:
        """A motion from its first frame on; `loop`: again and again."""
        arrays = motion.arrays
        self._notes = motion.notes
        self._local_TJ33, self._rate, self._loop = arrays.local_TJ33, motion.frame_rate, loop
        sure_TJ = arrays.confidence_TJ
        self._root_T33, self._place_T3 = arrays.root_rotation_T33, arrays.root_position_T3
        self._sure_TJ = np.ones(self._local_TJ33.shape[:2]) if sure_TJ is None else sure_TJ
        self._begun: float | None = None
        self._last = -1

    @classmethod
    def of_file(cls, path: Path, loop: bool = False, rate: float | None = None) -> ReplaySource:
        """A motion file, of any kind that `read_motion` reads.

        Args:
            path: the file.
            loop: again and again.
            rate: frames per second of a file that does not tell them.

        Raises:
            UserError: it is missing, damaged, or its frame rate is not known.
        """
        try:
            motion = read_motion(path, ReadOptions(rate=rate))
        except NoRate as error:
            raise error.instead(f"say what it is, by --source {_LOOP if loop else _NAME}:{path}@30") from error
        return cls(motion if motion.frame_rate >= _SLOWEST else resample(motion, _SLOWEST), loop)

    def notes(self) -> list[str]:
        """What is to be known of the file."""
        return [f"note: {note}" for note in self._notes]

    def open(self) -> None:
        """The first frame is due when it is asked for."""
        self._begun, self._last = None, -1

    def read(self, inbox: Inbox, now: float) -> bool:
        """Gives the newest frame that is due; False after the last."""
        self._begun = now if self._begun is None else self._begun
        frames = len(self._local_TJ33)
        due = int((now - self._begun) * self._rate + 1e-6)
        if not self._loop and due >= frames:
            return False
        if due > self._last:
            self._last = due
            pose = SeenPose(self._local_TJ33[due % frames], self._sure_TJ[due % frames], self._root(due % frames))
            inbox.offer(Message(_NAME, due, now, pose), _NAME, now)
        return True

    def _root(self, frame: int) -> Root | None:
        if self._root_T33 is None:
            return None
        place_3 = None if self._place_T3 is None else self._place_T3[frame].astype(np.float64)
        return Root(self._root_T33[frame].astype(np.float64), place_3)

    def close(self) -> None:
        """Nothing is open."""
