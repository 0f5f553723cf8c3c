"""Small robots whose traps are known: an arm with a mimic joint, a negative axis and a limit that excludes zero; and one
with two arms that nothing is wrong with, of which tests change one place.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mrhubo.config import RobotConfig
from tests.robot.two_arms import KEYPOINTS, PAIR

ARM = """<?xml version="1.0" encoding="utf-8"?>
<robot name="arm">
  <link name="base"/><link name="upper"/><link name="fore"/><link name="hand"/><link name="finger"/><link name="slide"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0.2 1" rpy="0.1 0.2 0.3"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="1.5" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 0 -0.3"/>
    <axis xyz="0 0 -1"/><limit lower="0.3" upper="1.2" effort="1" velocity="1"/></joint>
  <joint name="wrist" type="revolute"><parent link="fore"/><child link="hand"/><origin xyz="0.02 0 -0.25"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/><mimic joint="elbow" multiplier="-0.5"
    offset="0.1"/></joint>
  <joint name="spin" type="continuous"><parent link="hand"/><child link="finger"/><axis xyz="0 0 1"/></joint>
  <joint name="rail" type="prismatic"><parent link="base"/><child link="slide"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.1" effort="1" velocity="1"/></joint>
</robot>
"""


@pytest.fixture
def arm(tmp_path: Path) -> Callable[..., Path]:
    """Writes the arm, with pairs of text replaced, and returns its file."""

    def write(*replacements: tuple[str, str]) -> Path:
        return _write(tmp_path / "arm.urdf", ARM, replacements)

    return write


@pytest.fixture
def pair(tmp_path: Path) -> Callable[..., RobotConfig]:
    """Writes the robot with two arms, with pairs of text replaced in its URDF, and returns its config, with settings
    replaced, and keypoints among `keypoints`; None takes one away.
    """

    def write(*replacements: tuple[str, str], keypoints: dict[str, Any] | None = None, **settings: Any) -> RobotConfig:
        urdf = _write(tmp_path / "pair.urdf", PAIR, replacements)
        entries = {name: entry for name, entry in {**KEYPOINTS, **(keypoints or {})}.items() if entry is not None}
        names = [f"{s}_{joint}" for s in "lr" for joint in ("pitch", "roll", "yaw", "elbow")]
        links = ["l_lower", "l_hand", "r_lower", "r_hand"]
        config = {"name": "pair", "urdf": urdf, "joints": names, "keypoints": entries, "key_links": links}
        return RobotConfig(**{**config, **settings})

    return write


def _write(path: Path, text: str, replacements: tuple[tuple[str, str], ...]) -> Path:
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return path
