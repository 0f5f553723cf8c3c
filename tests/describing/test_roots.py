"""A URDF whose root is a foot or a hand: the trunk is made the root, and the robot answers as it would otherwise."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest
import torch

from mrhubo.config import load_config
from mrhubo.describing.run import config_of, describe_model, open_robot
from mrhubo.errors import InputWarning, UserError
from mrhubo.motion import read_motion, resample
from mrhubo.motion.editing import trim
from mrhubo.reference import OptimizationRetargeter
from mrhubo.robot import BodyMap, Robot
from mrhubo.robot.generator import humanoid
from mrhubo.robot.rooted import rooted
from mrhubo.robot.urdf import describe
from mrhubo.runtime.locations import project_root

COMAN = project_root() / "data/robots/coman/coman.urdf"
TOLD = r"its root, '{}', is carried by a limb that moves, so '{}' was made the root"


@pytest.fixture(params=["LFoot", "RWrMot3"])
def odd(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, str]:
    """COMAN with a foot or a hand as its root."""
    monkeypatch.chdir(tmp_path)
    Path("odd.urdf").write_bytes(rooted(describe(COMAN), request.param))
    return Path("odd.urdf"), request.param


@pytest.mark.filterwarnings("ignore::mrhubo.errors.InputWarning")
def test_the_whole_body_moves_as_that_of_the_same_robot_does(odd: tuple[Path, str]) -> None:
    with pytest.warns(InputWarning, match=TOLD.format(odd[1], "Waist")):
        robot = open_robot(str(odd[0]), whole_body=True)
    plain = open_robot(str(COMAN), whole_body=True)
    assert set(robot.joint_names) == set(plain.joint_names)
    motion = trim(resample(read_motion(project_root() / "data/motions/bow_and_greet.npz"), 10.0), 1.0, 2.0)
    answers = [OptimizationRetargeter(each)(motion) for each in (robot, plain)]
    order = [robot.joint_names.index(name) for name in plain.joint_names]
    torch.testing.assert_close(answers[0].q[:, order], answers[1].q, atol=2e-3, rtol=0)
    assert answers[0].root_position is not None and answers[1].root_position is not None
    links = [each.forward(answer.q).position_BL3 for each, answer in zip((robot, plain), answers, strict=True)]
    rows = [each.link_index(each.keypoints.ends["pelvis"].link) for each in (robot, plain) if each.keypoints]
    apart = [link_TL3[:, row].norm(dim=-1).max() for link_TL3, row in zip(links, rows, strict=True)]
    assert max(apart) < 1e-4, "the base of both is the pelvis"
    torch.testing.assert_close(answers[0].root_position, answers[1].root_position, atol=2e-3, rtol=0)


@pytest.mark.filterwarnings("ignore::mrhubo.errors.InputWarning")
def test_a_description_writes_the_robot_beside_its_config(odd: tuple[Path, str]) -> None:
    before = odd[0].read_bytes()
    described = describe_model("odd.urdf", whole_body=True)
    assert described.urdf == Path("conf/odd-whole-body-rooted.urdf") and odd[0].read_bytes() == before
    assert any("was made the root" in note for note in described.notes)
    assert load_config(described.file).robot.urdf.samefile(described.urdf)
    BodyMap.of(Robot.from_config(described.file))
    described.file.unlink()
    with pytest.raises(UserError, match=r"conf/odd-whole-body-rooted\.urdf is there already"):
        describe_model("odd.urdf", whole_body=True)
    assert not described.file.exists()
    assert describe_model("odd.urdf", whole_body=True, force=True).file.exists()


@pytest.mark.filterwarnings("ignore::mrhubo.errors.InputWarning")
def test_a_config_is_known_by_the_robot_that_was_written_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("odd.urdf").write_bytes(rooted(describe(COMAN), "RWrMot3"))
    described = describe_model("odd.urdf")
    assert config_of("odd.urdf") == (described.file, None)


def test_arms_alone_of_a_robot_that_stands_on_its_root_stay_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("odd.urdf").write_bytes(rooted(describe(COMAN), "LFoot"))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        robot = open_robot("odd.urdf")
    assert robot.description.root == "LFoot" and not any("the root" in str(each.message) for each in told)


@pytest.mark.filterwarnings("ignore::mrhubo.errors.InputWarning")
@pytest.mark.parametrize("kind", ["root at a foot", "root at a hand", "root at the head"])
def test_made_up_robots_of_such_roots_are_taken(kind: str, tmp_path: Path) -> None:
    for seed in range(6):
        (tmp_path / "made.urdf").write_text(humanoid(seed, kind).urdf)
        BodyMap.of(open_robot(str(tmp_path / "made.urdf"), whole_body=True))
