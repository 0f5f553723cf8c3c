"""Files are written once and never over somebody's work; what cannot be described is one sentence and leaves nothing."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from mrhubo.config import load_config
from mrhubo.describing import model_file
from mrhubo.describing.run import config_of, describe_model, draw_config, open_robot, read_model
from mrhubo.errors import InputWarning, UserError
from mrhubo.robot import Robot, build_body_map
from mrhubo.robot.generator import humanoid
from tests.robot.two_arms import PAIR


@pytest.fixture
def urdf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my.urdf").write_text(PAIR)
    return Path("my.urdf")


def files(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_a_description_is_a_config_that_a_fit_takes(urdf: Path, tmp_path: Path) -> None:
    described = describe_model("my.urdf")
    assert described.file == Path("conf/my.yaml") and files(tmp_path) == {"my.urdf", "conf/my.yaml"}
    robot = Robot.from_config("conf/my.yaml")
    assert robot.urdf.samefile(urdf) and robot.name == "my"


@pytest.mark.parametrize(
    ("file", "declared", "name"),
    [
        ("model.urdf", '<robot name="iCub">', "iCub"),
        ("Robot.URDF", "<robot version='1' name = 'my bot/2'>", "my_bot_2"),
        ("model.urdf", '<robot name="model">', "model"),
        ("model.urdf", "<robot>", "model"),
        ("g1.urdf", '<robot name="other">', "g1"),
    ],
)
def test_a_file_whose_name_says_nothing_has_that_which_it_gives_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file: str, declared: str, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    text = re.sub("<robot[^>]*>", declared, PAIR, count=1)
    Path(file).write_text(f'<?xml version="1.0"?>\n<!-- a link is named below: name="no" -->\n{text}')
    assert describe_model(file).file == Path(f"conf/{name}.yaml")
    assert open_robot(file).name == name


def test_nothing_is_replaced_without_force(urdf: Path) -> None:
    describe_model("my.urdf")
    Path("conf/my.yaml").write_text("mine")
    with pytest.raises(UserError, match=r"conf/my\.yaml is there already, .* --force"):
        describe_model("my.urdf")
    assert Path("conf/my.yaml").read_text() == "mine"
    describe_model("my.urdf", force=True)
    assert load_config("conf/my.yaml").robot.joints


def test_a_photograph_in_place_of_the_picture_stays(urdf: Path) -> None:
    Path("conf").mkdir()
    Path("conf/my.png").write_bytes(b"a photograph")
    with pytest.raises(UserError, match=r"conf/my\.png is there already, and may hold work of yours"):
        describe_model("my.urdf")
    assert Path("conf/my.png").read_bytes() == b"a photograph" and not Path("conf/my.yaml").exists()
    assert describe_model("my.urdf", force=True).file.exists()


def test_a_urdf_that_was_to_be_replaced_is_back_where_the_model_is_no_humanoid(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco", reason="MuJoCo, of the extra mjcf, is not installed")
    monkeypatch.chdir(tmp_path)
    chair = '<body name="seat"><joint name="turn"/><geom size="0.1"/></body>'
    Path("m.xml").write_text(f"<mujoco><worldbody>{chair}</worldbody></mujoco>")
    Path("m.urdf").write_text(PAIR)
    with pytest.raises(UserError, match=r"^m\.xml: no two arms"):
        describe_model("m.xml", Path("m.yaml"), force=True)
    with pytest.raises(UserError, match=r"^m\.xml: no two arms"):
        open_robot("m.xml")
    assert Path("m.urdf").read_text() == PAIR and files(tmp_path) == {"m.xml", "m.urdf"}


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("none.urdf", None, "none.urdf does not exist"),
        ("page.urdf", "<html></html>", "page.urdf is no URDF: it is a web page"),
        ("text.urdf", "no xml", "text.urdf is no well-formed XML"),
        ("chair.urdf", '<robot name="x"><link name="a"/></robot>', "no two arms"),
        ("m.xml", "<mujoco><worldbody/></mujoco>", "m.xml"),
        ("robot.xacro", '<robot xmlns:xacro="http://ros.org/xacro"><xacro:a/></robot>', "expand it"),
    ],
)
def test_what_is_no_humanoid_is_a_sentence_and_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, text: str | None, sentence: str
) -> None:
    monkeypatch.chdir(tmp_path)
    if text is not None:
        Path(name).write_text(text)
    with pytest.raises(UserError) as refused:
        describe_model(name)
    assert sentence in str(refused.value) and not str(refused.value).startswith("robot.urdf")
    assert files(tmp_path) == ({name} if text is not None else set())


def test_a_broken_joint_of_an_arm_is_named(urdf: Path) -> None:
    urdf.write_text(PAIR.replace('<origin xyz="0 0 -0.25"/>', '<origin xyz="0 0 -0.25 1"/>', 1))
    with pytest.raises(UserError, match=r"my\.urdf, line \d+: joint 'l_yaw': .* without this joint"):
        describe_model("my.urdf")


def test_faults_of_files_end_in_sentences(external_dir: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for path in sorted((external_dir / "faults").glob("*.urdf")):
        try:
            describe_model(str(path), tmp_path / f"{path.stem}.yaml")
        except UserError as error:
            assert "\n" not in str(error)


def test_a_model_is_described_once(urdf: Path) -> None:
    file, described = config_of("my.urdf")
    assert described is not None
    file.write_text(file.read_text() + "trainer:\n  max_steps: 7\n")
    assert config_of("my.urdf") == (file, None) and load_config(file).trainer.max_steps == 7
    os.mkdir("other")
    Path("other/my.urdf").write_text(PAIR)
    with pytest.raises(UserError, match="of another model"):
        config_of("other/my.urdf")


def test_a_robot_without_a_config_is_the_one_that_a_config_would_give(urdf: Path) -> None:
    describe_model("my.urdf")
    one, other = open_robot("my.urdf"), open_robot("conf/my.yaml")
    assert one.joint_names == other.joint_names and one.keypoints is not None and other.keypoints is not None
    assert one.keypoints.points == other.keypoints.points and one.name == other.name
    assert not list(Path().glob("*.yaml"))


def test_a_wrong_config_is_drawn_and_its_fault_told(urdf: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from PIL import Image

    from mrhubo.describing import picture

    monkeypatch.setattr(picture, "draw", lambda body_map: Image.new("RGB", (3, 3)))
    file = describe_model("my.urdf").file
    assert draw_config(file, Path("a.png")) is None
    text = file.read_text()
    file.write_text(text.replace("left_", "x_").replace("right_", "left_").replace("x_", "right_"))
    fault = draw_config(file, Path("b.png"))
    assert fault is not None and "left and right" in fault and Path("b.png").is_file()


def test_guesses_are_told_where_no_config_holds_them(urdf: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from mrhubo.describing import run

    monkeypatch.setattr(run, "unsure", lambda found: {"left_hand": "where is the thumb?"})
    with pytest.warns(InputWarning, match="left_hand: where is the thumb"):
        open_robot("my.urdf")


def test_limits_that_nobody_gives_are_told_where_no_config_holds_them(urdf: Path) -> None:
    text = Path("my.urdf").read_text()
    Path("my.urdf").write_text(re.sub(r'lower="[^"]*" upper="[^"]*"', "", text).replace("revolute", "continuous"))
    with pytest.warns(
        InputWarning, match=r"my.urdf: it gives '\w+' and \d+ more no limits, .* `mrhubo describe` writes"
    ):
        open_robot("my.urdf")


def test_robots_of_the_package_are_found_where_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(
        UserError,
        match="'g1' is no file .a config that ships with mrhubo: 'g1-whole-body'.; .* pip install robot_descriptions",
    ):
        read_model("g1")
    package = tmp_path / "lib" / "robot_descriptions"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (tmp_path / "pair.urdf").write_text(PAIR)
    (package / "toy_description.py").write_text(f"URDF_PATH = {str(tmp_path / 'pair.urdf')!r}")
    (package / "far_mj_description.py").write_text("raise OSError('no network\\nat all')")
    monkeypatch.syspath_prepend(str(tmp_path / "lib"))
    assert model_file.find_model("toy") == model_file.find_model("toy_description") == tmp_path / "pair.urdf"
    with pytest.raises(UserError, match="far_mj_description: robot_descriptions cannot fetch it: no network$"):
        read_model("far")
    with pytest.raises(UserError, match="'h1' is no file, and no robot of the package"):
        read_model("h1")


@pytest.mark.parametrize("seed", [47, 49])
def test_what_the_axes_tell_of_a_chest_is_not_doubted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int, recwarn: pytest.WarningsRecorder
) -> None:
    """Made-up robots whose chest has its origin above the shoulders, or in no place that a human's has."""
    monkeypatch.chdir(tmp_path)
    Path("my.urdf").write_text(humanoid(seed).urdf)
    described = describe_model("my.urdf")
    build_body_map(load_config(described.file).robot)
    assert not [warning for warning in recwarn.list if "from where they lie on a human" in str(warning.message)]


