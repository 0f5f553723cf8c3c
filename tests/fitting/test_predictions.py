"""Anybody's robot motions are measured as a package's answers are, whatever their order of joints and frame rate."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.evaluate import main
from mrhubo.fitting.predictions import measure_predictions
from mrhubo.fitting.preparation import Prepared, prepare
from mrhubo.motion import resample
from mrhubo.reference import OptimizationRetargeter
from mrhubo.robot_motion import RobotMotion, write_robot_motion
from mrhubo.runtime.progress import SILENT
from tests.chain import cut_motion


@pytest.fixture(scope="module")
def prepared(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Prepared:
    folder = tmp_path_factory.mktemp("clips")
    for name in ("drinking", "wave"):
        cut_motion(name, folder / "clips", (1, 3), every=6)
    settings = [f"pairs.dir={folder}", f"evaluation.motions=[{folder / 'clips'}]", f"tracking.dir={folder}"]
    return prepare(load_config(root / "conf" / "nao.yaml", settings))


@pytest.fixture(scope="module")
def answer(prepared: Prepared) -> RobotMotion:
    """The reference's own, to the wave."""
    wave = next(motion for motion in prepared.motions.all if motion.name == "wave")
    return OptimizationRetargeter(prepared.body_map, prepared.config.evaluation.smoothness)(wave).robot_motion


def rows(text: str) -> dict[str, list[str]]:
    return {line.split("  ")[0]: line.split() for line in text.splitlines() if line}


def test_the_references_own_answer_is_without_error(prepared: Prepared, answer: RobotMotion, tmp_path: Path) -> None:
    """In another order, with a joint more, and the name in the file's name."""
    q = np.concatenate([answer.q[:, ::-1], np.linspace(0, 1, len(answer))[:, None]], axis=1)
    foreign = RobotMotion(q, (*answer.joint_names[::-1], "Waist"), answer.frame_rate)
    write_robot_motion(foreign, tmp_path / "wave.npz")
    text = measure_predictions(prepared, SILENT, [tmp_path / "wave.npz"])
    found = rows(text)
    assert found["wave"][1:4] == ["20", "0.000", "0.00"]
    assert found["predictions"][1:] == found["reference"][1:]
    assert "joints that move but are not the config's, and are held here: Waist" in text


def test_a_worse_answer_measures_worse_and_limits_are_told(
    prepared: Prepared, answer: RobotMotion, tmp_path: Path
) -> None:
    worse = dataclasses.replace(answer, q=answer.q + 0.3)
    write_robot_motion(worse, tmp_path / "any.json")
    text = measure_predictions(prepared, SILENT, [tmp_path / "any.json"])
    assert float(rows(text)["wave"][2]) == pytest.approx(0.3, abs=0.001)
    assert "of the frames are outside the joints' limits" in text


def test_each_is_measured_at_its_own_rate(prepared: Prepared, tmp_path: Path) -> None:
    wave = next(motion for motion in prepared.motions.all if motion.name == "wave")
    retargeter = OptimizationRetargeter(prepared.body_map, prepared.config.evaluation.smoothness)
    answer = retargeter(resample(wave, 7.5)).robot_motion
    shorter = RobotMotion(answer.q[:-1], answer.joint_names, 7.5)
    write_robot_motion(shorter, tmp_path / "wave.npz")
    found = rows(measure_predictions(prepared, SILENT, [tmp_path / "wave.npz"]))
    assert int(found["wave"][1]) == len(answer) - 1 and float(found["wave"][2]) < 0.05


@pytest.mark.parametrize(
    ("changes", "name", "message"),
    [
        ({"frame_rate": None}, "wave", "has no frame rate"),
        ({"frame_rate": 60.0}, "wave", "has 20 frames at 60 per second; 'wave' has 115 at that rate"),
        ({"name": ""}, "waves", "motion 'waves' does not exist in evaluation.motions; nearest: 'wave'"),
        ({"joint_names": tuple("abcdefgh")}, "wave", "joint 'LShoulderPitch' does not exist in it; available: a, b"),
    ],
)
def test_what_does_not_fit_is_refused(
    prepared: Prepared, answer: RobotMotion, tmp_path: Path, changes: dict, name: str, message: str
) -> None:
    bare = RobotMotion(answer.q, answer.joint_names, answer.frame_rate)
    write_robot_motion(dataclasses.replace(bare, **changes), tmp_path / f"{name}.npz")
    with pytest.raises(UserError, match=message):
        measure_predictions(prepared, SILENT, [tmp_path / f"{name}.npz"])


def test_several_motions_in_a_file_name_it(prepared: Prepared, answer: RobotMotion, tmp_path: Path) -> None:
    np.savez(tmp_path / "wave.npz", q=answer.q[None], joint_names=answer.joint_names, frame_rate=answer.frame_rate)
    with pytest.raises(UserError, match=r"wave\.npz: such a file holds one motion"):
        measure_predictions(prepared, SILENT, [tmp_path / "wave.npz"])


def test_degrees_are_told(prepared: Prepared, answer: RobotMotion, tmp_path: Path) -> None:
    for scale, told in ((1.0, False), (np.rad2deg(1.0), True), (500.0, False)):
        scaled = dataclasses.replace(answer, q=answer.q * scale)
        write_robot_motion(scaled, tmp_path / "wave.npz")
        assert ("look like degrees" in measure_predictions(prepared, SILENT, [tmp_path / "wave.npz"])) == told


def test_two_answers_to_a_motion_are_refused(prepared: Prepared, answer: RobotMotion, tmp_path: Path) -> None:
    for name in ("a.npz", "b.npz"):
        write_robot_motion(answer, tmp_path / name)
    with pytest.raises(UserError, match=r"b\.npz: answers 'wave', as another file does"):
        measure_predictions(prepared, SILENT, [tmp_path / "a.npz", tmp_path / "b.npz"])


def test_the_command(root: Path, prepared: Prepared, answer: RobotMotion, tmp_path: Path, capsys) -> None:
    write_robot_motion(answer, tmp_path / "a.npz")
    settings = [f"pairs.dir={prepared.config.pairs.dir}", f"evaluation.motions=[{prepared.motions.folder}]"]
    given = ["nao", "--predictions", str(tmp_path / "a.npz"), "--quiet", *settings]
    main(["nao", "--quiet", "--predictions", str(tmp_path / "a.npz"), *settings])
    capsys.readouterr()
    main(given)
    assert rows(capsys.readouterr().out)["wave"][2] == "0.000"
    write_robot_motion(answer, tmp_path / "wave.csv", "unitree")  # which names no joints
    (tmp_path / "order.txt").write_text("\n".join(answer.joint_names))
    bare = ["nao", "--predictions", str(tmp_path / "wave.csv"), "--quiet", *settings]
    with pytest.raises(UserError, match="--joint-order FILE"):
        main(bare)
    with pytest.raises(UserError, match="has no frame rate"):
        main([*bare, "--joint-order", str(tmp_path / "order.txt")])
    main([*bare, "--joint-order", str(tmp_path / "order.txt"), "--rate", f"{answer.frame_rate}"])
    assert rows(capsys.readouterr().out)["wave"][2] == "0.000"
    with pytest.raises(UserError, match="--joint-order and --rate are for --predictions"):
        main(["nao", "--optimiser", "--rate", "30"])
    with pytest.raises(UserError, match="--polish and --validation are for a package"):
        main([*given, "--polish", "1"])
    with pytest.raises(UserError, match="--retargeter --predictions --optimiser is required"):
        main(["nao"])
