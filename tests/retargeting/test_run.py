"""Files are read, cut, answered and written one after the other; a bad one does not stop the others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo.errors import UserError
from mrhubo.motion import Motion, read_motion
from mrhubo.retargeting import Answerer, Places, Request, Summary, find_files, plan_places, retarget_files, table
from mrhubo.robot import BodyMap, Robot, robot_facts
from mrhubo.robot_motion import JointOrder, RobotMotion, read_lerobot, read_robot_motion
from mrhubo.runtime.progress import SILENT
from tests.chain import cut_motion


@pytest.fixture(scope="module")
def body_map() -> BodyMap:
    return BodyMap.of(Robot.from_config("nao"))


@pytest.fixture
def answerer(body_map: BodyMap) -> Answerer:
    """Says by its angles what it was asked: the left wrist's first number, frame by frame."""

    def answer(motion: Motion) -> RobotMotion:
        q = motion.local_TJ33[:, 19, 0, :1].repeat(1, len(body_map.robot.joint_names)).numpy()
        errors = np.tile(np.arange(4, dtype=np.float32), (len(motion), 1))
        return RobotMotion(
            q, body_map.robot.joint_names, motion.frame_rate, motion.name, confidence=np.full(len(motion), 0.5),
            direction_error_deg=errors, direction_names=body_map.measured_names, collision=np.arange(len(motion)) < 1,
            robot=robot_facts(body_map.robot, "a stub", ""),
        )  # fmt: skip

    facts = robot_facts(body_map.robot, "", "")
    limbs = ("left_elbow", "left_wrist", "right_elbow", "right_wrist")
    return Answerer("a stub", answer, body_map.robot.joint_names, facts, limbs)


@pytest.fixture
def files(tmp_path: Path) -> list[Path]:
    return [cut_motion(name, tmp_path / "in", (1, 1.5), every=2) for name in ("wave", "drinking")]


