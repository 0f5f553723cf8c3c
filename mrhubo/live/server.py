"""A page in the browser, and WebSockets of JSON messages, on one port.

The server has a thread of its own. It keeps a bounded number of messages for the session, which takes them once a
period, and one output for those who watch: whoever is slow misses some, and never sees an old one.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import socket
import threading
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.lazy import import_optional
from mrhubo.live.certificate import ServerCertificate
from mrhubo.live.endpoints import Endpoint, find_token, own_addresses
from mrhubo.live.inbox import Inbox
from mrhubo.live.messages import MAX_BYTES
from mrhubo.live.named import NamedSink, NamedSource
from mrhubo.live.output import Output
from mrhubo.live.robot import LiveRobot
from mrhubo.live.visitors import ROBOT_PATH, SECURITY_HEADERS, SOCKET_PATH, Visitors, find_file, find_model
from mrhubo.live.waiting import Waiting

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection
    from websockets.http11 import Request, Response

PORT = 8765
PAGE = Path(__file__).with_name("page")
"""The folder of the page; `index.html` in it is what the browser shows."""
_MOST_CLIENTS = 16
_MOST_PER_WINDOW, _WINDOW = 60, 0.1
"""Messages of one client in so many seconds; then it has to wait."""
_SHOWN_RATE = 30.0
"""Outputs per second for those who watch."""
_OPENING = 10.0
_PATIENCE = 20.0
"""Seconds without an answer after which a connection is given up. A browser that loads models answers nothing for long;
its heartbeats stop the robot at once, and a connection that is given up loses a press of the button.
"""
_LOGGER = logging.getLogger("mrhubo.live.server")
_LOGGER.setLevel(logging.CRITICAL)  # what strangers send is counted, and not told


class Server:
    """Serves a folder of files, takes messages, and tells outputs."""

    def __init__(self, endpoint: Endpoint, page: Path = PAGE, certificate: ServerCertificate | None = None) -> None:
        """Where to listen.

        Args:
            endpoint: with port 0 any free port.
            page: the folder.
            certificate: for https; None: http.

        Raises:
            UserError: websockets is not installed, or the environment's token is too short.
        """
        import_optional(
            "websockets.asyncio.server", "the page and WebSockets need websockets: pip install 'mrhubo[live]'"
        )
        self.endpoint, self.token = endpoint, find_token(endpoint.host)
        self._page, self.certificate = page, certificate
        self._waiting = Waiting()
        self.figure = b"null"
        """How the robot looks (`mrhubo.live.figure`), JSON; null: nobody knows."""
        self._faults: deque[str] = deque(maxlen=1_000)
        self._thread: threading.Thread | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stop: asyncio.Event | None = None
        self._clients: dict[ServerConnection, asyncio.Event] = {}
        self._shown = ""
        self._fault: Exception | None = None

    @property
    def urls(self) -> list[str]:
        """All by which the page may be opened, the best first: one, or of a server that listens everywhere by this
        machine's name, which phones seldom know, and by its addresses. Beyond loopback each holds the token, behind a
        mark that browsers do not send.
        """
        scheme, hosts = "http" if self.certificate is None else "https", [self.endpoint.host]
        if self.endpoint.host in ("0.0.0.0", "::"):
            reached = sorted(one for one in own_addresses() if one.version == 4 and not one.is_loopback)
            hosts = [socket.gethostname(), *map(str, reached)]
        token = "" if self.token is None else f"#token={self.token}"
        return [f"{scheme}://{Endpoint(host, self.endpoint.port).shown}/{token}" for host in hosts]

    def open(self) -> None:
        """Listens; does nothing if it does already.

        Raises:
            UserError: the address is used, or not ours.
        """
        if self._thread is not None:
            return
        ready = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve(ready)), name="live", daemon=True)
        self._thread.start()
        if not ready.wait(_OPENING) or self._fault is not None:
            why = "it takes too long" if self._fault is None else getattr(self._fault, "strerror", None) or self._fault
            self.close()
            raise UserError(f"{self.endpoint.shown}: cannot listen there: {why}")

    def take(self, inbox: Inbox, now: float) -> None:
        """Gives the inbox all that has come since the last call."""
        for _ in range(len(self._faults)):
            inbox.counts[self._faults.popleft()] += 1
        messages, gone, lost = self._waiting.take()
        inbox.counts["overflow"] += lost
        for sender, data in messages:
            inbox.offer(data, sender, now)
        for sender in gone:
            inbox.gone(sender)

    def show(self, text: str) -> None:
        """Tells all who watch; returns at once."""
        self._shown = text
        if self._loop is not None and not self._loop.is_closed():
            with contextlib.suppress(RuntimeError):  # it is just being closed
                self._loop.call_soon_threadsafe(self._wake)

    def close(self) -> None:
        """Ends all connections."""
        thread, self._thread = self._thread, None
        if thread is not None and self._loop is not None and self._stop is not None:
            with contextlib.suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._stop.set)
            thread.join(_OPENING)

    async def _serve(self, ready: threading.Event) -> None:
        from websockets.asyncio.server import serve

        self._loop, self._stop = asyncio.get_running_loop(), asyncio.Event()
        secure = {} if self.certificate is None else {
            "ssl": self.certificate.context, "ssl_handshake_timeout": 5, "ssl_shutdown_timeout": 1
        }  # fmt: skip
        try:
            async with serve(
                self._meet, self.endpoint.host, self.endpoint.port, process_request=self._answer,
                max_size=MAX_BYTES, max_queue=4, compression=None, open_timeout=5, ping_interval=2,
                ping_timeout=_PATIENCE, close_timeout=1, server_header=None, write_limit=2**15,
                logger=_LOGGER, **secure,
            ) as server:  # fmt: skip
                port = next(iter(server.sockets)).getsockname()[1]
                self.endpoint = Endpoint(self.endpoint.host, port)
                ready.set()
                await self._stop.wait()
        except Exception as error:  # an address that is used, or none, or whatever ends the thread
            self._fault = error
        finally:
            ready.set()

    def _wake(self) -> None:
        for news in self._clients.values():
            news.set()

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Refuses a request, gives a file, or, with None, lets a WebSocket begin."""
        headers = request.headers
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        given = (headers.get("Authorization") if len(headers.get_all("Authorization")) == 1 else "") or ""
        visitors = Visitors(self.endpoint, self.token, self.certificate is not None)
        alone = len(hosts) == 1 and len(origins) <= 1
        origin = origins[0] if origins else None
        bearer = given.removeprefix("Bearer ") or None
        fault = visitors.fault(request.path, hosts[0], origin, bearer) if alone else "host"
        if fault is not None:
            self._faults.append(fault)
            return _response(403, b"refused\n", "text/plain")
        if urlsplit(request.path).path == SOCKET_PATH:
            return None if len(self._clients) < _MOST_CLIENTS else _response(503, b"too many\n", "text/plain")
        if urlsplit(request.path).path == ROBOT_PATH:
            return _response(200, self.figure, "application/json")
        found = find_file(self._page, request.path) or find_model(request.path)
        if found is None:
            return _response(404, b"no such file\n", "text/plain")
        return _response(200, found[0].read_bytes(), found[1])

    async def _meet(self, connection: ServerConnection) -> None:
        """One client, until it goes."""
        from websockets.exceptions import ConnectionClosed

        sender = f"ws:{connection.id}"
        news = self._clients[connection] = asyncio.Event()
        telling = asyncio.create_task(self._tell(connection, news))
        loop, begun, count = asyncio.get_running_loop(), 0.0, 0
        try:
            async for data in connection:
                self._waiting.put(sender, data)
                if loop.time() - begun > _WINDOW:
                    begun, count = loop.time(), 0
                count += 1
                if count >= _MOST_PER_WINDOW:
                    await asyncio.sleep(max(0.0, begun + _WINDOW - loop.time()))
        except ConnectionClosed:
            pass
        finally:
            telling.cancel()
            del self._clients[connection]
            if connection.protocol.close_sent is not None and connection.protocol.close_sent.code == 1009:
                self._faults.append("too_long")
            self._waiting.end(sender)

    async def _tell(self, connection: ServerConnection, news: asyncio.Event) -> None:
        """Sends one client the newest output, over and over."""
        from websockets.exceptions import ConnectionClosed

        with contextlib.suppress(ConnectionClosed):
            while True:
                await news.wait()
                news.clear()
                if self._shown:
                    await connection.send(self._shown)


