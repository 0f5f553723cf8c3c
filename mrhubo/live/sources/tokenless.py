"""Programs that send by UDP in a protocol that knows no token and no heartbeat: one at a time, from this machine."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Protocol

from mrhubo.errors import UserError
from mrhubo.live.endpoints import Endpoint
from mrhubo.live.inbox import LEASE, Inbox
from mrhubo.live.messages import Content, Message, Refused
from mrhubo.live.sources.udp import DatagramSource


class Feed(Protocol):
    """What a sender has told so far."""

    dropped: int
    """Messages in its datagrams that told nothing as the protocol does."""

    def take(self, datagram: bytes, now: float) -> bool:
        """Takes a datagram that came at a time [s]; whether it tells something new.

        Raises:
            Refused: it is none of the protocol.
        """
        ...

    @property
    def content(self) -> Content:
        """What is seen now."""
        ...


class TokenlessSource(DatagramSource):
    """A receiver of such a protocol, on loopback alone."""

    has_heartbeat = False

    def __init__(self, endpoint: Endpoint, name: str, protocol: str, feed: Callable[[], Feed]) -> None:
        """Where to listen, and to what.

        Args:
            endpoint: on this machine.
            name: the source's, as users write it.
            protocol: its name, for a sentence.
            feed: makes one of a sender who has told nothing.

        Raises:
            UserError: the host is reached by others.
        """
        if not endpoint.is_loopback:
            raise UserError(
                f"--source {name}:{endpoint.shown}: {protocol} has no token, so it is taken on loopback alone; let a"
                " program on this machine send it on to 127.0.0.1"
            )
        super().__init__(endpoint)
        self._make, self._feed = feed, feed()
        self._session, self._number = str(time.time_ns()), 0
        self._owner: str | None = None
        """Whose body it is: parts of two would make one that nobody has."""
        self._at = -math.inf
        """When the owner was heard of last [s]."""

    def read(self, inbox: Inbox, now: float) -> bool:
        """Empties the socket; all that has come is one frame."""
        moved = False

        def take(data: bytes, sender: str) -> None:
            nonlocal moved
            is_owner = sender == self._owner
            if not is_owner and now - self._at <= LEASE:
                inbox.counts["other_sender"] += 1
                return
            feed = self._feed if is_owner else self._make()
            try:
                if feed.take(data, now):
                    self._feed, self._owner, self._at, moved = feed, sender, now, True
            except Refused as fault:
                inbox.counts[str(fault)] += 1
            inbox.counts["malformed"] += feed.dropped
            feed.dropped = 0

        self._datagrams.read(take)
        if moved and self._owner is not None:
            self._number += 1
            inbox.offer(Message(self._session, self._number, now, self._feed.content), self._owner, now)
        return True
