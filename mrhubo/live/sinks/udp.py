"""JSON messages in UDP datagrams, one for each output."""

from __future__ import annotations

import contextlib
import socket

from mrhubo.config.live import LiveConfig
from mrhubo.live.endpoints import Endpoint
from mrhubo.live.named import NamedSink
from mrhubo.live.output import Output
from mrhubo.live.robot import LiveRobot


class UdpSink(NamedSink):
    """Sends to one address; what nobody takes is lost."""

    def __init__(self, endpoint: Endpoint) -> None:
        self._endpoint = endpoint
        self._socket: socket.socket | None = None
        self._address: tuple = ()

    @property
    def endpoint(self) -> Endpoint:
        """Where it sends."""
        return self._endpoint

    def open(self, robot: LiveRobot, config: LiveConfig) -> None:
        """Looks the address up.

        Raises:
            UserError: there is no such host, or it is a network's broadcast address.
        """
        self._socket, self._address = self.endpoint.destination()
        self._socket.setblocking(False)

    def send(self, output: Output) -> None:
        """One datagram."""
        if self._socket is not None:
            with contextlib.suppress(OSError):  # no room, or nobody there: the next one is newer
                self._socket.sendto(output.message().encode(), self._address)

    def close(self) -> None:
        """Lets the socket go."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
