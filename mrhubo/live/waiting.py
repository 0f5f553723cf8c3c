"""Messages of a server's clients that wait for the session: a bounded number, of bounded size, the newest."""

from __future__ import annotations

import threading
from collections import deque

from mrhubo.live.messages import MAX_BYTES

MOST = 64
"""Messages that wait."""
_MOST_BYTES = 2 * MAX_BYTES
"""Of these: reading what is in so many takes some milliseconds, and a session that reads for longer tells the robot
nothing meanwhile.
"""


class Waiting:
    """Is filled by the server's thread, and emptied by the session's."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._messages: deque[tuple[str, bytes | str]] = deque()
        self._size = self._lost = 0
        self._gone: list[str] = []

    def __len__(self) -> int:
        return len(self._messages)

    def put(self, sender: str, data: bytes | str) -> None:
        """One message; where there is no room, the oldest are lost."""
        with self._lock:
            self._messages.append((sender, data))
            self._size += len(data)
            while len(self._messages) > MOST or (self._size > _MOST_BYTES and len(self._messages) > 1):
                self._size -= len(self._messages.popleft()[1])
                self._lost += 1

    def end(self, sender: str) -> None:
        """A client has gone; that is not lost."""
        with self._lock:
            self._gone.append(sender)

    def take(self) -> tuple[list[tuple[str, bytes | str]], list[str], int]:
        """What has come since the last call: messages, those who have gone since, and how many messages were lost."""
        with self._lock:
            found = list(self._messages), self._gone, self._lost
            self._messages.clear()
            self._gone, self._size, self._lost = [], 0, 0
        return found
