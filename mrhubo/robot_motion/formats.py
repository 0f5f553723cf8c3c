"""The table of formats that robot motions are written in, and which of them a file is."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mrhubo.errors import UserError, listed, shortened, unknown_name
from mrhubo.files.npz import open_npz
from mrhubo.files.regular import open_regular
from mrhubo.robot_motion.gmr import read_gmr, write_gmr
from mrhubo.robot_motion.json_file import read_json, write_json
from mrhubo.robot_motion.lerobot import read_lerobot, write_lerobot
from mrhubo.robot_motion.mcap import import_mcap, read_mcap, write_mcap
from mrhubo.robot_motion.motion import RobotMotion
from mrhubo.robot_motion.mujoco import QPOS, read_mujoco, write_mujoco
from mrhubo.robot_motion.npz import read_npz, write_npz
from mrhubo.robot_motion.order import JointOrder, in_order
from mrhubo.robot_motion.ros2 import read_yaml, write_yaml
from mrhubo.robot_motion.tables import import_pyarrow, read_csv, read_parquet, write_csv, write_parquet
from mrhubo.robot_motion.unitree import read_unitree, write_unitree

Write = Callable[[RobotMotion, Path, JointOrder | None], tuple[str, ...]]


@dataclass(frozen=True)
class Format:
    """A way to write a robot motion."""

    ending: str
    """Of the file's name; empty: it is a folder, of any number of motions."""
    meaning: str
    """In words, for `--help`."""
    write: Write
    """Writes a motion whose joints are in order already, and returns what it had to assume."""
    preset: bool = False
    """Whether it has to be asked for by name: its ending says another."""
    library: Callable[[], object] | None = None
    """Imports what it needs besides NumPy; raises a UserError that says how to install it."""


def _plain(write: Callable[[RobotMotion, Path], None]) -> Write:
    def written(motion: RobotMotion, path: Path, order: JointOrder | None) -> tuple[str, ...]:
        write(motion, path)
        return ()

    return written


FORMATS: dict[str, Format] = {
    "npz": Format(".npz", "all that is known, as NumPy arrays", _plain(write_npz)),
    "csv": Format(".csv", "a table with a header", _plain(write_csv)),
    "json": Format(".json", "all that is known, as JSON", _plain(write_json)),
    "parquet": Format(".parquet", "the table of csv, and all else in its header", _plain(write_parquet),
                      library=import_pyarrow),
    "mujoco": Format(".npz", "MuJoCo's qpos, quaternion w first", write_mujoco, preset=True),
    "unitree": Format(".csv", "no header, base and quaternion w last before the joints: Unitree, BeyondMimic",
                      write_unitree, preset=True),
    "gmr": Format(".pkl", "GMR's pickle, quaternion w last: TWIST, MimicKit, ProtoMotions", write_gmr),
    "mcap": Format(".mcap", "ROS 2 bag with a JointTrajectory", _plain(write_mcap), library=import_mcap),
    "yaml": Format(".yaml", "ROS 2 JointTrajectory as YAML", write_yaml),
    "lerobot": Format("", "LeRobot dataset 3.0, a folder, an episode a motion",
                      _plain(lambda motion, path: write_lerobot([motion], path)), preset=True, library=import_pyarrow),
}  # fmt: skip
"""By name."""


def find_format(path: Path, name: str | None = None) -> str:
    """The name of the format of a path to be written: the one that is asked for, or that of its ending.

    Raises:
        UserError: there is no such format, or none with that ending.
    """
    if name is None:
        endings = {row.ending: name for name, row in FORMATS.items() if not row.preset}
        found = endings.get(path.suffix.lower().replace(".yml", ".yaml"))
        if found is None:
            presets = listed(name for name, row in FORMATS.items() if row.preset)
            raise UserError(f"{path}: the name must end in {', '.join(endings)}, or a format be named: {presets}")
        return found
    if name not in FORMATS:
        raise UserError(unknown_name("format", shortened(name), FORMATS))
    return name


def write_robot_motion(
    motion: RobotMotion, path: Path | str, format: str | None = None, joint_order: JointOrder | None = None
) -> tuple[str, ...]:
    """Writes a robot motion, whole or not at all; docs/formats.md specifies the formats.

    Args:
        motion: what to write.
        path: where to; folders are made.
        format: a key of `FORMATS`; default: the one of the path's ending.
        joint_order: joints are written in this order (`in_order`); default: as the motion has them.

    Returns:
        What had to be done or assumed, a sentence each.

    Raises:
        UserError: there is no such format, the motion lacks what it needs, a joint of the order is none of the robot,
            or the disk refuses.
    """
    path = Path(path)
    row = FORMATS[find_format(path, format)]
    notes: tuple[str, ...] = ()
    if joint_order is not None:
        motion, notes = in_order(motion, joint_order)
    try:
        return notes + row.write(motion, path, joint_order)
    except UserError as error:
        raise error if str(path) in str(error) else UserError(f"{path}: {error}") from error


def read_robot_motion(
    path: Path | str, joint_names: Sequence[str] = (), frame_rate: float | None = None
) -> RobotMotion:
    """Reads a robot motion that `write_robot_motion` wrote; what is in the file, and not its ending, says how.

    Args:
        path: a file, or the folder of a LeRobot dataset with one episode.
        joint_names: of a file that does not tell them (Unitree's .csv, GMR's own pickles).
        frame_rate: of a file that does not tell it.

    Raises:
        UserError: the file is missing, damaged, hostile, too large, or holds no robot motion.
    """
    path = Path(path)
    if path.is_dir():
        motions = read_lerobot(path)
        if len(motions) != 1:
            raise UserError(f"{path}: holds {len(motions)} episodes; mrhubo.robot_motion.read_lerobot reads them all")
        return motions[0]
    with open_regular(path) as file:
        start = file.read(65_536)
    for magic, read in ((b"PAR1", read_parquet), (b"\x89MCAP", read_mcap), (b"PK", _read_zip)):
        if start.startswith(magic):
            return read(path)
    if start.startswith(b"\x80"):
        return read_gmr(path, joint_names)
    text = start.decode("utf-8-sig", "replace").lstrip()
    if text.startswith("{"):
        return read_json(path)
    line = text.partition("\n")[0].strip()
    if re.fullmatch(r"[-+0-9.eE,\s]+", line):
        if not joint_names:
            names = "joint_names=[...], or --joint-order FILE"
            raise UserError(f"{path}: has no header, so its joints have to be named: {names}")
        return read_unitree(path, joint_names, frame_rate)
    if "," in line and not re.match(r"[\w\"']+ *:", line):
        return read_csv(path)
    if "joint_names" in text:
        return read_yaml(path)
    raise UserError(f"{path}: is no robot motion; expected one of: {listed(FORMATS)}")


def _read_zip(path: Path) -> RobotMotion:
    with open_npz(path) as file:
        is_qpos = QPOS in file.keys
    return read_mujoco(path) if is_qpos else read_npz(path)