def test_a_bad_file_does_not_stop_the_others(tmp_path: Path, answerer: Answerer, files: list[Path]) -> None:
    bad = tmp_path / "in" / "bad.npz"
    bad.write_bytes(b"PK\x03\x04")
    said: list[str] = []
    places = plan_places(f"{tmp_path}/out/", None, files)
    outcome = retarget_files([files[0], bad, files[1]], answerer, places, Request(), SILENT, said.append)
    assert list(outcome.failures) == [bad] and str(bad) in outcome.failures[bad]
    assert [summary.name for summary in outcome.summaries] == ["wave", "drinking"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["drinking.npz", "wave.npz"]
    text = "\n".join(said)
    assert f"{files[0]}: SMPL-family .npz" in text and "15 frames at 30 per second" in text
    assert f"{bad}: not retargeted" in text and f"written: {tmp_path}/out/wave.npz" in text
    found = read_robot_motion(tmp_path / "out" / "wave.npz")
    assert torch.equal(torch.from_numpy(found.q[:, 0]), read_motion(files[0]).local_TJ33[:, 19, 0, 0])


def test_spans_rates_and_mirrors_are_those_of_the_request(
    tmp_path: Path, answerer: Answerer, files: list[Path]
) -> None:
    wave = read_motion(files[0])
    request = Request(start=0.1, end=0.3, rate=15.0, mirrored=True)
    prepared = request.prepare(wave)
    assert prepared.frame_rate == 15.0 and len(prepared) == 4
    for new, old in ((0, 3), (1, 5), (3, 9)):
        torch.testing.assert_close(prepared.local_TJ33[new, 18, 0, 0], wave.local_TJ33[old, 17, 0, 0])
    retarget_files([files[0]], answerer, plan_places(f"{tmp_path}/out", "csv", files), request, SILENT, lambda _: None)
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["wave_mirrored.csv"]
    assert read_robot_motion(tmp_path / "out" / "wave_mirrored.csv").frame_rate == 15.0


def test_what_is_assumed_of_all_is_said_once(tmp_path: Path, answerer: Answerer, files: list[Path]) -> None:
    names = answerer.joint_names
    said: list[str] = []
    request = Request(joint_order=JointOrder((*names[::-1], "LHipRoll"), "order.txt"))
    places = plan_places(f"{tmp_path}/out/", "unitree", files)
    retarget_files(files, answerer, places, request, SILENT, said.append)
    assert said.count("  held at 0 rad, as the motion does not turn them: LHipRoll") == 1
    assert sum("which stays at the origin" in line for line in said) == 1
    rows = np.loadtxt(tmp_path / "out" / "wave.csv", delimiter=",")
    assert rows.shape == (15, 7 + len(names) + 1) and not rows[:, -1].any()
    wrong = Request(joint_order=JointOrder(("LHip",), "order.txt"))
    with pytest.raises(UserError, match="order.txt: joint 'LHip' does not exist in the robot nao"):
        retarget_files(files, answerer, places, wrong, SILENT, said.append)


def test_a_dataset_takes_all_of_them(tmp_path: Path, answerer: Answerer, files: list[Path]) -> None:
    places = plan_places(f"{tmp_path}/set", "lerobot", files)
    order = JointOrder(answerer.joint_names[:2])
    retarget_files(files, answerer, places, Request(joint_order=order), SILENT, lambda _: None)
    found = read_lerobot(tmp_path / "set")
    assert [(m.name, len(m), m.joint_names) for m in found] == [(n, 15, order.names) for n in ("wave", "drinking")]


def test_a_summary_is_of_limbs_alone(answerer: Answerer, files: list[Path]) -> None:
    assert answerer.limb_names == ("left_elbow", "left_wrist", "right_elbow", "right_wrist")
    summary = Summary.of(answerer.answer(read_motion(files[0])), answerer.limb_names[1:3])
    assert (summary.frames, summary.frame_rate, summary.limb_deg, summary.confidence) == (15, 30.0, 1.5, 0.5)
    head, row = table([summary]).splitlines()
    assert head.split()[:2] == ["motion", "frames"] and row.split() == ["wave", "15", "30", "1.5", "0.50", "6.7%"]
    bare = Summary.of(RobotMotion([[0.0]], ("a",), name="bare"), ())
    assert table([bare]).splitlines()[1].split() == ["bare", "1"]
    assert "self is unknown" in table([bare]) and "unknown" not in table([bare], is_told=True)
    assert table([summary, bare]).splitlines()[2].split() == ["bare", "1", "-", "-", "-", "-"]


@pytest.mark.parametrize(
    ("out", "format", "count", "folder", "name"),
    [
        ("a.csv", None, 1, False, "csv"), ("a.csv", "unitree", 1, False, "unitree"), ("new", None, 1, True, "npz"),
        ("new/", "json", 3, True, "json"), ("in", None, 1, True, "npz"), ("set", "lerobot", 3, True, "lerobot"),
    ],
)  # fmt: skip
def test_out_is_a_file_or_a_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, out: str, format: str | None, count: int, folder: bool, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in").mkdir()
    places = plan_places(out, format, [Path("in") / f"{number}.npz" for number in range(count)])
    assert (places.is_folder, places.format) == (folder, name)


def test_what_cannot_be_written_is_said_before_any_work(tmp_path: Path, files: list[Path]) -> None:
    with pytest.raises(UserError, match=r"2 motions do not go into one file; name a folder, for instance .*/all/"):
        plan_places(f"{tmp_path}/all.csv", None, files)
    with pytest.raises(UserError, match="would be written over what is read"):
        plan_places(str(files[0]), None, files[:1])
    with pytest.raises(UserError, match="would be written over what is read"):
        plan_places(f"{files[0].parent}/", None, files)
    order = tmp_path / "order.csv"
    order.touch()
    with pytest.raises(UserError, match="order.csv: would be written over what is read"):
        plan_places(str(order), None, files[:1], [None, "nao", order])
    places = plan_places(f"{files[0].parent}/", "csv", files, [files[0].parent / "a.csv"])
    (files[0].parent / "a.csv").touch()
    with pytest.raises(UserError, match="a.csv: would be written over what is read"):
        places.path("a")
    with pytest.raises(UserError, match="is a file; name a folder"):
        (tmp_path / "file").write_text("")
        plan_places(f"{tmp_path}/file", None, files)
    with pytest.raises(UserError, match="the name must end in"):
        plan_places(f"{tmp_path}/a.bvh", None, files[:1])


def test_folders_are_taken_apart_and_names_stay_apart(tmp_path: Path, files: list[Path]) -> None:
    assert find_files([files[0].parent, files[0]]) == sorted(files)
    (files[0].parent / "02.asf").write_text(":version 1.10\n:units\n  length 0.45\n")  # a skeleton is no motion
    assert find_files([files[0].parent]) == sorted(files)
    with pytest.raises(UserError, match="holds no motion file"):
        (tmp_path / "empty").mkdir()
        find_files([tmp_path / "empty"])
    places = Places(tmp_path, "csv", is_folder=True)
    assert [places.path(name).name for name in ("a", "a", "b", "a")] == ["a.csv", "a_2.csv", "b.csv", "a_3.csv"]