def test_a_robot_of_ten_thousand_joints_is_refused_at_once(tmp_path: Path) -> None:
    links = "".join(f'<link name="l{i}"/>' for i in range(10_000))
    joints = "".join(
        f'<joint name="j{i}" type="continuous"><parent link="l{i - 1}"/><child link="l{i}"/></joint>'
        for i in range(1, 10_000)
    )
    (tmp_path / "long.urdf").write_text(f'<robot name="long">{links}{joints}</robot>')
    with pytest.raises(UserError, match="9,999 joints move"):
        describe_model(str(tmp_path / "long.urdf"), tmp_path / "long.yaml")


@pytest.mark.parametrize(("kind", "more"), [("revolute", ("waist",)), ("prismatic", ())])
def test_a_lift_is_no_waist_that_moves_too(tmp_path: Path, kind: str, more: tuple[str, ...]) -> None:
    """What is told to move with the whole body does: a column that slides turns no chest."""
    text = humanoid(4).urdf  # on a pedestal, with a waist of one joint
    (tmp_path / "my.urdf").write_text(text.replace('"waist_rol_j" type="revolute"', f'"waist_rol_j" type="{kind}"'))
    described = describe_model(str(tmp_path / "my.urdf"), tmp_path / "my.yaml")
    assert described.more == more
    whole = describe_model(str(tmp_path / "my.urdf"), tmp_path / "whole.yaml", whole_body=True)
    assert set(whole.found.joints) - set(described.found.joints) == {"waist_rol_j"} & set(whole.found.joints)
    assert ("waist_rol_j" in whole.found.joints) == bool(more) and whole.more == ()
