"""Sources and sinks by what a user writes after `--source` and `--sink`."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TypeVar

from mrhubo.errors import UserError, shortened, unknown_name
from mrhubo.files.regular import refuse_input
from mrhubo.live.certificate import ServerCertificate
from mrhubo.live.endpoints import LOOPBACK, Endpoint
from mrhubo.live.loop import Sink, Source
from mrhubo.live.server import PORT, PageSink, PageSource, Server

UDP_PORT = 8766
Part = TypeVar("Part")


class Plan:
    """The sources and sinks of one session, which share one server where both are on one port."""

    def __init__(self, host: str = LOOPBACK, certificate: ServerCertificate | None = None) -> None:
        """`host`: where to listen; `certificate`: pages are served by https."""
        self._host, self._certificate = host, certificate
        self._servers: dict[int, Server] = {}
        self.sources: list[Source] = []
        self.sinks: list[Sink] = []
        self.read: list[Path] = []
        """The files that are replayed or simulated."""

    @property
    def has_page(self) -> bool:
        """Whether anything is served to browsers."""
        return bool(self._servers)

    def told(self) -> list[str]:
        """Where it listens once all is open, a sentence each."""
        said = [f"page: {server.url}" for server in self._servers.values()]
        if self._servers and self._certificate is not None:
            made = "made for this machine, so that browsers warn of it" if self._certificate.ours else "your own"
            said.append(f"certificate: {made}; SHA-256 {self._certificate.fingerprint}")
        for source in self.sources:
            endpoint = getattr(source, "endpoint", None)
            if isinstance(endpoint, Endpoint):
                token = getattr(source, "token", None)
                said.append(f"listening: udp {endpoint.shown}" + ("" if token is None else f", token {token}"))
            said += [f"note: {note}" for note in getattr(source, "notes", ())]
        return said

    def add_source(self, text: str) -> None:
        """`NAME` or `NAME:WHERE`.

        Raises:
            UserError: there is no such source, or it needs what is missing.
        """
        name, _, where = text.partition(":")
        makers: dict[str, Callable[[str], Source]] = {
            "ws": lambda where: PageSource(self._server(where, text)),
            "udp": self._udp_source,
            "vmc": self._vmc_source,
            "pico": _pico,
            "replay": lambda where: self._replay(where, False),
            "replay-loop": lambda where: self._replay(where, True),
        }
        self.sources.append(_chosen("source", name, makers)(where))

    def add_sink(self, text: str) -> None:
        """`NAME` or `NAME:WHERE`.

        Raises:
            UserError: there is no such sink, or it needs what is missing.
        """
        name, _, where = text.partition(":")
        makers: dict[str, Callable[[str], Sink]] = {
            "ws": lambda where: PageSink(self._server(where, text)),
            "udp": _udp_sink,
            "file": _file_sink,
            "mcap": _mcap_sink,
            "ros2": _ros2_sink,
            "mujoco": lambda where: self._mujoco_sink(where, False),
            "mujoco-free": lambda where: self._mujoco_sink(where, True),
        }
        self.sinks.append(_chosen("sink", name, makers)(where))

    def refuse_inputs(self, more: Iterable[str | None]) -> None:
        """Refuses sinks that would write over a file that is read, by a source, or `more` of them.

        Raises:
            UserError: one would.
        """
        inputs = [*self.read, *more]
        for sink in self.sinks:
            path = getattr(sink, "path", None)
            if isinstance(path, Path):
                refuse_input("--sink", path, inputs)

    def check_addresses(self) -> None:
        """Binds all addresses and leaves them again: one that cannot be had is told before anything is compiled.

        Raises:
            UserError: one is used, by another program or by two sources of this session, is not ours, or is unknown.
        """
        with contextlib.ExitStack() as bound:
            for server in self._servers.values():
                bound.enter_context(server.endpoint.bound(socket.SOCK_STREAM))
            for source in self.sources:
                endpoint = getattr(source, "endpoint", None)
                if isinstance(endpoint, Endpoint):
                    bound.enter_context(endpoint.bound())
            for sink in self.sinks:
                endpoint = getattr(sink, "endpoint", None)
                if isinstance(endpoint, Endpoint):
                    bound.enter_context(endpoint.socket()[0])

    def _server(self, where: str, text: str) -> Server:
        endpoint = Endpoint.read(where, text, PORT, self._host)
        return self._servers.setdefault(endpoint.port, Server(endpoint, certificate=self._certificate))

    def _udp_source(self, where: str) -> Source:
        from mrhubo.live.sources.udp import UdpSource

        return UdpSource(Endpoint.read(where, "--source udp", UDP_PORT, self._host))

    def _vmc_source(self, where: str) -> Source:
        from mrhubo.live.sources.vmc import PORT, VmcSource

        return VmcSource(Endpoint.read(where, "--source vmc", PORT))

    def _replay(self, where: str, loop: bool) -> Source:
        from mrhubo.live.sources.replay import ReplaySource

        path, rate = _at_rate(where)
        if not path:
            raise UserError("--source replay: names no file; write replay:dance.bvh")
        self.read.append(Path(path))
        return ReplaySource.of_file(Path(path), loop, rate)

    def _mujoco_sink(self, where: str, free: bool) -> Sink:
        from mrhubo.live.sinks.mujoco import MujocoSink

        model = Path(where) if where else None
        self.read += [] if model is None else [model]
        return MujocoSink(model, free)


def _chosen(kind: str, name: str, makers: Mapping[str, Callable[[str], Part]]) -> Callable[[str], Part]:
    if name not in makers:
        raise UserError(f"--{kind}: {unknown_name(kind, shortened(name), makers)}")
    return makers[name]


def _pico(where: str) -> Source:
    from mrhubo.live.sources.pico import PicoSource

    return PicoSource()


def _at_rate(where: str) -> tuple[str, float | None]:
    """A file, and the frame rate after an `@`; there is none where a file has such a name."""
    path, _, rate = where.rpartition("@")
    if Path(where).exists():
        return where, None
    try:
        return path, float(rate)
    except ValueError:
        return where, None


def _udp_sink(where: str) -> Sink:
    from mrhubo.live.sinks.udp import UdpSink

    return UdpSink(Endpoint.read(where, "--sink udp"))


def _file_sink(where: str) -> Sink:
    from mrhubo.live.sinks.file import FileSink

    if not where:
        raise UserError("--sink file: names no file; write file:session.npz")
    return FileSink(Path(where))


def _mcap_sink(where: str) -> Sink:
    from mrhubo.live.sinks.mcap import McapSink

    if not where:
        raise UserError("--sink mcap: names no file; write mcap:session.mcap")
    return McapSink(Path(where))


def _ros2_sink(where: str) -> Sink:
    from mrhubo.live.sinks.ros2 import Ros2Sink

    return Ros2Sink(where)
