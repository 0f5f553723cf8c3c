"""Robot motions as a LeRobot dataset, version 3.0: a folder with an episode a motion.

The layout, by its docs (https://huggingface.co/docs/lerobot/lerobot-dataset-v3) and its reader (src/lerobot/datasets of
https://github.com/huggingface/lerobot): meta/info.json (features with type, shape and names; fps; totals; templates of
paths), meta/stats.json, meta/tasks.parquet (pandas, the task as index), meta/episodes/chunk-000/file-000.parquet (an
episode a row, where its frames are), data/chunk-000/file-000.parquet (a frame a row).

Legend: F frames of all episodes, N joints.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mrhubo.errors import UserError, encodable, shortened
from mrhubo.files.atomic import atomic_path
from mrhubo.files.regular import read_regular
from mrhubo.robot_motion.clock import in_full
from mrhubo.robot_motion.motion import RobotMotion
from mrhubo.robot_motion.plain import build
from mrhubo.robot_motion.tables import import_pyarrow, read_table

_VERSION = "v3.0"
_INFO, _STATS, _TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
_EPISODES, _DATA = "meta/episodes/chunk-000/file-000.parquet", "data/chunk-000/file-000.parquet"
_TEMPLATE = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_STATE, _ACTION, _CONFIDENCE = "observation.state", "action", "confidence"
_BASE = {"root_position": ("x", "y", "z"), "root_quaternion_wxyz": ("w", "x", "y", "z")}
_CONTACT = "contact"
_INDICES = ("frame_index", "episode_index", "index", "task_index")
_MAX_JSON = 10_000_000
_REMEDY = "resample them (--out-rate)"


def write_lerobot(motions: Sequence[RobotMotion], folder: Path) -> None:
    """Writes a dataset, an episode a motion, into a folder that does not exist yet or is empty.

    `action` is the joint angles that the robot shall have, `observation.state` the same ones: a motion that was
    retargeted has not been measured on a robot.

    Raises:
        UserError: the folder is not empty; the motions have other joints or frame rates, or one that is not whole.
    """
    motions = [motion.single() for motion in motions]
    first = motions[0]
    for motion in motions:
        check_lerobot_rate(motion.frame_rate, first.frame_rate)
        if motion.joint_names != first.joint_names:
            others = f"'{motion.name}' has others than '{first.name}'"
            raise UserError(f"{folder}: a LeRobot dataset has the same joints throughout; {others}")
    check_lerobot_folder(folder)
    arrow, parquet = import_pyarrow()
    frames = _frames(motions, int(first.frame_rate or 0))
    names = [encodable(motion.name) or "motion" for motion in motions]
    tasks = list(dict.fromkeys(names))
    frames["task_index"] = np.repeat([tasks.index(name) for name in names], [len(motion) for motion in motions])
    tables = {
        _DATA: arrow.table({name: _column(arrow, array) for name, array in frames.items()}),
        _EPISODES: _episodes(arrow, motions, names),
        _TASKS: _tasks(arrow, tasks),
    }
    texts = {_STATS: _statistics(frames), _INFO: _info(motions, frames, len(tasks))}  # the last one makes it a dataset
    for name, table in tables.items():
        with atomic_path(folder / name) as temporary, open(temporary, "wb") as file:
            parquet.write_table(table, file)
    for name, content in texts.items():
        with atomic_path(folder / name) as temporary:
            temporary.write_text(json.dumps(content, indent=4, ensure_ascii=False), encoding="utf-8")


def check_lerobot_rate(frame_rate: float | None, others: float | None = None) -> None:
    """Refuses a frame rate that a dataset cannot have, or that is not that of its other motions."""
    if frame_rate is None or frame_rate != int(frame_rate):
        told = "is not known" if frame_rate is None else f"is {in_full(frame_rate)}"
        raise UserError(f"a LeRobot dataset has a whole number of frames a second, the motion's {told}; {_REMEDY}")
    if others is not None and frame_rate != others:
        told = f"{in_full(others)} and {in_full(frame_rate)}"
        raise UserError(f"a LeRobot dataset has one frame rate, found {told}; {_REMEDY}")


def check_lerobot_folder(folder: Path) -> None:
    """Refuses a folder that is not new or empty."""
    if os.path.lexists(folder) and (not folder.is_dir() or any(folder.iterdir())):
        raise UserError(f"{folder}: is there already; name a folder that is new or empty")


def _frames(motions: Sequence[RobotMotion], rate: int) -> dict[str, np.ndarray]:
    """The columns of the frames' table but for the tasks."""
    lengths = [len(motion) for motion in motions]
    frame_F = np.concatenate([np.arange(length) for length in lengths])
    q_FN = np.concatenate([motion.q for motion in motions])
    found = {_STATE: q_FN, _ACTION: q_FN}
    for name in (_CONFIDENCE, *_BASE, _CONTACT):
        told = [array for motion in motions if (array := getattr(motion, name)) is not None]
        alike = name != _CONTACT or len({motion.contact_names for motion in motions}) == 1
        if len(told) == len(motions) and alike:
            found[name] = np.concatenate(told)
    return found | {
        "timestamp": (frame_F / rate).astype(np.float32),
        "frame_index": frame_F,
        "episode_index": np.repeat(np.arange(len(motions)), lengths),
        "index": np.arange(len(frame_F)),
    }


def _column(arrow: Any, array: np.ndarray) -> Any:
    if array.ndim == 1:
        return arrow.array(array)
    return arrow.FixedSizeListArray.from_arrays(arrow.array(np.ascontiguousarray(array).reshape(-1)), array.shape[1])


