"""Entries of a robot's YAML: whatever is wrong is named with file, line and key."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from mrhubo.config import FrameEntry, HandEntry, MeanEntry, PointEntry, load_config
from mrhubo.errors import UserError
from mrhubo.robot import build_body_map
from mrhubo.robot.entries import read_end, read_mean, read_point

Changed = Callable[..., Path]


@pytest.fixture()
def changed(root: Path, tmp_path: Path) -> Changed:
    """Writes a shipped config with pieces of text replaced."""

    def write(name: str, *replacements: tuple[str, str]) -> Path:
        text = (root / "conf" / f"{name}.yaml").read_text()
        for old, new in (("urdf: " + "../" * (name.count("/") + 1), f"urdf: {root}/"), *replacements):
            assert old in text
            text = text.replace(old, new, 1)
        file = tmp_path / "robot.yaml"
        file.write_text(text)
        return file

    return write


def line_of(file: Path, piece: str) -> int:
    lines = file.read_text().splitlines()
    return next(number for number, line in enumerate(lines, start=1) if piece in line)


@pytest.mark.parametrize(
    ("robot", "old", "new", "key", "words"),
    [
        ("nao", "left_elbow: LElbow", "left_elbow: LElbo", "keypoints.left_elbow", "link 'LElbo' .*nao.urdf; nearest: 'LElbow'"),
        ("nao", "left_elbow: LElbow", "left_elbow: {link: LElbo}", "keypoints.left_elbow.link", "link 'LElbo' .*'LElbow'"),
        ("nao", "left_elbow:", "left_elbo:", "keypoints.left_elbo", "body part 'left_elbo' .*nearest: 'left_elbow'"),
        ("nao", "chest: torso", "chest: torsoo", "keypoints.chest", "link 'torsoo' does not exist in /.*nao.urdf; nearest"),
        ("nao", "chest: torso", "chest: {link: torso, fingers: [1, 0, 0], thumb: [0, 1, 0]}", "keypoints.chest", "has no 'fin"),
        ("nao", "left_elbow: LElbow", "left_elbow: {link: LElbow, up: [0, 0, 1]}", "keypoints.left_elbow", "is a point, so"),
        ("nao", "[LShoulderPitch,", "[LShoulderPtich,", "joints[0]", "joint 'LShoulderPtich' .*nao.urdf; nearest: 'LShoulderP"),
        ("nao", "RElbowRoll]", "RElbowRol]", "joints[7]", "joint 'RElbowRol' does not exist in .*nearest: 'RElbowRoll'"),
        ("nao", "r_gripper]", "r_griper]", "key_links[7]", "link 'r_griper' does not exist in .*nearest: 'r_gripper'"),
        ("nao", "  joints:", "  hold: {HaedYaw: 1}\n  joints:", "hold.HaedYaw", "joint 'HaedYaw' .*nearest: 'HeadYaw'"),
        ("coman", "LWrj2: [", "LWrj3: [", "ranges.LWrj3", "joint 'LWrj3' does not exist in .*coman.urdf; nearest: 'LWrj"),
        ("coman", "LWrj2: [-0.1, 0.1]", "LWrj2: [-9, 0.1]", "ranges.LWrj2", "leaves the URDF's limits"),
        ("coman", "thumb: [1, 0, 0]", "thumb: [0, 0, 2]", "keypoints.left_hand", "fingers and thumb must be two different"),
        ("paper/nao", "neck: Neck", "nek: Neck", "manual.keypoints.nek", "keypoint 'nek' .*nearest: 'neck'"),
        ("paper/nao", "neck: Neck", "neck: Nek", "manual.keypoints.neck", "link 'Nek' .*nao.urdf; nearest: 'Neck'"),
        ("paper/nao", "{LPelvis: 1,", "{LPelvi: 1,", "manual.keypoints.pelvis.links.LPelvi", "link 'LPelvi' .*'LPelvis'"),
        ("paper/nao", "LTibia, offset", "LTiba, offset", "manual.keypoints.left_hip.link", "link 'LTiba' .*'LTibia'"),
    ],
)  # fmt: skip
def test_wrong_names_are_blamed_on_the_yaml(
    changed: Changed, robot: str, old: str, new: str, key: str, words: str
) -> None:
    file = changed(robot, (old, new))
    line = line_of(file, new.split("\n")[0])
    with pytest.raises(UserError, match=f"^{re.escape(f'{file}, line {line}: robot.{key}: ')}.*{words}"):
        build_body_map(load_config(file).robot)


@pytest.mark.parametrize(
    ("robot", "old", "new", "sentence"),
    [
        ("nao", "chest: torso", "chest: 3.5.1: x", "not valid YAML"),
        ("nao", "left_elbow: LElbow", "left_elbow: [LElbow]", "robot.keypoints.left_elbow must be a link name, {link, offset}, "),
        ("nao", "left_elbow: LElbow", "left_elbow: {link: L, ofset: [0, 0, 0]}", "key 'robot.keypoints.left_elbow.ofset' does "
         "not exist; nearest: 'robot.keypoints.left_elbow.offset'"),
        ("nao", "left_elbow: LElbow", "left_elbow: {link: L, offset: [0, 0]}", "robot.keypoints.left_elbow.offset must be three "
         "numbers [x, y, z], found [0, 0]"),
        ("nao", "left_elbow: LElbow", "left_elbow: {link: L, offset: [0, .nan, 0]}", "robot.keypoints.left_elbow.offset[1] must "
         "be a number from -1000.0 to 1000.0, found .nan"),
        ("coman", ", thumb: [1, 0, 0]}", "}", "a required key is missing: robot.keypoints.left_hand.thumb (Where the thumb"),
        ("coman", "LWrj2: [-0.1, 0.1]", "LWrj2: [0.1, -0.1]", "robot.ranges.LWrj2 must be two numbers [low, high], low below "
         "high, found [0.1, -0.1]"),
        ("coman", "LWrj2: [-0.1, 0.1]", "LWrj2: 0.1", "robot.ranges.LWrj2 must be two numbers [low, high], low below high, f"),
        ("paper/nao", "neck: Neck", "neck: {links: {Neck: 0}}", "robot.manual.keypoints.neck.links.Neck must be a number from"),
        ("paper/nao", "shift: [0, 0, 0.12]", "shift: [0, 0.12]", "robot.manual.shift must be three numbers [x, y, z], found [0"),
        ("paper/nao", "factor: [0.5, 4.0]", "factor: [4, 0.5]", "robot.search.ranges.factor must be two numbers [low, high], "),
    ],
)  # fmt: skip
def test_wrong_forms_are_refused_when_the_file_is_read(
    changed: Changed, robot: str, old: str, new: str, sentence: str
) -> None:
    file = changed(robot, (old, new))
    with pytest.raises(UserError) as caught:
        load_config(file)
    assert str(caught.value).startswith(f"{file}, line {line_of(file, new.split(': x')[0])}: {sentence}")


def test_a_search_for_what_cannot_vary_is_blamed_on_its_range(changed: Changed) -> None:
    file = changed("paper/nao", ("shoulder.y: [", "sholder.y: ["))
    with pytest.raises(UserError) as caught:
        build_body_map(load_config(file, ["robot.scale=search"]).robot)
    expected = f"{file}, line {line_of(file, 'sholder.y')}: robot.search.ranges.sholder.y: number 'sholder.y' does not"
    assert str(caught.value).startswith(expected)


def test_the_command_line_is_blamed_for_what_it_says(root: Path) -> None:
    for override, sentence in (
        ("robot.keypoints.chest=tors", "command line: robot.keypoints.chest: link 'tors' does not exist in "),
        ("robot.joints=[LShoulderPitc]", "command line: robot.joints[0]: joint 'LShoulderPitc' does not exist in "),
    ):
        with pytest.raises(UserError) as caught:
            build_body_map(load_config(root / "conf" / "nao.yaml", [override]).robot)
        assert str(caught.value).startswith(sentence)


def test_plain_and_typed_entries_mean_the_same() -> None:
    plain = {"link": "l", "offset": [1, 2, 3]}
    assert read_point("left_elbow", plain) == read_point("left_elbow", PointEntry("l", [1.0, 2.0, 3.0]))
    assert read_point("left_elbow", "l").offset_3 == (0.0, 0.0, 0.0)
    hand = read_end("left_hand", {"link": "l", "fingers": [0, 0, -2], "thumb": [1, 0, 1]}, ("fingers", "thumb"))
    typed = read_end("left_hand", HandEntry("l", [0, 0, -2], [1, 0, 1]), ("fingers", "thumb"))
    assert torch.equal(hand.axes_23, typed.axes_23) and hand.axes_23.tolist() == [[0, 0, -1], [1, 0, 0]]
    for head in ("l", {"link": "l"}, {"link": "l", "up": [0, 0, 1]}, FrameEntry("l", forward=[1, 0, 0])):
        found = read_end("head", head, ("forward", "up"))
        assert found.link == "l" and found.axes_23.tolist() == [[1, 0, 0], [0, 0, 1]]
    assert read_mean("neck", {"links": {"a": 3, "b": 1}}) == read_mean("neck", MeanEntry({"a": 3, "b": 1}))
    assert read_mean("neck", {"offset": [0, 0, 1]}) == ({}, (0.0, 0.0, 1.0))
    assert read_mean("neck", plain) == ({"l": 1.0}, (1.0, 2.0, 3.0))
