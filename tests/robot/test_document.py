"""What is read as a URDF, and what it is called where it is none. Nothing that a file says may cost much."""

from __future__ import annotations

import gzip
import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrhubo.errors import UserError
from mrhubo.robot import Robot, document
from mrhubo.robot.document import read_document
from mrhubo.robot.urdf import describe
from tests.robot.two_arms import PAIR, line_of

JOINTS = ["l_pitch", "l_elbow"]
XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'


def written(folder: Path, content: str | bytes) -> Path:
    path = folder / "robot.urdf"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize(
    "content",
    [
        PAIR,
        gzip.compress(PAIR.encode()),
        PAIR.replace('<robot name="pair">', '<robot name="pair" xmlns="http://example.org/robot">'),
        PAIR.replace("<robot ", '<u:robot xmlns:u="http://example.org/robot" ').replace("</robot>", "</u:robot>"),
        PAIR.replace('<robot name="pair">', "<robot>"),
        PAIR.replace('<robot name="pair">', f'<robot name="pair" {XACRO}>'),
        PAIR.replace("</robot>", "<controller:gazebo name='c'><param:x/></controller:gazebo></robot>"),
        PAIR.replace("</robot>", "<s:joint xmlns:s='http://sdf' name='neck'/><s:link xmlns:s='http://sdf'/></robot>"),
        "\n\n  " + '<?xml version="1.0"?>' + PAIR,
        "\ufeff" + PAIR,
        PAIR.encode("utf-16"),
        "<?xml version='1.0' encoding='utf-8'?><!-- by Jos\xe9 -->".encode("latin-1") + PAIR.encode(),
        "<?xml version='1.0'?><!-- by hand --><?tool x?>" + PAIR,
        PAIR + "\r\n\0",
        '<?xml version="0.0" ?>\n' + PAIR,
        "<?xml version = '' encoding='utf-8'?>" + PAIR + "\0\0",
    ],
    ids=["plain", "packed", "default namespace", "prefix", "no name", "expanded xacro", "unexplained prefix",
         "foreign joint", "blank lines first", "byte order mark", "utf-16", "latin", "comment", "a zero at its end", "version 0.0", "no version"],
)  # fmt: skip
def test_all_forms_of_one_robot_are_read_alike(tmp_path: Path, content: str | bytes) -> None:
    found = describe(written(tmp_path, content))
    assert found.kinematics == describe(written(tmp_path, PAIR)).kinematics
    assert Robot(found, JOINTS).joint_names == tuple(JOINTS)


NONE_OF_ONES = [
    ("", r"no well-formed XML: it is empty"),
    (PAIR.replace("</robot>", ""), r"no well-formed XML: .*line"),
    (f'<robot name="a" {XACRO}><xacro:arm side="l"/></robot>', r"this is a xacro file, .* `xacro robot.urdf > robot.urdf`"),
    ('<robot name="a"><xacro:include filename="b.xacro"/><link name="base"/></robot>', r"this is a xacro file"),
    ("<mujoco><worldbody/></mujoco>", r"is no URDF: it is an MJCF model of MuJoCo \(its root element is <mujoco>\)"),
    ("<sdf version='1.6'><model name='a'/></sdf>", r"is an SDF model of Gazebo"),
    ("<html><body/></html>", r"is a web page"),
    ("<!DOCTYPE html>\n<html><br></html>", r"is a web page; save the file itself"),
    ("version https://git-lfs.github.com/spec/v1\noid sha256:0\n", r"is a pointer of Git LFS.*git lfs pull"),
    (b"PK\x03\x04rest", r"is a zip archive"),
    ("<Robot name='a'/>", r"its root element is <Robot>; write it <robot>"),
    ("<robot name='a'><group name='arm'/><disable_collisions/></robot>", r"has no <link>: an SRDF of MoveIt"),
    ("<robot name='a'/>", r"has no <link>"),
    (gzip.compress(PAIR.encode())[:-40], r"cannot be read"),
    ("<robot>" + "<link>" * 5_000 + "</link>" * 5_000 + "</robot>", r"no well-formed XML"),
    ('<!DOCTYPE r [<!ENTITY a "' + "x" * 9999 + '"><!ENTITY b "' + "&a;" * 9999 + '">]><robot name="&b;&b;&b;"/>', r"no well-formed XML"),
    ("name: toy\nurdf: toy.urdf\n", r"no well-formed XML"),
]  # fmt: skip


