"""A session from its sources to its sinks, by a clock of the test's own; and how it ends."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrhubo
from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.live import loop
from mrhubo.live.endpoints import TOKEN_VARIABLE, Endpoint
from mrhubo.live.inbox import Inbox
from mrhubo.live.loop import Periods, Session
from mrhubo.live.named import NamedSource
from mrhubo.live.output import STATES, Output
from mrhubo.live.sinks.file import FileSink
from mrhubo.live.sinks.udp import UdpSink
from mrhubo.live.sources.replay import ReplaySource
from mrhubo.live.sources.udp import UdpSource
from mrhubo.motion import read_motion
from tests.live.messages import beat, message
from tests.live.robots import AT_ONCE, NAMES, UPPER, make_robot, random_robot

PERIOD = 1 / 60


class Kept:
    """A sink that keeps all."""

    def __init__(self, breaks_at: int = -1) -> None:
        self.outputs: list[Output] = []
        self.closed, self.breaks_at = 0, breaks_at

    def open(self, robot: Any, config: Any) -> None:
        self.closed = 0

    def send(self, output: Output) -> None:
        self.outputs.append(output)
        if len(self.outputs) == self.breaks_at:
            raise UserError("the arm has come off")

    def close(self) -> None:
        self.closed += 1


class Clock:
    """Time passes as it is slept away."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    found = Clock()
    monkeypatch.setattr(loop, "Periods", lambda rate: Periods(rate, found, found.sleep))
    return found


@pytest.fixture
def replay(root: Path) -> ReplaySource:
    return ReplaySource(read_motion(root / "data" / "motions" / "wave.npz"))


def is_still(output: Output) -> bool:
    return bool(np.abs(output.velocity_N).max() < 1e-9)


def test_a_replay_is_followed_to_its_end_and_stopped(clock: Clock, replay: ReplaySource) -> None:
    sink, config = Kept(), LiveConfig(ramp_time=0.2)
    session = loop.run(random_robot(0), [replay], [sink], config)
    frames = len(replay._local_TJ33)
    assert session.counts["frames"] == pytest.approx(frames, abs=3)
    assert len(sink.outputs) == pytest.approx(frames / 60 * config.rate, abs=15)
    assert sink.outputs[-1].state == "ended" and is_still(sink.outputs[-1]) and sink.closed == 1
    assert max(np.abs(output.velocity_N).max() for output in sink.outputs) > 2
    assert [output.number for output in sink.outputs] == list(range(1, len(sink.outputs) + 1))
    assert set(session.states) <= set(STATES) and session.states["following"] > 300
    assert "frames" in session.summary()


def test_a_session_that_was_held_up_follows_again(clock: Clock) -> None:
    class Held(NamedSource):
        """Says that the button is held, and shows somebody."""

        has_heartbeat, step = True, 0

        def open(self) -> None:
            pass

        def close(self) -> None:
            pass

        def read(self, inbox: Inbox, now: float) -> bool:
            self.step += 1
            clock.now += 0.4 * (self.step == 30)  # between the beginning of a period and its messages
            for number, make in enumerate((beat, message)):
                inbox.offer(make(2 * self.step + number, time=clock.now), "a", now)
            return self.step < 120

    session = loop.run(make_robot(lambda pose, time: UPPER), [Held()], [Kept()], AT_ONCE)
    assert session.states["following"] >= 118 and session.counts["late"] == 0


def test_no_two_outputs_are_closer_than_a_period() -> None:
    clock, delays = Clock(), iter([0.0, 0.05, 0.001, 0.0, 0.002] * 9)
    periods, times = Periods(60.0, clock, clock.sleep), []
    for delay in delays:
        times.append(periods())
        clock.now += delay
    assert np.diff(times).min() >= PERIOD - 1e-9 and np.diff(times).max() < 0.051


def test_a_broken_sink_stops_the_robot_for_all(clock: Clock, replay: ReplaySource) -> None:
    broken, other = Kept(breaks_at=90), Kept()
    with pytest.raises(UserError, match="come off"):
        loop.run(random_robot(0), [replay], [broken, other], AT_ONCE)
    assert 90 <= len(other.outputs) < 100 and is_still(other.outputs[-1]) and other.closed == broken.closed == 1


