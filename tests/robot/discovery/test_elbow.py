"""Arms of which a file tells little: no limits, no shapes, no masses beyond the last joint."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrhubo.robot.discovery import discover

ARM = (("pitch", "0 0.08 0", "0 1 0"), ("roll", "0.002 0.07 -0.01", "1 0 0"), ("twist", "0 0.04 0", "0 1 0"),
       ("elbow", "0 0.12 0", "0 0 1"))  # fmt: skip


def robot(limits: str, *more: tuple[str, str, str]) -> str:
    """Two arms in a T on a chest, and nothing but joints."""
    text = '<robot name="t"><link name="chest"/>'
    for side, sign in (("left", 1), ("right", -1)):
        parent = "chest"
        for name, xyz, axis in (*ARM, *more):
            x, y, z = map(float, xyz.split())
            text += f'<link name="{side}_{name}"/><joint name="{side}_{name}_joint" type="revolute">'
            text += f'<parent link="{parent}"/><child link="{side}_{name}"/><origin xyz="{x} {sign * y} {z}"/>'
            text += f'<axis xyz="{axis}"/>{limits}</joint>'
            parent = f"{side}_{name}"
    return text + "</robot>"


@pytest.mark.parametrize("more", [(), (("forearm", "0 0 0", "0 1 0"),)])
def test_elbow_is_found_where_nothing_tells_the_forearm(tmp_path: Path, more: tuple[tuple[str, str, str], ...]) -> None:
    file = tmp_path / "t.urdf"
    file.write_text(robot('<limit lower="-1.7" upper="1.6" effort="1" velocity="1"/>', *more))
    found = discover(file)
    assert found.points["left_elbow"].root_3 == pytest.approx((0.002, 0.31, -0.01), abs=1e-4)
    assert found.points["left_shoulder"].root_3 == pytest.approx((0.002, 0.15, -0.01), abs=1e-4)
    # The forearm is a guess, and asked about.
    assert {"left_wrist", "right_wrist"} <= {question.about for question in found.questions}


def test_joints_without_limits_are_arms_too(tmp_path: Path) -> None:
    file = tmp_path / "t.urdf"
    file.write_text(robot('<limit lower="0" upper="0" effort="1" velocity="1"/>').replace("revolute", "continuous"))
    assert len(discover(file).chains["left_arm"]) == len(ARM)
