"""What is written is read back as it was meant, by the loader that everybody's configs go through."""

from __future__ import annotations

import dataclasses
import shlex
from pathlib import Path

import pytest
import torch
import yaml

from mrhubo.config import load_config
from mrhubo.describing.yaml_file import described_yaml, end_entry, keypoint_entries, next_command, relative, unsure
from mrhubo.robot import build_body_map, read_keypoints
from mrhubo.robot.discovery import Candidate, Discovery, FoundRange, Question, discover
from tests.robot.two_arms import PAIR


def found(folder: Path, text: str = PAIR) -> Discovery:
    (folder / "pair.urdf").write_text(text)
    return discover(folder / "pair.urdf")


def written(folder: Path, found: Discovery) -> Path:
    file = folder / "conf" / "pair.yaml"
    file.parent.mkdir(exist_ok=True)
    text = described_yaml(found, folder / "pair.urdf", file, file.with_suffix(".png"), "pair.urdf")
    assert max(len(line) for line in text.splitlines() if str(file) not in line) <= 120
    file.write_text(text)
    return file


@pytest.mark.parametrize("robot", ["nao", "coman", "reachy"])
def test_the_shipped_robots_come_back(root: Path, tmp_path: Path, robot: str) -> None:
    urdf = root / "data" / "robots" / robot / f"{robot}.urdf"
    discovery, file = discover(urdf), tmp_path / "my.yaml"
    file.write_text(described_yaml(discovery, urdf, file, tmp_path / "my.png", urdf.name))
    config = load_config(file).robot
    assert config.name == "my" and config.urdf.samefile(urdf)
    assert tuple(config.joints) == discovery.joints and tuple(config.key_links) == discovery.key_links
    assert config.ranges.keys() == discovery.ranges.keys() and config.unsure == list(unsure(discovery))
    body_map = build_body_map(config)
    for name, point in body_map.keypoints.points.items():
        assert point.link == discovery.points[name].link
        assert point.offset_3 == pytest.approx(discovery.points[name].offset_3, abs=1e-5)
    for name, end in body_map.keypoints.ends.items():
        axes = torch.tensor([list(axis) for axis in discovery.ends[name].axes.values()])
        assert end.link == discovery.ends[name].link and torch.allclose(end.axes_23, axes, atol=2e-5)


@pytest.mark.parametrize(
    "name", ["a: b", "x # y", "'quoted'", '"', "${l}", "true", "13_28", "{a}", "[b]", "ä ö", "- z", "*"]
)
def test_any_name_of_a_link_and_a_joint_comes_back(tmp_path: Path, name: str) -> None:
    shown = name.replace('"', "&quot;")
    text = PAIR.replace('"l_lower"', f'"{shown}"').replace('"l_pitch"', f'"{shown}"')
    discovery = found(tmp_path, text)
    config = load_config(written(tmp_path, discovery)).robot
    assert name in config.joints and name in config.key_links
    expected = read_keypoints(keypoint_entries(discovery))
    assert read_keypoints(config.keypoints).points == expected.points


def test_every_entry_says_how_sure_it_is_and_why(tmp_path: Path) -> None:
    discovery = found(tmp_path)
    lines = written(tmp_path, discovery).read_text().splitlines()
    for name in keypoint_entries(discovery):
        part = discovery.points.get(name) or discovery.ends[name]
        row = next(row for row, line in enumerate(lines) if line.startswith(f"    {name}:"))
        near = " ".join(line.strip(" #") for line in lines[row - 3 : row + 1])
        assert f"{part.confidence:.2f}: " in near and part.cue.split()[0] in near


def test_what_else_it_may_be_can_be_pasted(tmp_path: Path) -> None:
    discovery = found(tmp_path)
    point = discovery.points["left_wrist"]
    other = Candidate("l_lower", (0.0, 0.01, -0.2), "the tip")
    changed = {**discovery.points, "left_wrist": dataclasses.replace(point, candidates=(other,))}
    text = written(tmp_path, dataclasses.replace(discovery, points=changed)).read_text()
    line = next(line for line in text.splitlines() if line.endswith("# or: the tip"))
    assert yaml.safe_load(line.strip(" #")) == {"left_wrist": {"link": "l_lower", "offset": [0.0, 0.01, -0.2]}}


def test_ranges_and_questions_are_written(tmp_path: Path) -> None:
    asked = (
        Question("left_hand", "where is the thumb?", ("l_hand",)),
        Question("left_sole", "how far down?"),
        Question("forward", "which way does it face?"),
    )
    discovery = dataclasses.replace(
        found(tmp_path), questions=asked, ranges={"l_elbow": FoundRange(-2.0, -0.1, "an elbow bends one way")}
    )
    hip = dataclasses.replace(discovery.points["left_wrist"])
    discovery = dataclasses.replace(discovery, points={**discovery.points, "left_sole": hip})
    file = written(tmp_path, discovery)
    config = load_config(file).robot
    assert config.ranges == {"l_elbow": [-2.0, -0.1]}
    assert config.unsure == ["left_hand", "chest"]  # nothing reads a sole yet
    assert all(question.text in file.read_text() for question in asked)


@pytest.mark.parametrize(
    ("lower", "upper"), [(-1.37568583, 0.9), (-2.2999999, -0.1234567), (0.0, 1.0000049), (-0.00001, 1.0)]
)
def test_a_range_never_leaves_the_limits_by_its_rounding(tmp_path: Path, lower: float, upper: float) -> None:
    found_ = dataclasses.replace(found(tmp_path), ranges={"l_elbow": FoundRange(lower, upper, "why")})
    low, high = load_config(written(tmp_path, found_)).robot.ranges["l_elbow"]
    assert lower <= low < lower + 2e-5 and upper - 2e-5 < high <= upper


def test_quarter_turns_of_five_digits_leave_no_rest(tmp_path: Path) -> None:
    end = dataclasses.replace(
        found(tmp_path).ends["chest"], axes={"forward": (1.0, 0.0, 1e-5), "up": (-1e-5, 0.0, 1.0)}
    )
    assert end_entry(end) == end.link


def test_a_text_from_a_file_stays_in_its_comment(tmp_path: Path) -> None:
    """Names of a stranger's file are shown in comments too, and must not end them."""
    discovery = dataclasses.replace(found(tmp_path), notes=("two\nlines\r\nrobot: {}\u2028x: 1\x85y: 2",))
    assert load_config(written(tmp_path, discovery)).robot.name == "pair"


def test_the_urdf_is_named_from_the_config_unless_they_are_far_apart(tmp_path: Path) -> None:
    assert relative(tmp_path / "a" / "x.urdf", tmp_path / "conf" / "x.yaml") == "../a/x.urdf"
    assert relative(Path("/opt/x.urdf"), Path("/home/me/x.yaml")) == "/opt/x.urdf"


def test_commands_that_are_told_can_be_pasted_whatever_a_folder_is_called(tmp_path: Path) -> None:
    discovery, folder = found(tmp_path), tmp_path / "my robot's"
    folder.mkdir()
    for body in (False, True):
        words = shlex.split(next_command(dataclasses.replace(discovery, whole_body=body), folder / "x.yaml"))
        assert str(folder / "x.yaml") in words
    head = described_yaml(discovery, tmp_path / "x.urdf", folder / "x.yaml", folder / "x.png", "x.urdf")
    assert f"#   mrhubo describe {shlex.quote(str(folder / 'x.yaml'))}  # draws" in head
