"""Robot motions as ROS 2's trajectory_msgs/msg/JointTrajectory: one message, as YAML or in an MCAP bag.

The message: https://docs.ros.org/en/rolling/p/trajectory_msgs/ (joint_names; points of positions [rad] and
time_from_start). As YAML it is what `ros2 topic pub --once TOPIC trajectory_msgs/msg/JointTrajectory "$(cat FILE)"`
takes; the bag is what `ros2 bag play` takes. MCAP: https://mcap.dev/spec and /spec/registry#ros2.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from mrhubo.errors import InputWarning, UserError, first_line, shortened
from mrhubo.files.atomic import atomic_path
from mrhubo.files.regular import check_regular, open_regular
from mrhubo.lazy import import_optional
from mrhubo.robot_motion.clock import find_rate, nanoseconds
from mrhubo.robot_motion.motion import RobotMotion
from mrhubo.robot_motion.plain import build, short
from mrhubo.robot_motion.tables import read_text

TOPIC = "/joint_trajectory"
_TYPE = "trajectory_msgs/msg/JointTrajectory"
_DEFINITION = """\
std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint[] points
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
================================================================================
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
"""
_SECOND = 1_000_000_000
_MAX_BAG = 2**30
_MAX_CHUNK = 2**30
_CHUNK = 8_192
"""Bytes that are written together. The index in memory has an entry for each such piece, so none for each message."""
_MOMENTS, _POINTS_OF_A_MOMENT = 2, 2
"""So many messages or more, of so many points, are a live session's."""


def write_yaml(motion: RobotMotion, path: Path) -> None:
    """Writes the message as YAML, atomically.

    Raises:
        UserError: the frame rate is not known.
    """
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8") as file:
        file.writelines(_yaml(motion, path))


def _yaml(motion: RobotMotion, path: Path) -> Iterator[str]:
    """The message's lines. A library's dumper takes a minute for what these take a second for."""
    points = _points(motion, path)
    yield "header: {stamp: {sec: 0, nanosec: 0}, frame_id: ''}\n"
    yield f"joint_names: {json.dumps(motion.joint_names, ensure_ascii=False)}\n"  # JSON's strings are YAML's
    yield "points:\n" if points else "points: []\n"
    for sec, nanosec, positions in points:
        yield f"- positions: {positions}\n  time_from_start: {{sec: {sec}, nanosec: {nanosec}}}\n"


