"""From a message of landmarks to joint angles that are sent: how long it takes, and what a long stream does.

    python benchmarks/live.py PACKAGE [--motion FILE] [--frames 2000] [--minutes 30] [--form FORM]

PACKAGE is the folder of a trained retargeter, or the name of a robot, which the universal network then answers. A
sender on this machine sends the 33 points of MediaPipe that a person of our skeleton has, with a centimetre of noise,
as JSON in UDP datagrams, and is sent joint angles back; all of it on one thread, on 127.0.0.1. To a robot with legs,
which tells where its base is, they are sent as they lie in the world, of a MOTION that tells where the person goes, and
that is played forwards and backwards in turn. Times are from before the datagram is read to after the answer is sent:
of the clock, and the thread's own, to which other programs add little; and each frame's least of some passes of the
same motion, to which a machine that is slow for moments adds little. The long stream has 60 frames a second, of which
1% are lost and 1% are garbage; its clock is simulated, so that half an hour takes some minutes, and all that is
measured is the program's own code. Its dead-man is held throughout.
"""

from __future__ import annotations

import argparse
import json
import socket
import time
from pathlib import Path

import numpy as np
import psutil
from common import print_header, print_table

from mrhubo.body.joints import KEYPOINT_NAMES
from mrhubo.body.skeleton import Skeleton
from mrhubo.config.live import LiveConfig
from mrhubo.live.endpoints import Endpoint
from mrhubo.live.loop import Session
from mrhubo.live.messages import VERSION
from mrhubo.live.robot import LiveRobot
from mrhubo.live.sinks.udp import UdpSink
from mrhubo.live.sources.udp import UdpSource
from mrhubo.motion import read_motion
from mrhubo.motion.orientations import HEAD_POINTS
from mrhubo.motion.readers.keypoint_sets import SETS
from mrhubo.runtime.threads import use_threads

_NOISE = 0.01
_RATE = 60.0
_PASSES = 5
_SHARE = 0.01
_MINUTE = 60.0
_SLACK = 1e-6
_FASTEST_BASE = 5.0
"""No base of a robot that walks goes faster [m/s]."""


def landmarks(file: Path, in_world: bool = False) -> list[str]:
    """A motion as MediaPipe's points, each frame as the text of a JSON list; in the world, where the root has them, and
    forwards and backwards, so that nobody leaps.
    """
    motion = read_motion(file)
    point_TK3, turn_TJ33 = Skeleton().keypoints_and_rotations(motion.local_TJ33)
    place = dict(zip(KEYPOINT_NAMES, point_TK3.numpy().transpose(1, 0, 2), strict=True))
    head_T33 = turn_TJ33[:, KEYPOINT_NAMES.index("head")].numpy()
    place |= {name: place["head"] + head_T33 @ np.array(offset) for name, offset in HEAD_POINTS.items()}
    nothing_T3 = np.zeros((len(motion), 3))
    if in_world:
        arrays = motion.arrays
        if arrays.root_rotation_T33 is None or arrays.root_position_T3 is None:
            raise SystemExit(f"{file}: does not tell where the person goes; give another one with --motion")
        turn_T33, at_T3 = arrays.root_rotation_T33, arrays.root_position_T3
        place = {n: (turn_T33 @ p_T3[..., None])[..., 0] + at_T3 for n, p_T3 in place.items()}
    rows_KT3 = np.stack([place.get(name, nothing_T3) for name in SETS["MediaPipe"]])
    noise_KT3 = np.random.default_rng(0).normal(0.0, _NOISE, rows_KT3.shape)
    rows_TK3 = ((rows_KT3 + noise_KT3) * [1.0, -1.0, -1.0]).transpose(1, 0, 2)
    told = [json.dumps(rows_K3.round(4).tolist()) for rows_K3 in rows_TK3]
    return told + told[::-1] if in_world else told


class Link:
    """A session, and a sender that is the receiver too."""

    def __init__(self, robot: LiveRobot, points: list[str]) -> None:
        self.points, self.number = points, 0
        self.world = "true" if robot.standing is not None else "false"
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(1.0)
        self.source = UdpSource(Endpoint("127.0.0.1", 0))
        config = LiveConfig(rate=_RATE)
        self.session = Session.of(robot, [self.source], [UdpSink(Endpoint(*self.socket.getsockname()))], config)
        self.session.open()
        self._to = (self.source.endpoint.host, self.source.endpoint.port)

    def send(self, kind: str, now: float, more: str) -> None:
        """One message."""
        self.number += 1
        head = f'{{"mrhubo":{VERSION},"session":"b","number":{self.number},"time":{now},"kind":"{kind}",{more}}}'
        self.socket.sendto(head.encode(), self._to)

    def send_frame(self, frame: int, now: float) -> None:
        """The landmarks of a frame."""
        points = self.points[frame % len(self.points)]
        self.send(
            "landmarks", now, f'"set":"mediapipe","world":{self.world},"points":{points},"visibility":{[0.99] * 33}'
        )

    def beat(self, now: float) -> None:
        """The button is held."""
        self.send("heartbeat", now, '"held":true')

    def close(self) -> None:
        """Ends both."""
        self.session.close()
        self.socket.close()


