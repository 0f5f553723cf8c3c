"""A LeRobot dataset, version 3.0: as its reader wants it, and its motions come back."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mrhubo.errors import UserError
from mrhubo.robot_motion import FORMATS, RobotFacts, read_lerobot, read_robot_motion, write_lerobot, write_robot_motion
from tests.robot_motion.motions import assert_same, plain, standing

MOTIONS = [dataclasses.replace(plain(count), name=name) for count, name in ((5, "wave"), (3, "bow"), (4, "wave"))]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_lerobot(MOTIONS, tmp_path / "dataset")
    return tmp_path / "dataset"


def test_the_same_numbers_come_back(folder: Path, tmp_path: Path) -> None:
    found = read_lerobot(folder)
    assert [motion.name for motion in found] == ["wave", "bow", "wave"]
    for motion, expected in zip(found, MOTIONS, strict=True):
        assert_same(motion, expected, ["q", "confidence"])
        assert motion.frame_rate == 30.0 and motion.robot.name == "robo"
    with pytest.raises(UserError, match="holds 3 episodes"):
        read_robot_motion(folder)
    write_robot_motion(MOTIONS[0], tmp_path / "one", "lerobot")
    assert_same(read_robot_motion(tmp_path / "one"), MOTIONS[0], ["q", "confidence"])
    assert FORMATS["lerobot"].ending == ""


def test_base_and_contacts_come_back_where_all_motions_tell_them(tmp_path: Path) -> None:
    whole = [standing(frames) for frames in (4, 2)]
    write_lerobot(whole, tmp_path / "whole")
    for found, expected in zip(read_lerobot(tmp_path / "whole"), whole, strict=True):
        assert_same(found, expected, ["q", "root_position", "root_quaternion_wxyz", "contact"])
        assert found.contact_names == ("left_foot", "right_foot")
    features = json.loads((tmp_path / "whole" / "meta" / "info.json").read_text())["features"]
    assert features["contact"] == {"dtype": "bool", "shape": [2], "names": ["left_foot", "right_foot"]}
    data = pd.read_parquet(tmp_path / "whole" / "data" / "chunk-000" / "file-000.parquet")
    assert data["contact"].iloc[0].dtype == bool and len(data["root_quaternion_wxyz"].iloc[0]) == 4
    write_lerobot([whole[0], dataclasses.replace(plain(3), name="arms")], tmp_path / "some")
    assert all(motion.contact is None and motion.root_position is None for motion in read_lerobot(tmp_path / "some"))


def test_it_is_laid_out_as_lerobot_reads_it(folder: Path) -> None:
    """What src/lerobot/datasets/io_utils.py and dataset_metadata.py look for, read as they read it."""
    info = json.loads((folder / "meta" / "info.json").read_text())
    assert info["codebase_version"] == "v3.0" and info["fps"] == 30 and info["splits"] == {"train": "0:3"}
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (3, 12, 2)
    tasks = pd.read_parquet(folder / "meta" / "tasks.parquet")
    assert tasks.index.name == "task" and tasks.loc["bow"].task_index == 1
    data = pd.read_parquet(folder / info["data_path"].format(chunk_index=0, file_index=0))
    assert set(data.columns) == set(info["features"])
    for name, feature in info["features"].items():
        cell = data[name].iloc[0]
        assert np.shape(cell) == (() if feature["shape"] == [1] else tuple(feature["shape"])), name
        assert np.asarray(cell).dtype == feature["dtype"], name
    assert info["features"]["action"]["names"] == list(MOTIONS[0].joint_names)
    assert data["index"].tolist() == list(range(12)) and data["frame_index"].tolist()[5:8] == [0, 1, 2]
    np.testing.assert_allclose(data["timestamp"], data["frame_index"] / 30, atol=1e-7)
    episodes = pd.read_parquet(folder / "meta" / "episodes" / "chunk-000" / "file-000.parquet")
    assert episodes["dataset_from_index"].tolist() == [0, 5, 8] and episodes["length"].tolist() == [5, 3, 4]
    assert episodes["tasks"].tolist() == [["wave"], ["bow"], ["wave"]]
    stats = json.loads((folder / "meta" / "stats.json").read_text())
    assert set(stats) == set(info["features"]) and stats["action"]["count"] == [12]
    np.testing.assert_allclose(stats["action"]["mean"], np.concatenate([m.q for m in MOTIONS]).mean(axis=0), atol=1e-6)


def test_what_no_dataset_holds_is_refused(tmp_path: Path, folder: Path) -> None:
    with pytest.raises(UserError, match="is there already"):
        write_lerobot(MOTIONS, folder)
    with pytest.raises(UserError, match="a whole number of frames a second, the motion's is 29.97"):
        write_lerobot([plain(rate=29.97)], tmp_path / "a")
    with pytest.raises(UserError, match=r"the motion's is 30\.00003; resample"):  # and not "is 30"
        write_lerobot([plain(rate=30.00003)], tmp_path / "a")
    with pytest.raises(UserError, match="one frame rate, found 30 and 60; resample them"):
        write_lerobot([MOTIONS[0], plain(rate=60.0)], tmp_path / "a")
    other = dataclasses.replace(MOTIONS[1], joint_names=("a", "b", "c"), robot=RobotFacts())
    with pytest.raises(UserError, match="the same joints throughout; 'bow' has others than 'wave'"):
        write_lerobot([MOTIONS[0], other], tmp_path / "a")
    assert not (tmp_path / "a").exists()
    for name, text in {"meta/info.json": "{}", "data/chunk-000/file-000.parquet": "PAR1"}.items():
        whole = (folder / name).read_bytes()
        (folder / name).write_text(text)
        with pytest.raises(UserError, match="is no description of a LeRobot dataset|cannot be read as Parquet"):
            read_lerobot(folder)
        (folder / name).write_bytes(whole)