def _points(motion: RobotMotion, path: Path) -> list[tuple[int, int, list[float]]]:
    """Seconds, nanoseconds and angles of every frame."""
    motion = motion.single()
    if motion.frame_rate is None:
        raise UserError(
            f"{path}: a trajectory tells the time of every point, and the motion has no frame rate; give one"
        )
    passed_T = nanoseconds(np.arange(motion.frames), motion.frame_rate)
    return [(int(t) // _SECOND, int(t) % _SECOND, row) for t, row in zip(passed_T, short(motion.q), strict=True)]


def read_yaml(path: Path) -> RobotMotion:
    """A motion from such a message as YAML.

    Raises:
        UserError: the file is missing, too large, no YAML, or another message.
    """
    import yaml

    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    text = read_text(path)
    try:
        # An alias makes much of little: ten lines of them unpack to gigabytes.
        if any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(text, Loader=loader)):
            raise UserError(f"{path}: has YAML aliases, which no trajectory needs")
        message = yaml.load(text, Loader=loader)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise UserError(f"{path}: is no YAML: {shortened(first_line(error), 200)}") from error
    try:
        points = [(p["time_from_start"], p["positions"]) for p in message["points"]]
        times = [(stamp["sec"], stamp["nanosec"]) for stamp, _ in points]
        return _from_points(path, message["joint_names"], times, [positions for _, positions in points])
    except (KeyError, TypeError) as error:
        raise UserError(f"{path}: is no JointTrajectory: expected joint_names, and points of positions and "
                        "time_from_start") from error  # fmt: skip


def _from_points(path: Path, names: Any, times: Any, positions: Any) -> RobotMotion:
    """A motion of what a message holds."""
    try:
        q = np.array(positions, np.float64)
        time_T = np.array([int(sec) * _SECOND + int(nanosec) for sec, nanosec in times], np.int64)
        if q.ndim != 2 or not isinstance(names, list):
            raise ValueError
    except Exception as error:
        raise UserError(f"{path}: its trajectory has no point, or some without a position for every joint") from error
    try:
        rate = find_rate(time_T, nanoseconds)
    except UserError as error:
        raise UserError(f"{path}: {error}") from error
    facts = {"joint_names": names}
    return build(facts if rate is None else {**facts, "frame_rate": rate}, {"q": q}, path)


def write_mcap(motion: RobotMotion, path: Path) -> None:
    """Writes a bag with the message at time 0 of the topic `/joint_trajectory`, atomically.

    Raises:
        UserError: the frame rate is not known, or mcap-ros2-support is not installed.
    """
    import_mcap()
    points = [
        {"positions": positions, "velocities": [], "accelerations": [], "effort": [],
         "time_from_start": {"sec": sec, "nanosec": nanosec}}
        for sec, nanosec, positions in _points(motion, path)
    ]  # fmt: skip
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    message = {"header": header, "joint_names": list(motion.joint_names), "points": points}
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        bag = JointTrajectoryBag(file)
        bag.write(TOPIC, message, 0.0)
        bag.finish()


class JointTrajectoryBag:
    """An MCAP file of JointTrajectory messages, which are handed to the system some ten at a time: if the process is
    killed, all but the last of them can be read.
    """

    def __init__(self, file: BinaryIO) -> None:
        """`file`: to write to. Raises a UserError where mcap-ros2-support is not installed."""
        self._file = file
        compression = _import("mcap.writer").CompressionType.NONE
        self._writer = _import("mcap_ros2.writer").Writer(file, chunk_size=_CHUNK, compression=compression)
        self._schema = self._writer.register_msgdef(_TYPE, _DEFINITION)

    def write(self, topic: str, message: dict[str, Any], time: float) -> None:
        """One message as nested dictionaries, at a time [s]."""
        at = round(time * _SECOND)
        self._writer.write_message(topic, self._schema, message, log_time=at, publish_time=at)
        self._file.flush()

    def finish(self) -> None:
        """Writes the index."""
        self._writer.finish()


def read_mcap(path: Path) -> RobotMotion:
    """The motion of the first JointTrajectory in a bag; of the bag of a live session, in which each tells one moment,
    that of all.

    Raises:
        UserError: the file is missing, damaged, too large, holds no such message, or mcap-ros2-support is not
            installed.
    """
    decoder, records = _import("mcap_ros2.decoder"), _import("mcap.records")
    # Our definition of the message, not the file's: nothing in a stranger's bag is taken for a program.
    ours = records.Schema(id=1, name=_TYPE, encoding="ros2msg", data=_DEFINITION.encode())
    decode = decoder.DecoderFactory().decoder_for("cdr", ours)
    messages: list[Any] = []
    try:
        for data in _trajectories(path, records):
            message = decode(data)
            if not _is_moment(message, messages):
                break
            messages.append(message)
    except UserError:
        raise
    except Exception as error:  # whatever mcap makes of a stranger's bytes
        if len(messages) < _MOMENTS:
            raise UserError(f"{path}: cannot be read as MCAP: {shortened(first_line(error), 200)}") from error
        warnings.warn(f"{path}: ends early; {len(messages)} moments of it are whole", InputWarning, stacklevel=2)
    if not messages:
        raise UserError(f"{path}: holds no message of type {_TYPE}")
    first = messages[0]
    if len(messages) < _MOMENTS:
        points = [(p.time_from_start, p.positions) for p in first.points]
    else:
        points = [(message.header.stamp, message.points[0].positions) for message in messages]
    times = [(stamp.sec, stamp.nanosec) for stamp, _ in points]
    return _from_points(path, list(first.joint_names), times, [list(positions) for _, positions in points])


def _is_moment(message: Any, before: list[Any]) -> bool:
    """Whether a message goes on with those before it: the same joints, a later stamp, and where one of them is in a
    period and where it would stop, as `mrhubo.live` writes them. The first always does.
    """
    if not before:
        return True
    last = before[-1]
    is_short = all(len(one.points) == _POINTS_OF_A_MOMENT for one in (before[0], message))
    stamps = [(one.header.stamp.sec, one.header.stamp.nanosec) for one in (last, message)]
    return is_short and stamps[0] < stamps[1] and list(message.joint_names) == list(last.joint_names)


def _trajectories(path: Path, records: Any) -> Iterator[bytes]:
    """The JointTrajectory messages of a bag, as bytes."""
    stream = _import("mcap.stream_reader")
    schemas, channels = set(), set()
    size = check_regular(path, _MAX_BAG)
    with open_regular(path, _MAX_BAG) as file:
        reader = stream.StreamReader(_Sparing(file, size), emit_chunks=True, record_size_limit=size)
        for record in reader.records:
            inner = [record]
            if isinstance(record, records.Chunk):
                if record.compression not in ("", "zstd") or record.uncompressed_size > _MAX_CHUNK:
                    raise UserError(f"{path}: is compressed in a way, or to an extent, that is not read; expected zstd")
                inner = stream.breakup_chunk(record)
            for found in inner:
                if isinstance(found, records.Schema) and found.name == _TYPE:
                    schemas.add(found.id)
                elif (
                    isinstance(found, records.Channel)
                    and found.schema_id in schemas
                    and found.message_encoding == "cdr"
                ):
                    channels.add(found.id)
                elif isinstance(found, records.Message) and found.channel_id in channels:
                    yield found.data


class _Sparing:
    """A file of which never more is asked than it has left: records, and texts and arrays in them, claim any length,
    and as much memory would be made.
    """

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file, self._left = file, size

    def read(self, count: int) -> bytes:
        content = self._file.read(min(count, self._left))
        self._left -= len(content)
        return content


def import_mcap() -> None:
    """UserError where mcap-ros2-support is not installed."""
    _import("mcap_ros2.writer")


def _import(name: str) -> Any:
    return import_optional(name, "MCAP bags need mcap-ros2-support: pip install 'mrhubo[ros]'")
