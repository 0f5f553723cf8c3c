"""A live session: sources are read, the pilot is asked, sinks are told, once a period, until it ends."""

from __future__ import annotations

import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

from mrhubo.config.live import LiveConfig
from mrhubo.live.inbox import Inbox
from mrhubo.live.output import Output
from mrhubo.live.pilot import Pilot
from mrhubo.live.robot import LiveRobot

_LONGEST_STOP_STEPS = 10_000


class Source(Protocol):
    """Where messages come from."""

    has_heartbeat: bool
    """Whether its senders tell when the robot may move; else its frames do."""

    def open(self) -> None:
        """Begins to listen.

        Raises:
            UserError: it cannot.
        """
        ...

    def read(self, inbox: Inbox, now: float) -> bool:
        """Gives the inbox all that has come since the last call, and never waits; False when no more will come."""
        ...

    def close(self) -> None:
        """Ends; may be called twice, and without `open`."""
        ...


class Sink(Protocol):
    """Where joint angles go."""

    def open(self, robot: LiveRobot, config: LiveConfig) -> None:
        """Gets ready.

        Raises:
            UserError: it cannot.
        """
        ...

    def send(self, output: Output) -> None:
        """Takes the joint angles of a moment; must not wait longer than a small part of a period.

        Raises:
            UserError: it is broken: the session then stops the robot and ends, as after any other error.
        """
        ...

    def close(self) -> None:
        """Ends; may be called twice, and without `open`."""
        ...


@runtime_checkable
class Telling(Protocol):
    """A sink that has something to say of a session that is over, which others need not."""

    def told(self) -> str:
        """A line."""
        ...


@dataclass
class Session:
    """A pilot between its sources and its sinks."""

    pilot: Pilot
    sources: Sequence[Source]
    sinks: Sequence[Sink]
    last: Output | None = None
    """What was sent last."""
    fault: Exception | None = None
    """Of a sink, the first."""
    states: Counter[str] = field(default_factory=Counter)
    """How many outputs were of each state."""

    @property
    def counts(self) -> Counter[str]:
        """How many messages came of each kind: `frames` and `heartbeats`, and what changed nothing, by the fault."""
        return self.pilot.inbox.counts

    def summary(self) -> str:
        """What happened, in a few lines."""
        sent = ", ".join(f"{count} {state}" for state, count in self.states.items())
        came = ", ".join(f"{count} {kind}" for kind, count in self.counts.items() if count)
        more = [sink.told() for sink in self.sinks if isinstance(sink, Telling)]
        if pauses := self.pilot.pauses:
            more.append(
                f"held up: {pauses} times for longer than stop_time, in which the robot stopped; the machine is busy,"
                " or a sink waits"
            )
        more += [silences] if (silences := self.pilot.silences.told()) else []
        return "\n".join([f"sent: {sent or 'nothing'}\nreceived: {came or 'nothing'}", *more])

    @classmethod
    def of(cls, robot: LiveRobot, sources: Sequence[Source], sinks: Sequence[Sink], config: LiveConfig) -> Session:
        """One whose sources and sinks are not open yet."""
        without = all(not source.has_heartbeat for source in sources)
        return cls(Pilot(robot, config, config.deadman == "frames" or (config.deadman == "auto" and without)),
                   sources, sinks)  # fmt: skip

    def open(self) -> None:
        """Opens sinks, then sources.

        Raises:
            UserError: one cannot be opened; all are closed again.
        """
        try:
            for sink in self.sinks:
                sink.open(self.pilot.robot, self.pilot.config)
            for source in self.sources:
                source.open()
        except BaseException:
            self.close()
            raise

    def step(self, now: float) -> bool:
        """One period; False when no source will say more."""
        more = [source.read(self.pilot.inbox, now) for source in self.sources]
        self._send(now)
        return any(more) and self.fault is None

    def _send(self, now: float) -> None:
        self.last = output = self.pilot.tick(now)
        self.states[output.state] += 1
        for sink in self.sinks:
            try:
                sink.send(output)
            except Exception as error:  # the other sinks are still to hear how the robot stops
                self.fault = self.fault or error

    def end(self, steps: Callable[[], float]) -> None:
        """Brakes until the robot stands, and closes all.

        Args:
            steps: waits for the next period and gives its time [s].
        """
        self.pilot.end()
        try:
            for _ in range(_LONGEST_STOP_STEPS):
                self._send(steps())
                if self.pilot.still:
                    break
        finally:
            self.close()

    def close(self) -> None:
        """Closes all; the first that cannot be closed well is told when all are."""
        for part in (*self.sources, *self.sinks):
            try:
                part.close()
            except Exception as error:
                self.fault = self.fault or error


class Periods:
    """The moments at which a period begins. None comes sooner than a period after the last, whatever was late."""

    def __init__(
        self, rate: float, clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], object] = time.sleep
    ) -> None:
        self.clock = clock
        self._period, self._sleep = 1.0 / rate, sleep
        self._next: float | None = None

    def __call__(self) -> float:
        """Waits for the next one, and gives its time [s]."""
        now = self.clock()
        if self._next is not None and now < self._next:
            self._sleep(self._next - now)
            now = self.clock()
        self._next = now + self._period
        return now


def run(
    robot: LiveRobot,
    sources: Sequence[Source],
    sinks: Sequence[Sink],
    config: LiveConfig | None = None,
    seconds: float | None = None,
) -> Session:
    """Runs a session until its sources end, until Ctrl-C or SIGTERM, or for some time; the robot is stopped softly.

    Args:
        robot: who follows; see `LiveRobot.of_package`, `LiveRobot.of_robot`.
        sources: where frames and heartbeats come from.
        sinks: where joint angles go.
        config: the settings; default: `LiveConfig()`.
        seconds: how long; None: until it ends otherwise.

    Returns:
        The session, with its counts: `session.counts`, `session.states`.

    Raises:
        UserError: something cannot be opened, or broke; the robot has been stopped before.
        KeyboardInterrupt: a signal ended it; the robot has been stopped before.
    """
    session = Session.of(robot, sources, sinks, config or LiveConfig())
    run_session(session, seconds)
    return session


def run_session(session: Session, seconds: float | None = None, started: Callable[[], object] = lambda: None) -> None:
    """As `run`; `started` is called once all is open."""
    periods = Periods(session.pilot.config.rate)
    session.pilot.inbox.clock = periods.clock
    with _Signals() as stop:
        session.open()
        try:
            started()
            now = begun = periods()
            while session.step(now) and not stop.is_set() and (seconds is None or now - begun < seconds):
                now = periods()
        finally:
            session.end(periods)
    if session.fault is not None:
        raise session.fault


class _Signals:
    """While it lasts, Ctrl-C and SIGTERM do not interrupt what is being done, but say that it is to end; a second one
    interrupts. At the end whoever would have been interrupted is.
    """

    def __enter__(self) -> threading.Event:
        self._event, self._came = threading.Event(), 0
        self._before = {}
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                before = signal.getsignal(number)
                if callable(before):
                    self._before[number] = before
                    signal.signal(number, self._note)
        return self._event

    def _note(self, number: int, frame: object) -> None:
        self._came = number
        self._event.set()
        signal.signal(number, self._before[signal.Signals(number)])

    def __exit__(self, *error: object) -> None:
        for number, before in self._before.items():
            signal.signal(number, before)
        if self._came and error[0] is None:
            signal.raise_signal(self._came)