@pytest.mark.parametrize(("content", "message"), NONE_OF_ONES)
def test_what_is_no_urdf_is_called_what_it_is(tmp_path: Path, content: str | bytes, message: str) -> None:
    with pytest.raises(UserError, match=r"robot\.urdf: .*" + message):
        read_document(written(tmp_path, content))


def test_only_files_are_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path, message in (
        (tmp_path / "none.urdf", "does not exist"), (tmp_path, "is a folder"), (tmp_path / "pipe", "is no regular file"),
        (tmp_path / ("n" * 300), "cannot be read: File name too long"),
    ):  # fmt: skip
        with pytest.raises(UserError, match=message):
            read_document(path)


def test_size_counts_when_it_is_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(document, "_MAX_BYTES", 100_000)
    packed = gzip.compress(PAIR.replace("</robot>", " " * 100_000 + "</robot>").encode())
    assert len(packed) < 2_000
    with pytest.raises(UserError, match=r"more than 100,000 bytes unpacked"):
        read_document(written(tmp_path, packed))
    with pytest.raises(UserError, match=r"more than 100,000 bytes, which"):
        read_document(written(tmp_path, gzip.decompress(packed)))


def test_small_elements_count_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A tree in memory is many times larger than its text."""
    monkeypatch.setattr(document, "_MAX_MARKS", 1_000)
    read_document(written(tmp_path, PAIR))
    for more in ("<g/>" * 1_000, "<g " + " ".join(f'a{i}=""' for i in range(1_000)) + "/>"):
        with pytest.raises(UserError, match=r"more than 1,000 elements and attributes"):
            read_document(written(tmp_path, PAIR.replace("</robot>", more + "</robot>")))


def test_lines_count_from_the_files_first(tmp_path: Path) -> None:
    wrong = PAIR.replace('xyz="0 0 0.4"', 'xyz="0 0 up"')
    for above in ("", "\n\n\n"):
        declared = "<?xml version='1.0'?>" + wrong
        line = line_of('xyz="0 0 0.4"') + len(above)
        assert describe(written(tmp_path, above + declared)).faults["neck"].startswith(f"line {line}: joint 'neck'")


TOKENS = ['"', "<", ">", "/", " ", "0", "-1", "nan", "1e400", "${x}", "base", "l_hand", "fixed", "mimic", "joint", "origin",
          "axis", "type", "parent", "\u00e9", "xyz", "&amp;", "<link/>", "<visual/>", "<mimic/>", "\n", ",", "=", ""]  # fmt: skip


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(st.tuples(st.integers(0, len(PAIR)), st.integers(0, 12), st.sampled_from(TOKENS)), min_size=1, max_size=3)
)
def test_a_damaged_file_is_read_or_refused(tmp_path: Path, edits: list[tuple[int, int, str]]) -> None:
    """Never a traceback, and never a robot of other links than the file has."""
    text = PAIR
    for place, taken, put in edits:
        text = text[:place] + put + text[place + taken :]
    try:
        found = Robot(written(tmp_path, text), JOINTS, ["l_hand"])
    except UserError as error:
        assert str(error)
        return
    assert bool(found.forward(found.home()[None]).position_BL3.isfinite().all())


def test_no_entity_is_expanded_from_a_file(arm: Callable[..., Path]) -> None:
    bomb = '<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]><robot name="arm">&a;'
    assert Robot(arm(('<robot name="arm">', bomb)), ["shoulder"]).joint_names == ("shoulder",)


def test_commas_between_numbers_are_blanks(tmp_path: Path) -> None:
    usual = describe(written(tmp_path, PAIR))
    text = re.sub(r'(xyz|size)="([^"]*)"', lambda found: f'{found[1]}="{", ".join(found[2].split())}"', PAIR)
    assert text != PAIR and not describe(written(tmp_path, text)).faults
    for name, joint in describe(written(tmp_path, text)).joints.items():
        assert (joint.origin_44 == usual.joints[name].origin_44).all() and (
            joint.axis_3 == usual.joints[name].axis_3
        ).all()
    # A decimal comma makes more numbers than there may be, and is told as before.
    assert describe(written(tmp_path, PAIR.replace('xyz="0 1 0"', 'xyz="0,0 1,0 0,0"', 1))).faults
