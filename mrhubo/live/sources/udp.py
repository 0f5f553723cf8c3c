"""JSON messages in UDP datagrams, one in each."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable

from mrhubo.live.endpoints import Endpoint, find_token, token_fits
from mrhubo.live.inbox import Inbox
from mrhubo.live.messages import MAX_BYTES
from mrhubo.live.named import NamedSource

_BUFFER = 2**17
"""Bytes that the system keeps for us between two periods: more are lost, and none gets old."""
_MOST = 512
"""Datagrams that are looked at in a period; the rest of a flood waits in the system's buffer, or is lost there."""
_MOST_BYTES = 2 * MAX_BYTES
"""Of these; reading what is in so many takes some milliseconds, and a session that reads for longer tells the robot
nothing meanwhile.
"""


class Datagrams:
    """A UDP socket that is emptied once a period."""

    def __init__(self, endpoint: Endpoint) -> None:
        self.endpoint = endpoint
        self._socket: socket.socket | None = None

    def open(self) -> Endpoint:
        """Binds; the endpoint with the port that it got.

        Raises:
            UserError: the address is used, or not ours.
        """
        self._socket = self.endpoint.bound()
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER)
        self._socket.setblocking(False)
        self.endpoint = Endpoint(self.endpoint.host, self._socket.getsockname()[1])
        return self.endpoint

    def read(self, take: Callable[[bytes, str], None]) -> None:
        """Gives every datagram that has come, with its sender's address."""
        left = _MOST_BYTES
        for _ in range(_MOST):
            if self._socket is None or left <= 0:
                return
            try:
                data, address = self._socket.recvfrom(MAX_BYTES + 1)
            except BlockingIOError:
                return
            except OSError:  # what the network says of an earlier datagram
                continue
            left -= len(data)
            take(data, f"udp:{address[0]}:{address[1]}")

    def close(self) -> None:
        """Unbinds."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


class DatagramSource(NamedSource):
    """What sources that come by UDP share."""

    token: str | None = None
    """What messages need that come from elsewhere; None: none come."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._datagrams = Datagrams(endpoint)

    @property
    def endpoint(self) -> Endpoint:
        """Where it listens."""
        return self._datagrams.endpoint

    def notes(self) -> list[str]:
        """The address, and the token."""
        return [f"listening: udp {self.endpoint.shown}" + ("" if self.token is None else f", token {self.token}")]

    def open(self) -> None:
        """Binds."""
        self._datagrams.open()

    def close(self) -> None:
        """Unbinds."""
        self._datagrams.close()


class UdpSource(DatagramSource):
    """Messages as docs/live.md specifies them; beyond loopback each has the token as its `token`."""

    has_heartbeat = True

    def __init__(self, endpoint: Endpoint) -> None:
        super().__init__(endpoint)
        self.token = find_token(endpoint.host)

    def read(self, inbox: Inbox, now: float) -> bool:
        """Empties the socket."""

        def take(data: bytes, sender: str) -> None:
            if self.token is None or self._fits(data):
                inbox.offer(data, sender, now)
            else:
                inbox.counts["token"] += 1

        self._datagrams.read(take)
        return True

    def _fits(self, data: bytes) -> bool:
        try:
            told = json.loads(data) if len(data) <= MAX_BYTES else None
        except (ValueError, RecursionError):
            return False
        return isinstance(told, dict) and token_fits(self.token, told.get("token"))
