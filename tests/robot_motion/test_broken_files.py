"""Readers of robot motions take any bytes: they give a motion or one sentence, and execute nothing."""

from __future__ import annotations

import io
import json
import pickle
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings

from mrhubo.errors import UserError
from mrhubo.robot_motion import FORMATS, RobotMotion, read_robot_motion, write_robot_motion
from tests.files.bounded import bounded
from tests.motion.damage import Step, accidents, damaged
from tests.robot_motion.motions import plain

FILES = [name for name, row in FORMATS.items() if row.ending]


def read(path: Path) -> RobotMotion:
    return read_robot_motion(path, plain().joint_names, 30.0)


def robot_motion_read_or_refused(path: Path) -> None:
    """Either a motion of finite angles, or a sentence that names the file."""
    try:
        found = read(path)
    except UserError as error:
        assert str(path) in str(error) and "\n" not in str(error) and len(str(error)) < 1_000
    else:
        assert np.isfinite(found.q).all()


@pytest.fixture(params=FILES)
def good(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    if request.param == "mcap":
        pytest.importorskip("mcap_ros2", reason="the extra `ros` is not installed")
    path = tmp_path / f"good{FORMATS[request.param].ending}"
    write_robot_motion(plain(), path, request.param)
    return path


@settings(max_examples=16, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(steps=accidents)
@example(steps=[("repeat", 81, b"")])  # a bag whose field names claim more bytes than the file has
def test_damage_is_noticed_or_does_not_matter(good: Path, steps: list[Step]) -> None:
    path = good.with_name("bad")
    path.write_bytes(damaged(good.read_bytes(), steps))
    with bounded(megabytes=200, seconds=10):
        robot_motion_read_or_refused(path)


def json_with(**changes: Any) -> bytes:
    return json.dumps({"joint_names": ["a"], "q": [[0.5]], **changes}).encode()


def npz_with(**arrays: Any) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **({"q": np.zeros((1, 1)), "joint_names": np.array(["a"])} | arrays))
    return buffer.getvalue()


class Hostile:
    """A pickle of it would write a file."""

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return (Path("executed").write_text, ("",))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is no robot motion; expected one of: csv, gmr, json"),
        (b"\0\1\2\3", "is no robot motion"),
        (b"hello\n", "is no robot motion"),
        (pickle.dumps(Hostile()), "nothing was run"),
        (npz_with(q=np.array([[Hostile()]], object)), "pickled Python objects"),
        (npz_with(unit=np.array("deg")), "its unit is 'deg'; expected joint angles in 'rad'"),
        (npz_with(frame_rate=np.array([30.0, 30.0])), r"'frame_rate' has shape \(2,\)"),
        (npz_with(joint_names=np.array(["a", "b"])), r"q has shape \(1, 1\); expected \(1, 2\)"),
        (npz_with(q=np.array([[np.nan]])), "q holds NaN"),
        (npz_with(lower_rad=np.array(["x"])), "'lower_rad' has type"),
        (npz_with(other_names=np.array(["b"])), "different lengths"),
        (json_with(q=[[1.0], [1.0, 2.0]]), "'q' holds no array of numbers"),
        (json_with(q="x"), "'q' holds no array of numbers"),
        (json_with(joint_names="a"), "'joint_names' holds a, which is not what belongs there"),
        (json_with(frame_rate="30"), "'frame_rate' holds 30"),
        (json_with(frame_rate=10**400), "frame_rate must be a positive number"),
        (b'{"q": ' + b"[" * 100_000, "is no JSON: RecursionError"),
        (b'{"joint_names": ["a"]}', "'q' is missing"),
        (b"time [s],a\n0,1\n", "no column is named 'JOINT \\[rad\\]'"),
        (b"time [s],a [rad]\n", "holds no frames"),
        (b"time [s],a [rad]\n0,x\n", "is no table of numbers"),
        (b"time [s],a [rad]\n0,1,2\n", "its header names 2 columns, its rows have 3"),
        (b"time [s],a [rad]\n0,1\n1,1\n5,1\n", "do not rise evenly"),
        (b"time [s],a [rad]\n1,1\n0,1\n", "do not rise evenly"),
        (b"a [rad],a [rad]\n0,1\n", r"its header has 'a \[rad\]' twice"),
        (b"a [rad],\xff\n", "is no text"),
        (b"a [rad],b\rc\n1,2\n", "its header is none of a table"),
        (b"joint_names: &a [x]\npoints: *a\n", "has YAML aliases"),
        (b"joint_names: !!python/object/apply:os.system ['touch executed']\n", "is no YAML"),
        (b"joint_names: [a]\npoints: [1]\n", "is no JointTrajectory"),
        (b"joint_names: [a]\npoints: []\n", "its trajectory has no point"),
        (b"PAR1" + b"\0" * 20, "cannot be read as Parquet"),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "bad"
    path.write_bytes(content)
    with pytest.raises(UserError, match=message), bounded(megabytes=50, seconds=5):
        read_robot_motion(path)
    assert not (tmp_path / "executed").exists()


def test_a_missing_file_and_a_folder_are_told_apart(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="there is no such file"):
        read_robot_motion(tmp_path / "a.npz")
    with pytest.raises(UserError, match="info.json: there is no such file"):
        read_robot_motion(tmp_path)


def test_a_bag_whose_chunk_claims_much_is_not_unpacked(tmp_path: Path) -> None:
    pytest.importorskip("mcap_ros2", reason="the extra `ros` is not installed")
    packed = zlib.compress(b"")
    chunk = struct.pack("<QQQI", 0, 0, 2**40, 0) + struct.pack("<I", 4) + b"zstd"
    chunk += struct.pack("<Q", len(packed)) + packed
    header = struct.pack("<I", 4) + b"ros2" + struct.pack("<I", 0)
    content = b"\x89MCAP0\r\n" + b"\x01" + struct.pack("<Q", len(header)) + header
    (tmp_path / "a.mcap").write_bytes(content + b"\x06" + struct.pack("<Q", len(chunk)) + chunk)
    with pytest.raises(UserError, match="to an extent, that is not read"), bounded(megabytes=50, seconds=5):
        read_robot_motion(tmp_path / "a.mcap")
