"""Sources and sinks by what a user writes after `--source` and `--sink`."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from mrhubo.errors import UserError, shortened, unknown_name
from mrhubo.files.regular import refuse_input
from mrhubo.live.certificate import ServerCertificate
from mrhubo.live.endpoints import LOOPBACK, Endpoint
from mrhubo.live.named import NamedSink, NamedSource
from mrhubo.live.server import PORT, PageSink, PageSource, Server
from mrhubo.live.sinks.own_file import tried
from mrhubo.video import MODELS

UDP_PORT = 8766
Part = TypeVar("Part")


class Plan:
    """The sources and sinks of one session, which share one server where both are on one port."""

    def __init__(self, host: str = LOOPBACK, certificate: ServerCertificate | None = None) -> None:
        """`host`: where to listen; `certificate`: pages are served by https."""
        self._host, self._certificate = host, certificate
        self._servers: dict[int, Server] = {}
        self.sources: list[NamedSource] = []
        self.sinks: list[NamedSink] = []
        self.read: list[Path] = []
        """The files that are replayed or simulated."""

    @property
    def has_page(self) -> bool:
        """Whether anything is served to browsers."""
        return bool(self._servers)

    def told(self) -> list[str]:
        """Where it listens once all is open, a sentence each."""
        said = [f"page: {', or '.join(server.urls)}" for server in self._servers.values()]
        if self._servers and self._certificate is not None:
            made = "made for this machine, so that browsers warn of it" if self._certificate.ours else "your own"
            said.append(f"certificate: {made}; SHA-256 {self._certificate.fingerprint}")
        return said + [sentence for source in self.sources for sentence in source.notes()]

    def add_source(self, text: str) -> None:
        """`NAME` or `NAME:WHERE`; of a camera `camera@MODEL` too.

        Raises:
            UserError: there is no such source, or it needs what is missing.
        """
        name, _, where = text.partition(":")
        if name.startswith("camera@"):
            name, where = "camera", text.removeprefix("camera")
        makers: dict[str, Callable[[str], NamedSource]] = {
            "ws": lambda where: PageSource(self._server(where, text)),
            "udp": self._udp_source,
            "vmc": _vmc,
            "xsens": _xsens,
            "pico": _pico,
            "camera": _camera,
            "video": self._video,
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
        makers: dict[str, Callable[[str], NamedSink]] = {
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
            for path in sink.writes:
                refuse_input("--sink", path, inputs)

    def check(self) -> None:
        """Binds all addresses and opens all files, and leaves them as they were: what cannot be had is told before
        anything is compiled.

        Raises:
            UserError: an address is used, by another program or by two sources of this session, is not ours, or is
                unknown; what a sink sends would come back to a source; a file cannot be written, or has two sinks.
        """
        listening = [source.endpoint for source in self.sources if source.endpoint is not None]
        with contextlib.ExitStack() as taken:
            for server in self._servers.values():
                taken.enter_context(server.endpoint.bound(socket.SOCK_STREAM))
            for endpoint in listening:
                taken.enter_context(endpoint.bound())
            for sink in self.sinks:
                if sink.endpoint is not None:
                    taken.enter_context(sink.endpoint.destination()[0])
                    _refuse_loop(sink.endpoint, listening)
                for path in sink.writes:
                    taken.enter_context(tried(path))

    def check_robot(self, joint_names: Sequence[str], urdf: Path | None) -> None:
        """Looks whether all sinks are for a robot, as `NamedSink.check`.

        Raises:
            UserError: one is not.
        """
        for sink in self.sinks:
            sink.check(joint_names, urdf)

    def _server(self, where: str, text: str) -> Server:
        endpoint = Endpoint.read(where, text, PORT, self._host)
        if endpoint.port not in self._servers:
            self._servers[endpoint.port] = Server(endpoint, certificate=self._certificate)
        server = self._servers[endpoint.port]
        if server.endpoint.host != endpoint.host:
            raise UserError(f"{text}: port {endpoint.port} is already that of {server.endpoint.host}; name one host")
        return server

    def _udp_source(self, where: str) -> NamedSource:
        from mrhubo.live.sources.udp import UdpSource

        return UdpSource(Endpoint.read(where, "--source udp", UDP_PORT, self._host))

    def _replay(self, where: str, loop: bool) -> NamedSource:
        from mrhubo.live.sources.replay import ReplaySource

        path, rate = _at_rate(where)
        if not path:
            raise UserError("--source replay: names no file; write replay:dance.bvh")
        self.read.append(Path(path))
        return ReplaySource.of_file(Path(path), loop, rate)

    def _video(self, where: str) -> NamedSource:
        from mrhubo.live.sources.camera import CameraSource

        path, model = _with_model(*_parted(where))
        if not path:
            raise UserError("--source video: names no film; write video:dance.mp4")
        self.read.append(Path(path))
        return CameraSource(film=Path(path), model=model)

    def _mujoco_sink(self, where: str, free: bool) -> NamedSink:
        from mrhubo.live.sinks.mujoco import MujocoSink

        model = Path(where) if where else None
        self.read += [] if model is None else [model]
        return MujocoSink(model, free)


def _chosen(kind: str, name: str, makers: Mapping[str, Callable[[str], Part]]) -> Callable[[str], Part]:
    if name not in makers:
        raise UserError(f"--{kind}: {unknown_name(kind, shortened(name), makers)}")
    return makers[name]


def _refuse_loop(to: Endpoint, listening: Iterable[Endpoint]) -> None:
    for endpoint in listening:
        if to.reaches(endpoint):
            raise UserError(
                f"--sink udp:{to.shown}: this session's own --source listens there, and would hear what it sends; name"
                " another port"
            )


def _vmc(where: str) -> NamedSource:
    from mrhubo.live.sources.vmc import PORT, VmcSource

    return VmcSource(Endpoint.read(where, "--source vmc", PORT))


def _xsens(where: str) -> NamedSource:
    from mrhubo.live.sources.xsens import PORT, XsensSource

    return XsensSource(Endpoint.read(where, "--source xsens", PORT))


def _pico(where: str) -> NamedSource:
    from mrhubo.live.sources.pico import PicoSource

    return PicoSource()


def _camera(where: str) -> NamedSource:
    from mrhubo.live.sources.camera import CameraSource

    device, model = _with_model(*where.rpartition("@"))
    return CameraSource(device or "0", model=model)


def _parted(where: str) -> tuple[str, str, str]:
    """A file, an `@` and what stands after it, both empty where there is none, or a file has the whole name."""
    return (where, "", "") if Path(where).exists() else where.rpartition("@")


def _with_model(rest: str, at: str, model: str) -> tuple[str, str]:
    """A camera or a film, and the estimator's model, of what was parted at the `@`."""
    where = rest + at + model
    if at and model not in MODELS and (not rest or rest.isdecimal() or Path(rest).exists()):
        raise UserError(f"--source {shortened(where)}: {unknown_name('model of poses', shortened(model), MODELS)}")
    return (rest, model) if at and model in MODELS else (where, "full")


def _at_rate(where: str) -> tuple[str, float | None]:
    """A file, and the frame rate after an `@`."""
    path, _, rate = _parted(where)
    try:
        return path, float(rate)
    except ValueError:
        return where, None


def _udp_sink(where: str) -> NamedSink:
    from mrhubo.live.sinks.udp import UdpSink

    endpoint = Endpoint.read(where, "--sink udp")
    if endpoint.port == 0:
        raise UserError(f"--sink udp:{endpoint.shown}: nobody listens at port 0; name the receiver's port")
    return UdpSink(endpoint)


def _file_sink(where: str) -> NamedSink:
    from mrhubo.live.sinks.file import FileSink

    if not where:
        raise UserError("--sink file: names no file; write file:session.npz")
    return FileSink(Path(where))


def _mcap_sink(where: str) -> NamedSink:
    from mrhubo.live.sinks.mcap import McapSink

    if not where:
        raise UserError("--sink mcap: names no file; write mcap:session.mcap")
    return McapSink(Path(where))


def _ros2_sink(where: str) -> NamedSink:
    from mrhubo.live.sinks.ros2 import Ros2Sink

    return Ros2Sink(where)