def test_a_bug_in_a_sink_too(clock: Clock, replay: ReplaySource, monkeypatch: pytest.MonkeyPatch) -> None:
    broken, other = Kept(), Kept()
    monkeypatch.setattr(broken, "send", lambda output: other.outputs[99:] and 1 / 0)
    with pytest.raises(ZeroDivisionError):
        loop.run(random_robot(0), [replay], [broken, other], AT_ONCE)
    assert is_still(other.outputs[-1]) and len(other.outputs) < 115 and other.closed == broken.closed == 1


def test_a_slow_file_is_resampled(tmp_path: Path) -> None:
    from mrhubo.motion import write_motion

    write_motion(tmp_path / "slow.npz", np.zeros((9, 63)), np.zeros((9, 3)), np.zeros((9, 3)), 5.0, "stands")
    assert ReplaySource.of_file(tmp_path / "slow.npz")._rate == 30


def test_a_bug_in_a_source_stops_the_robot(clock: Clock, replay: ReplaySource, monkeypatch: pytest.MonkeyPatch) -> None:
    read, sink = replay.read, Kept()

    def failing(inbox: Inbox, now: float) -> bool:
        if len(sink.outputs) == 100:
            raise ZeroDivisionError
        return read(inbox, now)

    monkeypatch.setattr(replay, "read", failing)
    with pytest.raises(ZeroDivisionError):
        loop.run(random_robot(0), [replay], [sink], AT_ONCE)
    assert not is_still(sink.outputs[99]) and is_still(sink.outputs[-1]) and sink.closed == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_the_robot_and_then_interrupts(clock: Clock, replay: ReplaySource, number: int) -> None:
    def terminated(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(number, terminated)
    try:
        sink, read = Kept(), replay.read

        def reading(inbox: Inbox, now: float) -> bool:
            if len(sink.outputs) == 100:
                os.kill(os.getpid(), number)
            return read(inbox, now)

        replay.read = reading
        with pytest.raises(KeyboardInterrupt):
            loop.run(random_robot(0), [replay], [sink], AT_ONCE)
        assert signal.getsignal(number) is terminated
    finally:
        signal.signal(number, before)
    assert not is_still(sink.outputs[99]) and is_still(sink.outputs[-1]) and len(sink.outputs) < 115


@pytest.mark.parametrize("of_frames", [True, False])
@pytest.mark.parametrize("apart", [0.05, 0.25])
def test_what_comes_too_seldom_is_told(clock: Clock, apart: float, of_frames: bool) -> None:
    class Slow(NamedSource):
        """Somebody who is seen, and a button that is held, now and then; and released at last."""

        has_heartbeat, sent = not of_frames, 0

        def read(self, inbox: Inbox, now: float) -> bool:
            if (now - 100.0) / apart > self.sent:
                self.sent += 1
                inbox.offer(message(2 * self.sent, time=now), "a", now)
                if not of_frames:
                    inbox.offer(beat(2 * self.sent + 1, held=now < 103.0, time=now), "a", now)
            return now < 104.0

    session = loop.run(random_robot(0), [Slow()], [Kept()], LiveConfig(ramp_time=0.0))
    told = session.summary().split("\n")[-1]
    if apart < LiveConfig().heartbeat_timeout:
        assert "silence" not in session.summary()
        return
    count = 16 if of_frames else 11  # none while it is not held
    assert re.match(rf"stopped for silence: {count} times, as a \w+ came 0.25 s after the last, .* is 0.1 s; ", told), (
        told
    )
    assert ("a button" in told) == of_frames and "heartbeat_timeout=0.18 stop_time=0.3" in told


def test_it_ends_after_some_time(clock: Clock, replay: ReplaySource) -> None:
    sink = Kept()
    loop.run(make_robot(), [replay], [sink], LiveConfig(), seconds=0.5)
    assert 30 <= len(sink.outputs) <= 33


def test_a_sink_that_waits_is_told_and_moves_nothing(clock: Clock, replay: ReplaySource) -> None:
    class Waiting(Kept):
        def send(self, output: Output) -> None:
            super().send(output)
            clock.sleep(0.5)

    sink, config = Waiting(), LiveConfig()
    session = loop.run(random_robot(0), [replay], [sink], config, seconds=4)
    assert not any(np.abs(output.velocity_N).max() for output in sink.outputs)
    assert session.summary().endswith("a sink waits") and f"held up: {len(sink.outputs) - 1} times" in session.summary()
    assert "held up" not in loop.run(random_robot(0), [replay], [Kept()], config, seconds=1).summary()


def test_what_cannot_be_opened_leaves_nothing_open(replay: ReplaySource, tmp_path: Path) -> None:
    first, second = UdpSource(Endpoint("127.0.0.1", 0)), Kept()
    first.open()
    with pytest.raises(UserError, match="cannot listen"):
        loop.run(make_robot(), [replay, UdpSource(first.endpoint)], [second])
    first.close()
    assert second.closed == 1 and not second.outputs


# Sockets and files


def test_udp_from_end_to_end() -> None:
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("127.0.0.1", 0))
    receiver.settimeout(30)
    source, sink = UdpSource(Endpoint("127.0.0.1", 0)), UdpSink(Endpoint(*receiver.getsockname()))
    session = Session.of(make_robot(lambda pose, time: UPPER), [source], [sink], AT_ONCE)
    session.open()
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        for step in range(8):
            now = step * PERIOD
            for data in (beat(step, now), message(step, time=now), message(step, time=now), b"\xff\x00garbage"):
                sender.sendto(data, (source.endpoint.host, source.endpoint.port))
            session.step(now)
        told = [json.loads(receiver.recv(65_536)) for _ in range(8)]
    finally:
        session.close()
        sender.close()
        receiver.close()
    assert [one["number"] for one in told] == list(range(1, 9)) and {one["mrhubo"] for one in told} == {1}
    assert (
        told[-1]["names"] == list(NAMES)
        and told[-1]["state"] == "following"
        and told[-1]["confidence"] == {"left": 1, "right": 1}
    )
    assert told[-1]["angles"][0] > told[0]["angles"][0] and told[-1]["velocities"][0] > 0
    assert told[-1]["stop"]["angles"][0] > told[-1]["angles"][0] and 0 < told[-1]["stop"]["in"] <= 0.1
    assert session.counts["malformed"] == session.counts["repeated"] == 8