def measure_frames(link: Link, frames: int) -> tuple[np.ndarray, np.ndarray]:
    """Times of single frames (T,) [ms], by the clock and the thread's own, but for the first tenth."""
    wall, own = [], []
    for frame in range(frames):
        now = frame / _RATE
        link.beat(now)
        link.send_frame(frame, now)
        begun, begun_own = time.perf_counter(), time.thread_time()
        link.session.step(now)
        own.append(1e3 * (time.thread_time() - begun_own))
        wall.append(1e3 * (time.perf_counter() - begun))
        link.socket.recv(65_536)
    return np.array(wall[frames // 10 :]), np.array(own[frames // 10 :])


def shown(times: np.ndarray) -> list[str]:
    """Percentiles of times [ms], and the longest."""
    return [f"{value:.2f}" for value in (*np.percentile(times, (50, 90, 99)), times.max())]


class Soak:
    """A long stream, minute by minute."""

    def __init__(self, link: Link) -> None:
        self.link, self.random = link, np.random.default_rng(1)
        self.frame = self.outside = self.moved = 0
        governor = link.session.pilot.governor
        self.governor, self.last_q = governor, governor.q_N
        self.last_v = np.zeros_like(self.last_q)
        self.last_base: np.ndarray | None = None

    def minute(self) -> list[str]:
        """One minute: time of a step, age of what is followed, memory, and outputs outside limits."""
        ages, took = [], []
        for _ in range(round(_MINUTE * _RATE)):
            now = 1e3 + self.frame / _RATE
            if self.random.random() >= _SHARE:
                self.link.beat(now)
            draw = self.random.random()
            if draw < _SHARE:
                self.link.socket.sendto(self.random.bytes(int(self.random.integers(0, 2_000))), self.link._to)
            elif draw >= 2 * _SHARE:
                self.link.send_frame(self.frame, now)
            begun = time.thread_time()
            self.link.session.step(now)
            took.append(1e3 * (time.thread_time() - begun))
            self.link.socket.recv(65_536)
            ages.append(1e3 * (now - self.link.session.pilot.inbox.frame_at))
            self._check()
            self.frame += 1
        memory = psutil.Process().memory_info().rss / 2**20
        number = f"{self.frame / _RATE / _MINUTE:.0f}"
        return [number, f"{np.median(took):.2f}", f"{np.mean(ages):.2f}", f"{max(ages):.0f}", f"{memory:.1f}",
                str(self.outside)]  # fmt: skip

    def _check(self) -> None:
        """Counts an output outside the limits, by its differences to those before."""
        governor, config = self.governor, self.link.session.pilot.config
        output = self.link.session.last
        assert output is not None
        velocity = (output.q_N - self.last_q) * _RATE
        change = np.abs(velocity - self.last_v) * _RATE
        inside = (output.q_N >= governor.lower_N).all() and (output.q_N <= governor.upper_N).all()
        inside &= bool((np.abs(velocity) <= governor.speed_N + _SLACK).all())
        inside &= bool((change <= config.acceleration + _SLACK).all())
        if output.standing is not None:
            base = output.standing.base.position_3
            goes = 0.0 if self.last_base is None else float(np.linalg.norm(base - self.last_base)) * _RATE
            inside &= goes <= _FASTEST_BASE  # nor NaN
            self.last_base = base
        self.outside += not inside
        self.moved += bool(np.abs(velocity).max() > _SLACK)
        self.last_q, self.last_v = output.q_N, velocity


def main(argv: list[str]) -> None:
    """The benchmark."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("package")
    parser.add_argument("--motion", type=Path, default=Path("data/motions/conversation.npz"))
    parser.add_argument("--frames", type=int, default=2_000)
    parser.add_argument("--minutes", type=int, default=30)
    parser.add_argument("--form", choices=("compiled", "numpy"))
    options = parser.parse_args(argv)
    with use_threads(1):
        print_header()
        make = LiveRobot.of_package if Path(options.package).is_dir() else LiveRobot.of_robot
        robot = make(options.package, LiveConfig(rate=_RATE), options.form)
        points = landmarks(options.motion, robot.standing is not None)
        print("A frame, from its datagram to that of the joint angles [ms]:\n")
        times = []
        for _ in range(_PASSES):
            link = Link(robot, points)
            times.append(measure_frames(link, options.frames))
            link.close()
        wall_PT, own_PT = (np.stack(time) for time in zip(*times, strict=True))
        rows = {"the clock's": wall_PT, "the thread's own": own_PT, f"least of {_PASSES} passes": own_PT.min(axis=0)}
        print_table(["time", "p50", "p90", "p99", "longest"], [[name, *shown(time)] for name, time in rows.items()])
        if options.minutes < 1:
            return
        link = Link(robot, points)
        soak = Soak(link)
        rows = [soak.minute() for _ in range(options.minutes)]
        print(f"\n{options.minutes} minutes at {_RATE:g} frames a second:\n")
        columns = ["minute", "step [ms]", "age [ms]", "oldest [ms]", "memory [MiB]", "outside limits, so far"]
        print_table(columns, rows if len(rows) < 8 else [*rows[:2], *rows[4::5]])
        print(f"\n{link.session.summary()}\nmoved in {soak.moved / soak.frame:.1%} of the periods")
        link.close()


if __name__ == "__main__":
    import sys

    main(sys.argv[1:])