def _response(status: int, body: bytes, kind: str) -> Any:
    from http import HTTPStatus

    from websockets.datastructures import Headers
    from websockets.http11 import Response

    headers = {"Content-Type": kind, "Content-Length": str(len(body)), "Connection": "close", **SECURITY_HEADERS}
    return Response(status, HTTPStatus(status).phrase, Headers(headers), body)


class PageSource(NamedSource):
    """Frames and heartbeats of those who are connected."""

    has_heartbeat = True

    def __init__(self, server: Server) -> None:
        self.server = server

    def open(self) -> None:
        """Listens."""
        self.server.open()

    def read(self, inbox: Inbox, now: float) -> bool:
        """Empties the server."""
        self.server.take(inbox, now)
        return True

    def close(self) -> None:
        """Ends all connections."""
        self.server.close()


class PageSink(NamedSink):
    """Tells outputs to those who are connected, thirty times a second at most, with the session's counts."""

    def __init__(self, server: Server) -> None:
        self.server = server
        self._every, self._number = 1, 0

    def open(self, robot: LiveRobot, config: LiveConfig) -> None:
        """Listens."""
        self._every = max(1, round(config.rate / _SHOWN_RATE))
        if robot.figure is not None:
            with contextlib.suppress(UserError):  # a robot that cannot be drawn can be moved all the same
                self.server.figure = json.dumps(robot.figure(), separators=(",", ":")).encode()
        self.server.open()

    def send(self, output: Output) -> None:
        """Tells the newest."""
        self._number += 1
        if self._number % self._every == 0 or output.state == "ended":
            self.server.show(output.message(with_counts=True))

    def close(self) -> None:
        """Ends all connections."""
        self.server.close()