def test_udp_with_a_token(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(TOKEN_VARIABLE, "a-secret-of-some-length")
    source, inbox = UdpSource(Endpoint("0.0.0.0", 0)), Inbox(0.25)
    source.open()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for data in (
            beat(0),
            b"[" * 9_000,
            beat(1)[:-1] + b', "token": "a-secret-of-some-lengtH"}',
            beat(2)[:-1] + b', "token": "a-secret-of-some-length"}',
        ):
            sender.sendto(data, ("127.0.0.1", source.endpoint.port))
        source.read(inbox, 0.0)
    source.close()
    assert inbox.counts["token"] == 3 and inbox.counts["heartbeats"] == 1 and inbox.held


@pytest.mark.parametrize("ending", ["npz", "csv"])
def test_a_file_of_the_session(tmp_path: Path, ending: str) -> None:
    path = tmp_path / "new" / f"session.{ending}"
    session = Session.of(
        make_robot(lambda pose, time: UPPER), [], [FileSink(path)], LiveConfig(ramp_time=0.0, deadman="frames")
    )
    session.open()
    sent = []
    for step in range(20):
        session.pilot.inbox.offer(message(step, time=step * PERIOD), "a", step * PERIOD)
        session.step(step * PERIOD)
        assert session.last is not None
        sent.append(session.last.q_N)
    assert not path.exists()
    session.close()
    session.close()
    found = mrhubo.read_robot_motion(path)
    assert (
        np.allclose(found.q, sent, atol=1e-6) and found.frame_rate == pytest.approx(60) and found.joint_names == NAMES
    )
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_a_file_that_cannot_be_is_refused_before_anything_moves(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="must end in"):
        FileSink(tmp_path / "session.txt")
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot be written"):
        FileSink(tmp_path / "file" / "session.npz").open(make_robot(), LiveConfig())


def test_a_replay_gives_the_newest_frame_that_is_due(replay: ReplaySource) -> None:
    inbox = Inbox(0.25)
    replay.open()
    assert replay.read(inbox, 5.0) and replay.read(inbox, 5.0) and inbox.counts["frames"] == 1
    assert replay.read(inbox, 5.5) and inbox.counts["frames"] == 2 and inbox.counts["repeated"] == 0
    seen = inbox.take_frame()
    assert np.array_equal(seen.local_J33, replay._local_TJ33[30])  # pyright: ignore
    assert not replay.read(inbox, 500.0)
    replay._loop = True
    assert replay.read(inbox, 500.0)