def _episodes(arrow: Any, motions: Sequence[RobotMotion], names: Sequence[str]) -> Any:
    lengths = np.array([len(motion) for motion in motions])
    ends = np.cumsum(lengths)
    nothing = np.zeros(len(motions), np.int64)
    return arrow.table(
        {
            "episode_index": np.arange(len(motions)),
            "tasks": arrow.array([[name] for name in names]),
            "length": lengths,
            "data/chunk_index": nothing,
            "data/file_index": nothing,
            "dataset_from_index": ends - lengths,
            "dataset_to_index": ends,
            "meta/episodes/chunk_index": nothing,
            "meta/episodes/file_index": nothing,
        }
    )


def _tasks(arrow: Any, tasks: Sequence[str]) -> Any:
    """Tasks are pandas' index, which its header of the table says; `task` is what LeRobot calls it."""
    table = arrow.table({"task_index": np.arange(len(tasks)), "task": arrow.array(list(tasks))})
    column = {"field_name": "task", "name": "task", "pandas_type": "unicode", "numpy_type": "object", "metadata": None}
    number = {"field_name": "task_index", "name": "task_index", "pandas_type": "int64", "numpy_type": "int64",
              "metadata": None}  # fmt: skip
    names = {"name": None, "field_name": None, "pandas_type": "unicode", "numpy_type": "object", "metadata": None}
    header = {"index_columns": ["task"], "column_indexes": [names], "columns": [number, column],
              "creator": {"library": "mrhubo", "version": "1"}, "pandas_version": "2.0.0"}  # fmt: skip
    return table.replace_schema_metadata({b"pandas": json.dumps(header)})


def _statistics(frames: dict[str, np.ndarray]) -> dict[str, Any]:
    found = {}
    for name, array in frames.items():
        values = array.astype(np.float64).reshape(len(array), -1)
        found[name] = {
            "min": values.min(axis=0).tolist(),
            "max": values.max(axis=0).tolist(),
            "mean": values.mean(axis=0).tolist(),
            "std": values.std(axis=0).tolist(),
            "count": [len(values)],
        }
    return found


def _info(motions: Sequence[RobotMotion], frames: dict[str, np.ndarray], tasks: int) -> dict[str, Any]:
    joints, feet = list(motions[0].joint_names), list(motions[0].contact_names)
    axes = {_STATE: joints, _ACTION: joints, **{name: list(xyz) for name, xyz in _BASE.items()}, _CONTACT: feet}
    features: dict[str, Any] = {}
    for name, array in frames.items():
        kind = "int64" if name in _INDICES else "bool" if name == _CONTACT else "float32"
        names = axes.get(name)
        features[name] = {"dtype": kind, "shape": [1] if names is None else [array.shape[1]], "names": names}
    return {
        "codebase_version": _VERSION,
        "robot_type": encodable(motions[0].robot.name),
        "total_episodes": len(motions),
        "total_frames": len(frames["index"]),
        "total_tasks": tasks,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": int(motions[0].frame_rate or 0),
        "splits": {"train": f"0:{len(motions)}"},
        "data_path": _TEMPLATE,
        "video_path": None,
        "features": features,
    }


def read_lerobot(folder: Path) -> list[RobotMotion]:
    """The motions of a dataset that `write_lerobot` wrote: its actions, an episode each.

    Raises:
        UserError: the folder holds no dataset of this version, or one that is damaged or was split into more files.
    """
    folder = Path(folder)
    try:
        info = json.loads(read_regular(folder / _INFO, _MAX_JSON))
        features = info["features"]
        names, rate, version = features[_ACTION]["names"], float(info["fps"]), info["codebase_version"]
        feet = features[_CONTACT].get("names") if _CONTACT in features else []
        if not isinstance(feet, list) or not all(isinstance(foot, str) for foot in feet):
            feet = []  # a stranger's own
        robot = str(info.get("robot_type") or "")
    except UserError:
        raise
    except Exception as error:  # whatever json and a stranger's types make of it
        raise UserError(f"{folder / _INFO}: is no description of a LeRobot dataset with an '{_ACTION}'") from error
    if version != _VERSION or not isinstance(names, list):
        raise UserError(f"{folder}: is a LeRobot dataset of version {shortened(version)}, or without names of joints; "
                        f"expected {_VERSION}")  # fmt: skip
    data, episodes = read_table(folder / _DATA)[0], read_table(folder / _EPISODES)[0]
    try:
        q_FN = data.column(_ACTION).combine_chunks().flatten().to_numpy().reshape(-1, len(names))
        arrays = {"q": q_FN}
        for name, width in (
            (_CONFIDENCE, None),
            *((name, len(axes)) for name, axes in _BASE.items()),
            (_CONTACT, len(feet)),
        ):
            if name in features and name in data.column_names and (width is None or width > 0):
                column = data.column(name).combine_chunks()
                arrays[name] = _numbers(column) if width is None else _numbers(column.flatten()).reshape(-1, width)
        rows = list(zip(*(episodes.column(name).to_pylist() for name in
                          ("dataset_from_index", "dataset_to_index", "tasks")), strict=True))  # fmt: skip
        if any(len(array) != len(q_FN) for array in arrays.values()):
            raise ValueError("its columns have different lengths")
        if not rows or any(not 0 <= start < end <= len(q_FN) for start, end, _ in rows):
            raise ValueError("its episodes name frames that are not there")
    except Exception as error:
        raise UserError(f"{folder}: is damaged: {shortened(error, 200)}") from error
    return [
        build(
            {
                "joint_names": names,
                "frame_rate": rate,
                "name": str((task or [""])[0]),
                "robot": robot,
                **({"contact_names": feet} if _CONTACT in arrays else {}),
            },
            {name: array[start:end] for name, array in arrays.items()},
            folder,
        )
        for start, end, task in rows
    ]


def _numbers(column: Any) -> np.ndarray:
    return np.asarray(column.to_numpy(zero_copy_only=False))
