"""`mrhubo describe` from the command line: what it prints, writes and returns."""

from __future__ import annotations

import re
import shlex
import shutil
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from PIL import Image

from mrhubo.cli import dispatch
from mrhubo.config import load_config
from mrhubo.describe import _try as try_config
from mrhubo.errors import UserError
from mrhubo.robot.generator import humanoid
from tests.robot.two_arms import PAIR


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a robot; pictures are blank, and no motion is tried."""
    from mrhubo import describe
    from mrhubo.describing import picture

    monkeypatch.setattr(describe, "_try", lambda file: None)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(picture, "draw", lambda body_map: Image.new("RGB", (3, 3)))
    Path("my.urdf").write_text(PAIR)
    return tmp_path


def test_a_model_becomes_a_config_and_a_picture(capsys: pytest.CaptureFixture[str]) -> None:
    assert dispatch(["describe", "my.urdf"]) == 0
    shown = capsys.readouterr().out
    assert "left_shoulder" in shown and "mrhubo fit conf/my.yaml" in shown and "joints move (left arm" in shown
    assert Path("conf/my.png").is_file() and load_config("conf/my.yaml").robot.joints
    assert dispatch(["describe", "conf/my.yaml"]) == 0  # drawn anew: the picture is ours
    Image.new("RGB", (3, 3)).save("conf/my.png")
    with pytest.raises(UserError, match=r"conf/my\.png is there already"):
        dispatch(["describe", "conf/my.yaml"])
    assert dispatch(["describe", "conf/my.yaml", "--force"]) == 0
    assert dispatch(["describe", "my.urdf", "--out", "other/a.yaml"]) == 0
    assert load_config("other/a.yaml").robot.urdf.samefile("my.urdf") and Path("other/a.png").is_file()


def test_a_config_is_tried_on_a_motion(capsys: pytest.CaptureFixture[str]) -> None:
    dispatch(["describe", "my.urdf"])
    try_config(Path("conf/my.yaml"))
    assert "tried on 'pointing'" in capsys.readouterr().out


def test_the_tree_is_printed_and_nothing_written(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for word in ("my.urdf", "nao"):
        assert dispatch(["describe", word, "--tree"]) == 0
    shown = capsys.readouterr().out
    assert "l_elbow" in shown and "LShoulderPitch" in shown and [path.name for path in folder.iterdir()] == ["my.urdf"]


def test_a_config_that_a_fit_would_refuse_is_drawn_with_status_2(capsys: pytest.CaptureFixture[str]) -> None:
    dispatch(["describe", "my.urdf"])
    text = Path("conf/my.yaml").read_text().replace("left_", "x_").replace("right_", "left_").replace("x_", "right_")
    Path("conf/my.yaml").write_text(text)
    assert dispatch(["describe", "conf/my.yaml"]) == 2
    assert "error: conf/my.yaml, line 2" in capsys.readouterr().err


def test_what_must_be_answered_before_a_fit_is_status_3(capsys: pytest.CaptureFixture[str]) -> None:
    Path("bare.urdf").write_text(humanoid(3, "neither shapes nor masses").urdf)  # nothing tells where forearms end
    assert dispatch(["describe", "bare.urdf"]) == 3
    assert "answer what is not decided" in capsys.readouterr().out
    assert dispatch(["describe", "conf/bare.yaml"]) == 3
    assert "open:     left_wrist, right_wrist: answer these before a fit" in capsys.readouterr().out
    text = Path("conf/bare.yaml").read_text()
    Path("conf/bare.yaml").write_text(re.sub(r"unsure: \[.*\]", "unsure: [left_hand]", text))
    assert dispatch(["describe", "conf/bare.yaml"]) == 0, "a fit warns of a hand, and goes on"


def test_legs_and_waist_are_described_too(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(root / "data/robots/nao/nao.urdf", "nao.urdf")
    assert dispatch(["describe", "nao.urdf"]) == 0
    assert "legs move too with  mrhubo describe nao.urdf --whole-body" in capsys.readouterr().out
    assert dispatch(["describe", "nao.urdf", "--whole-body"]) == 0
    shown = capsys.readouterr().out
    assert "left leg 6" in shown and "mrhubo retarget --robot conf/nao-whole-body.yaml" in shown
    whole, upper = (load_config(f"conf/{name}.yaml").robot for name in ("nao-whole-body", "nao"))
    assert set(upper.joints) < set(whole.joints) and "left_foot" in whole.keypoints
    with pytest.raises(UserError, match="a config says itself what of a body it has"):
        dispatch(["describe", "conf/nao.yaml", "--whole-body"])


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([], "FILE is missing"),
        (["my.urdf", "your.urdf"], "found 'my.urdf' and 'your.urdf'"),
        (["my.urdf", "--quiet"], "flag '--quiet' does not exist"),
        (["your.urdf"], "your.urdf does not exist"),
        (["your.yaml"], "does not exist"),
        (["x" * 300], "is no file"),
        (["x" * 300 + ".urdf"], "does not exist"),
        (["."], "is a folder"),
        (["my.urdf", "--out", "my.png"], "a config is a .yaml file"),
        (["nao", "--out", "nao.yaml"], "the picture of a config is a .png file"),
    ],
)
def test_mistakes_are_sentences(arguments: list[str], sentence: str) -> None:
    with pytest.raises(UserError, match=sentence):
        dispatch(["describe", *arguments])


def test_fit_takes_a_model_in_place_of_a_config(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    seen = []
    stand_in = SimpleNamespace(fit=lambda config, report: seen.append(config))
    monkeypatch.setitem(sys.modules, "mrhubo.fitting.fit", stand_in)  # the real one's import takes seconds
    dispatch(["fit", "--urdf", "my.urdf", "trainer.max_steps=7"])
    assert seen[0].robot.name == "my" and seen[0].trainer.max_steps == 7 and Path("conf/my.png").is_file()
    Path("conf/my.yaml").write_text(Path("conf/my.yaml").read_text().replace("name: my", "name: mine"))
    dispatch(["fit", "--urdf", "my.urdf"])  # as it was changed
    assert seen[1].robot.name == "mine" and "which is there already" in capsys.readouterr().out
    for arguments in (["--urdf", "my.urdf", "nao"], ["--config", "nao", "--urdf", "my.urdf"]):
        with pytest.raises(UserError, match="--urdf takes the place of the config"):
            dispatch(["fit", *arguments])
    with pytest.raises(UserError, match="CONFIG is missing, .* or --urdf FILE"):
        dispatch(["fit"])


@pytest.mark.usefixtures("few_poses")
def test_the_page_about_a_robot_of_ones_own_is_done_as_it_stands(
    root: Path, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each command of it, in order; the training alone is stood in for."""
    page = (root / "docs" / "your-robot.md").read_text()
    commands = re.findall(r"^    ((?:cp|mrhubo) .*)$", page, re.M)
    assert len(commands) == 9 and commands[0].startswith("cp ")
    (folder / "data").symlink_to(root / "data")
    seen = []
    stand_in = SimpleNamespace(fit=lambda config, report: seen.append(config.robot))
    monkeypatch.setitem(sys.modules, "mrhubo.fitting.fit", stand_in)
    for line in commands:
        program, *arguments = shlex.split(line)
        if program == "cp":
            shutil.copy(*arguments)
        else:
            assert not dispatch(arguments), line
    shown = capsys.readouterr().out
    (quoted,) = re.findall(r"```\n(.*?)```", page, re.S)
    assert quoted in shown and Path("wave.csv").is_file() and Path("conf/my.png").is_file()
    assert (
        Path("wave-whole.npz").is_file() and load_config("conf/my-whole-body.yaml").robot.keypoints["pelvis"] == "Waist"
    )
    assert [robot.name for robot in seen] == ["my", "my"] and set(seen[0].unsure) == {"left_hand", "right_hand"}
