"""Robot motions as ROS 2 bags: MCAP files with a trajectory_msgs/msg/JointTrajectory (`mrhubo.robot_motion.ros2`).

The bag is what `ros2 bag play` takes (https://mcap.dev/spec and /spec/registry#ros2). The trajectory is one message at
time 0. No standard message tells of a base and its feet over time, so they are messages at the times of their frames: a
geometry_msgs/msg/PoseStamped on `/base_pose`, and a std_msgs/msg/Bool for each foot on `/contact/FOOT`.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from mrhubo.errors import InputWarning, UserError, first_line, shortened
from mrhubo.files.atomic import atomic_path
from mrhubo.files.regular import check_regular, open_regular
from mrhubo.lazy import import_optional
from mrhubo.robot_motion.motion import RobotMotion
from mrhubo.robot_motion.ros2 import SECOND, from_points, points_of

TOPIC = "/joint_trajectory"
BASE_TOPIC, _CONTACT = "/base_pose", "/contact/"
_TYPE, POSE, BOOL = "trajectory_msgs/msg/JointTrajectory", "geometry_msgs/msg/PoseStamped", "std_msgs/msg/Bool"
_RULE = "=" * 80
_HEADER = f"""\
{_RULE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
DEFINITIONS = {
    _TYPE: f"""\
std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint[] points
{_HEADER}{_RULE}
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
{_RULE}
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
""",
    POSE: f"""\
std_msgs/Header header
geometry_msgs/Pose pose
{_HEADER}{_RULE}
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
{_RULE}
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
{_RULE}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
""",
    BOOL: "bool data\n",
}
"""The messages that are written and read, by type."""
_MAX_BAG = 2**30
_MAX_CHUNK = 2**30
_CHUNK = 8_192
"""Bytes that are written together. The index in memory has an entry for each such piece, so none for each message."""
_MOMENTS, _POINTS_OF_A_MOMENT = 2, 2
"""So many messages or more, of so many points, are a live session's."""
_MOST_FEET = 16
"""That contacts are read of."""
_BOOL_BYTES = 5
"""Of such a message: four say how it is encoded."""


def write_mcap(motion: RobotMotion, path: Path) -> None:
    """Writes a bag with the message at time 0 of the topic `/joint_trajectory`, atomically.

    Raises:
        UserError: the frame rate is not known, or mcap-ros2-support is not installed.
    """
    import_mcap()
    points = [
        {"positions": positions, "velocities": [], "accelerations": [], "effort": [],
         "time_from_start": {"sec": sec, "nanosec": nanosec}}
        for sec, nanosec, positions in points_of(motion, path)
    ]  # fmt: skip
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    message = {"header": header, "joint_names": list(motion.joint_names), "points": points}
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        bag = JointTrajectoryBag(file)
        bag.write(TOPIC, message, 0.0)
        for time, topic, kind, content in _beside(motion.single(), points):
            bag.write(topic, content, time, kind)
        bag.finish()


def _beside(motion: RobotMotion, points: list[dict[str, Any]]) -> Iterator[tuple[float, str, str, dict[str, Any]]]:
    """Where the base is and which feet are planted: time [s], topic, type and message, frame after frame."""
    topics = contact_topics(motion.contact_names)
    for frame, point in enumerate(points):
        stamp = point["time_from_start"]
        time = stamp["sec"] + stamp["nanosec"] / SECOND
        if motion.root_position is not None and motion.root_quaternion_wxyz is not None:
            place, turn = motion.root_position[frame], motion.root_quaternion_wxyz[frame]
            yield time, BASE_TOPIC, POSE, pose_message(place, turn, stamp)
        for foot, topic in enumerate(topics):
            assert motion.contact is not None
            yield time, topic, BOOL, {"data": bool(motion.contact[frame, foot])}


def contact_topics(names: Sequence[str]) -> list[str]:
    """The topic of each foot."""
    topics: list[str] = []
    for name in names:
        token = re.sub(r"\W", "_", name, flags=re.ASCII)
        topic = _CONTACT + (f"_{token}" if token[:1].isdigit() else token)  # ROS 2 has no name that begins so
        topics.append(topic if topic not in topics else f"{topic}_{len(topics)}")
    return topics


def pose_message(position_3: np.ndarray, quaternion_wxyz_4: np.ndarray, stamp: Mapping[str, int]) -> dict[str, Any]:
    """A PoseStamped of a base [m] in the frame `world`; `stamp`: `sec` and `nanosec`."""
    (x, y, z), (qw, qx, qy, qz) = position_3.tolist(), quaternion_wxyz_4.tolist()
    pose = {"position": {"x": x, "y": y, "z": z}, "orientation": {"x": qx, "y": qy, "z": qz, "w": qw}}
    return {"header": {"stamp": dict(stamp), "frame_id": "world"}, "pose": pose}


class JointTrajectoryBag:
    """An MCAP file of JointTrajectory messages, which are handed to the system some ten at a time: if the process is
    killed, all but the last of them can be read.
    """

    def __init__(self, file: BinaryIO) -> None:
        """`file`: to write to. Raises a UserError where mcap-ros2-support is not installed."""
        self._file = file
        compression = _import("mcap.writer").CompressionType.NONE
        self._writer = _import("mcap_ros2.writer").Writer(file, chunk_size=_CHUNK, compression=compression)
        self._schemas: dict[str, Any] = {}

    def write(self, topic: str, message: Mapping[str, Any], time: float, kind: str = _TYPE) -> None:
        """One message as nested dictionaries, at a time [s], of a type in `DEFINITIONS`."""
        at = round(time * SECOND)
        if kind not in self._schemas:
            self._schemas[kind] = self._writer.register_msgdef(kind, DEFINITIONS[kind])
        self._writer.write_message(topic, self._schemas[kind], message, log_time=at, publish_time=at)
        self._file.flush()

    def finish(self) -> None:
        """Writes the index."""
        self._writer.finish()


def read_mcap(path: Path) -> RobotMotion:
    """The motion of the first JointTrajectory in a bag, with base and contacts where there is one of each a frame; of
    the bag of a live session, in which each JointTrajectory tells one moment, that of all.

    Raises:
        UserError: the file is missing, damaged, too large, holds no such message, or mcap-ros2-support is not
            installed.
    """
    decode = {kind: _decoder(kind) for kind in (_TYPE, POSE)}
    messages: list[Any] = []
    poses: list[np.ndarray] = []
    contacts: dict[str, list[bool]] = {}
    is_over, most = False, 0
    try:
        for kind, topic, data in _messages(path):
            if kind == _TYPE and not is_over:
                message = decode[_TYPE](data)
                is_over = not _is_moment(message, messages)
                if not is_over:
                    messages.append(message)
                    most = max(most, len(message.points), len(messages))
            elif kind == POSE and topic == BASE_TOPIC and len(poses) < most:
                pose = decode[POSE](data).pose
                at, turn = pose.position, pose.orientation
                poses.append(np.array([at.x, at.y, at.z, turn.w, turn.x, turn.y, turn.z]))
            elif kind == BOOL and topic.startswith(_CONTACT) and len(data) == _BOOL_BYTES:
                name = topic.removeprefix(_CONTACT)
                told = contacts.setdefault(name, []) if name in contacts or len(contacts) < _MOST_FEET else []
                if len(told) < most:
                    told.append(data[-1] != 0)
    except UserError:
        raise
    except Exception as error:  # whatever mcap makes of a stranger's bytes
        if len(messages) < _MOMENTS and not is_over:
            raise UserError(f"{path}: cannot be read as MCAP: {shortened(first_line(error), 200)}") from error
        if not is_over:
            warnings.warn(f"{path}: ends early; {len(messages)} moments of it are whole", InputWarning, stacklevel=2)
    if not messages:
        raise UserError(f"{path}: holds no message of type {_TYPE}")
    first = messages[0]
    if len(messages) < _MOMENTS:
        points = [(p.time_from_start, p.positions) for p in first.points]
    else:
        whole = _whole(len(messages), [poses, *contacts.values()])
        messages, poses = messages[:whole], poses[:whole]
        contacts = {name: told[:whole] for name, told in contacts.items()}
        points = [(message.header.stamp, message.points[0].positions) for message in messages]
    more: dict[str, Any] = {}
    if len(poses) == len(points) > 0:
        more = {"root_position": np.stack(poses)[:, :3], "root_quaternion_wxyz": np.stack(poses)[:, 3:]}
    feet = [name for name, told in contacts.items() if name and len(told) == len(points) > 0]
    if feet:
        more |= {"contact": np.stack([contacts[name] for name in feet], axis=1), "contact_names": feet}
    times = [(stamp.sec, stamp.nanosec) for stamp, _ in points]
    return from_points(path, list(first.joint_names), times, [list(positions) for _, positions in points], more)


def _whole(moments: int, beside: Sequence[Sequence[Any]]) -> int:
    """How many moments of a session are there with all that is told beside them: of one that ended early, the last may
    lack some.
    """
    return min([moments, *(len(told) for told in beside if len(told) == moments - 1 > 0)])


def _decoder(kind: str) -> Any:
    """What makes messages of a type of bytes: by our definition, not the file's, so that nothing in a stranger's bag is
    taken for a program.
    """
    schema = _import("mcap.records").Schema(id=1, name=kind, encoding="ros2msg", data=DEFINITIONS[kind].encode())
    return _import("mcap_ros2.decoder").DecoderFactory().decoder_for("cdr", schema)


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


def _messages(path: Path) -> Iterator[tuple[str, str, bytes]]:
    """The messages of types that are read, as they come: type, topic, bytes."""
    stream, records = _import("mcap.stream_reader"), _import("mcap.records")
    schemas: dict[int, str] = {}
    channels: dict[int, tuple[str, str]] = {}
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
                if isinstance(found, records.Schema) and found.name in DEFINITIONS:
                    schemas[found.id] = found.name
                elif isinstance(found, records.Channel):
                    if found.schema_id in schemas and found.message_encoding == "cdr":
                        channels[found.id] = schemas[found.schema_id], found.topic
                elif isinstance(found, records.Message) and found.channel_id in channels:
                    yield *channels[found.channel_id], found.data


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
