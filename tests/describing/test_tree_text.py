"""Every joint is a line, with its axis and place in the root's frame; whatever is wrong with a joint is said there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mrhubo.describing.tree_text import tree_text
from mrhubo.robot import link_poses
from mrhubo.robot.urdf import describe


@pytest.mark.parametrize("robot", ["nao", "coman", "reachy"])
def test_axes_and_places_are_those_at_zero(root: Path, robot: str) -> None:
    description = describe(root / "data" / "robots" / robot / f"{robot}.urdf")
    poses = link_poses(description.parsed, {})
    lines = {line.split()[0]: line.split() for line in tree_text(description).splitlines()[3:]}
    assert lines.keys() - {"joint"} == description.joints.keys()
    for name, joint in description.joints.items():
        numbers = [float(word) for word in lines[name][2 : 5 if joint.kind == "fixed" else 8]]
        assert np.allclose(numbers[-3:], poses[joint.child][:3, 3], atol=1e-3)
        if joint.rotary:
            assert np.allclose(numbers[:3], poses[joint.child][:3, :3] @ joint.axis_3, atol=1e-3)


def test_a_joint_stands_below_its_parent_and_further_right(root: Path) -> None:
    description = describe(root / "data" / "robots" / "coman" / "coman.urdf")
    lines = tree_text(description).splitlines()
    place = {line.split()[0]: (row, len(line) - len(line.lstrip())) for row, line in enumerate(lines) if line.strip()}
    for joint in description.joints.values():
        above = description.parent_joint.get(joint.parent)
        if above is not None:
            (row, indent), (row_above, indent_above) = place[joint.name], place[above.name]
            assert row > row_above and indent == indent_above + 2


def test_broken_and_following_joints_are_told(arm: Callable[..., Path]) -> None:
    text = tree_text(describe(arm(('xyz="0 0 -0.3"', 'xyz="0 0 x"'))), "my.urdf")
    assert text.startswith("my.urdf: 6 links, 5 joints, 4 of which turn")
    assert "cannot be used: line" in text and "has no place: a joint above it cannot be used" in text
    whole = tree_text(describe(arm()))
    assert "(follows elbow: times -0.5, plus 0.1)" in whole and "0 .. 0.1 m" in whole and "continuous" in whole


def test_a_long_chain_is_no_trouble(tmp_path: Path) -> None:
    links = "".join(f'<link name="l{i}"/>' for i in range(1500))
    joints = "".join(
        f'<joint name="j{i}" type="fixed"><parent link="l{i}"/><child link="l{i + 1}"/></joint>' for i in range(1499)
    )
    (tmp_path / "chain.urdf").write_text(f'<robot name="chain">{links}{joints}</robot>')
    lines = tree_text(describe(tmp_path / "chain.urdf")).splitlines()
    assert len(lines) == 1499 + 4 and max(map(len, lines)) < 300
