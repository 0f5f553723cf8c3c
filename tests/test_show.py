"""`mrhubo show`: who is shown, what is written, and what is refused before anything takes time."""

from __future__ import annotations

import dataclasses
import shutil
from pathlib import Path

import av
import numpy as np
import pytest

from mrhubo import show, viewer
from mrhubo.errors import UserError
from mrhubo.retargeting import Answerer
from mrhubo.robot import Robot, robot_facts
from mrhubo.robot_motion import RobotMotion, write_robot_motion
from mrhubo.show import main
from mrhubo.viewer import Stage, live
from tests.chain import cut_motion, new_package

pytestmark = pytest.mark.usefixtures("few_poses")
SHORT = ["--to", "0.3"]


@pytest.fixture(scope="module")
def wave(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """4 frames at 10 per second."""
    return cut_motion("wave", tmp_path_factory.mktemp("motions"), (1, 1.35), every=6)


@pytest.fixture(scope="module")
def theirs(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Somebody's motion of NAO, of joints that our config holds too, at 20 frames per second."""
    nao = Robot.from_config(root / "conf" / "nao.yaml")
    names = (*nao.joint_names[::-1], "HeadYaw")
    q_TN = np.clip(np.zeros((5, len(names))), *np.array([*zip(nao.lower_N[:], nao.upper_N[:], strict=True)][::-1] + [(0.3, 0.3)]).T)  # fmt: skip
    path = tmp_path_factory.mktemp("theirs") / "their wave.csv"
    write_robot_motion(RobotMotion(q_TN, names, 20.0), path)
    return path


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> list[Stage]:
    """What would be served, in place of a server."""
    stages: list[Stage] = []
    monkeypatch.setattr(live, "serve", lambda stage, port, ready: (stages.append(stage), ready("http://here")))
    return stages


def quick(robot: Robot, method: str | None, avoid_collisions: bool) -> Answerer:
    """A robot that stands still; tests of `mrhubo retarget` have the methods themselves."""
    still = Answerer(
        f"answered by {method}",
        lambda motion: still_motion(len(motion)),
        robot.joint_names,
        robot_facts(robot, f"{method}, {avoid_collisions}", ""),
        (),
    )

    def still_motion(frames: int) -> RobotMotion:
        rest = still.at_rest
        return dataclasses.replace(rest, q=np.repeat(rest.q, frames, axis=0), frame_rate=10.0)

    return still


def test_all_side_by_side(
    root: Path,
    wave: Path,
    theirs: Path,
    tmp_path: Path,
    shown: list[Stage],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(show, "choose_answerer", quick)
    package = new_package(root / "conf" / "nao.yaml", tmp_path / "mine", "model.hidden=8")
    given = [
        "--motion",
        str(wave),
        "--retargeter",
        str(package),
        "--robot",
        "nao",
        "--method",
        "reference",
        "universal",
    ]
    assert main([*given, "--robot-motion", str(theirs), *SHORT, "--no-avoid-collisions"]) == 0
    (stage,) = shown
    labels = ["nao: mine", "nao: reference", "nao: universal", "nao: their wave.csv"]
    assert [robot.label for robot in stage.robots] == labels and stage.person is not None and stage.frames == 4
    mine, reference, universal, other = stage.robots
    assert mine.motion.robot.made_by == "package mine" and mine.motion.confidence is not None
    assert (reference.motion.robot.made_by, universal.motion.robot.made_by) == ("reference, False", "universal, False")
    assert other.frame_rate == 20.0 and "HeadYaw" in other.motion.joint_names and np.isfinite(other.upper_N).all()
    output = capsys.readouterr().out
    assert "package mine: robot 'nao', 8 joints" in output and "http://here  (Ctrl-C ends it)" in output


def test_a_robot_motion_alone_as_every_kind_of_file(
    theirs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for ending in ("html", "png", "gif", "mp4"):
        out = tmp_path / f"a.{ending}"
        assert main(["--robot-motion", str(theirs), "--robot", "nao", "--method", "none", "--save", str(out)]) == 0
        assert f"written: {out}, {6 if ending == 'png' else 5}" in capsys.readouterr().out or ending in ("png", "gif")
    with av.open(str(tmp_path / "a.mp4")) as film:
        assert sum(1 for _ in film.decode(video=0)) == 5
    assert main(["--robot-motion", str(theirs), "--robot", "nao", "--save", str(tmp_path / "a.png")]) == 0  # replaced


def test_a_span_is_that_of_everybody(wave: Path, theirs: Path, shown: list[Stage]) -> None:
    """A robot motion that is given is of the whole human motion, of which `--from` and `--to` leave a part."""
    span = ["--from", "0.05", "--to", "0.15"]
    assert (
        main(["--motion", str(wave), "--robot", "nao", "--method", "none", "--robot-motion", str(theirs), *span]) == 0
    )
    (stage,) = shown
    assert [len(robot.motion) for robot in stage.robots] == [3] and stage.frames < 3


def test_names_need_not_be_utf_8(wave: Path, tmp_path: Path) -> None:
    odd = Path(shutil.copy(wave, tmp_path / "w\udce4lle.npz"))
    for ending in ("html", "png", "mp4"):
        out = tmp_path / f"\udcfc.{ending}"
        assert main(["--motion", str(odd), "--robot", "nao", "--to", "0.2", "--save", str(out)]) == 0
        assert out.is_file()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ([], "--motion FILE is missing, or --robot-motion FILE"),
        (["--retargeter", "somewhere"], "--motion FILE is missing"),
        (["--motion", "a.bvh", "--robot", "nao", "--method", "refrence"], "method 'refrence' does not exist; nearest: 'reference'"),
        (["--motion", "a.bvh", "--retargeter", "b", "--method", "reference"], "--method goes with --robot alone"),
        (["--robot-motion", "a.csv"], "--robot-motion needs --robot ROBOT"),
        (["--motion", "a.bvh", "--save", "a.avi"], r"--save a.avi: the name must end in .html, .mp4, .gif, .png"),
        (["--motion", "missing.npz"], "missing.npz"),
        (["--motion", "WAVE", "--robot", "nowhere.yaml"], "nowhere.yaml"),
        (["--motion", "WAVE", "--retargeter", "nowhere"], "nowhere"),
        (["--robot-motion", "nowhere.csv", "--robot", "nao"], "nowhere.csv"),
        (["--robot-motion", "THEIRS", "--robot", "reachy"], "no robot that is given has all of its joints; reachy lacks HeadYaw"),
        (["--motion", "WAVE", "--port", "70000"], "must be a whole number from 1 to 65535"),
        (["--motion", "WAVE", "--save", "FOLDER.png"], "is a folder"),
        (["--motion", "COPY.html", "--save", "COPY.html"], "would be written over what is read"),
    ],
)  # fmt: skip
def test_what_is_refused(
    given: list[str], said: str, wave: Path, theirs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "FOLDER.png").mkdir()
    shutil.copy(wave, tmp_path / "COPY.html")
    before = (tmp_path / "COPY.html").read_bytes()
    given = [{"WAVE": str(wave), "THEIRS": str(theirs)}.get(word, word) for word in given]
    with pytest.raises(UserError, match=said):
        main(given)
    assert (tmp_path / "COPY.html").read_bytes() == before


def test_the_motion_of_a_person_alone(wave: Path, shown: list[Stage]) -> None:
    assert main(["--motion", str(wave)]) == 0
    assert shown[0].robots == () and shown[0].person is not None


def test_without_the_extra_nothing_takes_time(wave: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setattr(viewer, "read_person", None)
    for name, more in (("viser", []), ("viser", ["--save", "a.html"]), ("av", ["--save", "a.mp4"])):
        with monkeypatch.context() as patch, pytest.raises(UserError, match=rf"{name}: pip install 'mrhubo\[view\]'"):
            patch.setitem(sys.modules, name, None)
            main(["--motion", str(wave), *more])
