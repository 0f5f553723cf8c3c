"""Robot motions as ROS 2's trajectory_msgs/msg/JointTrajectory: one message, here as YAML.

The message: https://docs.ros.org/en/rolling/p/trajectory_msgs/ (joint_names; points of positions [rad] and
time_from_start). As YAML it is what `ros2 topic pub --once TOPIC trajectory_msgs/msg/JointTrajectory "$(cat FILE)"`
takes. In a bag: `mrhubo.robot_motion.mcap`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, first_line, shortened
from mrhubo.files.atomic import atomic_path
from mrhubo.robot_motion.clock import find_rate, nanoseconds
from mrhubo.robot_motion.motion import RobotMotion
from mrhubo.robot_motion.plain import blocks, build, short
from mrhubo.robot_motion.tables import read_text

SECOND = 1_000_000_000
"""In nanoseconds."""


def write_yaml(motion: RobotMotion, path: Path, _: object = None) -> tuple[str, ...]:
    """Writes the message as YAML, atomically; returns what such a file cannot tell, a sentence each.

    Raises:
        UserError: the frame rate is not known.
    """
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8") as file:
        file.writelines(_yaml(motion, path))
    lost = motion.root_position is not None
    return ("a JointTrajectory does not tell where the base goes: left out; a bag (mcap) does",) if lost else ()


def _yaml(motion: RobotMotion, path: Path) -> Iterator[str]:
    """The message's lines. A library's dumper takes a minute for what these take a second for."""
    points = points_of(motion, path)
    yield "header: {stamp: {sec: 0, nanosec: 0}, frame_id: ''}\n"
    yield f"joint_names: {json.dumps(motion.joint_names, ensure_ascii=False)}\n"  # JSON's strings are YAML's
    yield "points:\n" if motion.frames else "points: []\n"
    for sec, nanosec, positions in points:
        yield f"- positions: {positions}\n  time_from_start: {{sec: {sec}, nanosec: {nanosec}}}\n"


def points_of(motion: RobotMotion, path: Path) -> Iterator[tuple[int, int, list[float]]]:
    """Seconds, nanoseconds and angles of every frame."""
    motion = motion.single()
    if motion.frame_rate is None:
        raise UserError(
            f"{path}: a trajectory tells the time of every point, and the motion has no frame rate; give one"
        )
    passed_T = nanoseconds(np.arange(motion.frames), motion.frame_rate)
    rows = (row for block in blocks(*motion.q.shape) for row in short(motion.q[block]))
    return ((int(t) // SECOND, int(t) % SECOND, row) for t, row in zip(passed_T, rows, strict=True))


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
        return from_points(path, message["joint_names"], times, [positions for _, positions in points])
    except (KeyError, TypeError) as error:
        raise UserError(f"{path}: is no JointTrajectory: expected joint_names, and points of positions and "
                        "time_from_start") from error  # fmt: skip


def from_points(path: Path, names: Any, times: Any, positions: Any, more: dict[str, Any] | None = None) -> RobotMotion:
    """A motion of what a message holds.

    Args:
        path: the file, for sentences.
        names: of the joints.
        times: seconds and nanoseconds of each point.
        positions: angles [rad] of each point.
        more: further arrays a frame, and `contact_names`, as `mrhubo.robot_motion.plain.build` takes them.

    Raises:
        UserError: they are none.
    """
    try:
        q = np.array(positions, np.float64)
        time_T = np.array([int(sec) * SECOND + int(nanosec) for sec, nanosec in times], np.int64)
        if q.ndim != 2 or not isinstance(names, list):
            raise ValueError
    except Exception as error:
        raise UserError(f"{path}: its trajectory has no point, or some without a position for every joint") from error
    try:
        rate = find_rate(time_T, nanoseconds)
    except UserError as error:
        raise UserError(f"{path}: {error}") from error
    arrays = dict(more or {})
    facts = {"joint_names": names, "contact_names": arrays.pop("contact_names", [])}
    return build(facts if rate is None else {**facts, "frame_rate": rate}, {"q": q, **arrays}, path)
