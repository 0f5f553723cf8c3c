"""pytorch-kinematics without matplotlib, which stays what it is for everybody else; of joints in a row, however many."""

from __future__ import annotations

import inspect
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo.config import RobotConfig, load_config
from mrhubo.errors import UserError
from mrhubo.robot import Robot, build_body_map, chain, link_poses
from tests.robot.two_arms import joint_of

XML = b"<robot name='r'><link name='a'/><joint name='j' type='revolute'><parent link='a'/><child link='b'/>\
<axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint><link name='b'/></robot>"

CODE = f"""
import sys
from mrhubo.robot.chain import build_chain
assert build_chain({XML!r}).get_joint_parameter_names() == ["j"]
loaded = [name for name in sys.modules if "matplotlib" in name]
assert not loaded, loaded
from matplotlib import cm, pyplot
assert pyplot.figure and cm.ScalarMappable
for again in (False, True):  # with pytorch-kinematics there already, and as if it were not
    for name in [name for name in sys.modules if again and name.startswith("pytorch_kinematics")]:
        del sys.modules[name]
    build_chain({XML!r})
    assert sys.modules["matplotlib.pyplot"] is pyplot and sys.modules["matplotlib.cm"] is cm
"""


def test_matplotlib_is_neither_loaded_nor_replaced() -> None:
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def row(links: int, pitch: str = "0.001") -> tuple[str, str]:
    """A replacement in the robot with two arms: so many links in a row below the left hand, each third on a joint."""
    text = ""
    for i in range(links):
        kind, parent = ("fixed", "prismatic", "revolute")[i % 3], "l_hand" if i == 0 else f"x{i - 1}"
        text += f'<link name="x{i}"/><joint name="jx{i}" type="{kind}"><parent link="{parent}"/><child link="x{i}"/>'
        text += f'<origin xyz="0 0 -0.001" rpy="0 {pitch} 0.002"/><axis xyz="0 1 0"/><limit lower="0.01" upper="0.1"/></joint>'
    return "</robot>", text + "</robot>"


@pytest.fixture
def shallow() -> Iterator[None]:
    """Functions may call each other 280 deep from here, where Python has 1,000: 300 links are as 1,000, in a tenth of
    the time.
    """
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(len(inspect.stack(0)) + 280)
    yield
    sys.setrecursionlimit(before)


def test_three_hundred_links_in_a_row_are_no_depth(pair: Callable[..., RobotConfig], shallow: None) -> None:
    body_map = build_body_map(pair(row(300), keypoints={"left_wrist": {"link": "x299", "offset": [0, 0, -0.1]}}))
    robot = body_map.robot
    q_N = robot.sample(1, torch.Generator().manual_seed(0))[0]
    poses = link_poses(robot.description.parsed, robot.configuration(q_N.numpy()))
    found = robot.forward(q_N[None])
    for i, link in enumerate(robot.links):
        np.testing.assert_allclose(found.position_BL3[0, i], poses[link][:3, 3], atol=1e-5, err_msg=link)
        np.testing.assert_allclose(found.rotation_BL33[0, i], poses[link][:3, :3], atol=1e-5, err_msg=link)


@pytest.mark.parametrize(("name", "deepest"), [("nao", 5), ("reachy", 8)])
def test_what_rests_may_be_part_of_what_moves(
    root: Path, name: str, deepest: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same poses, gradients and joints, from fewer joints."""
    config = load_config(root / "conf" / f"{name}.yaml").robot
    whole = Robot(config.urdf, config.joints, config.key_links, config.ranges)
    monkeypatch.setattr(chain, "_DEEPEST", deepest)
    folded = Robot(config.urdf, config.joints, config.key_links, config.ranges)
    assert len(folded.select_AN) == len(config.joints) and folded.driven_joints == whole.driven_joints
    q_BN = whole.sample(10, torch.Generator().manual_seed(0))
    torch.testing.assert_close(folded.forward(q_BN).position_BL3, whole.forward(q_BN).position_BL3, atol=1e-6, rtol=0)
    torch.testing.assert_close(folded.forward(q_BN).rotation_BL33, whole.forward(q_BN).rotation_BL33, atol=1e-6, rtol=0)


def test_too_many_joints_in_a_row_are_refused(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chain, "_DEEPEST", 4)
    with pytest.raises(UserError, match=r"nao.urdf: 4 joints in a row move the link '.*'; at most 3 can"):
        build_body_map(load_config(root / "conf" / "nao.yaml").robot)


def test_a_pitch_of_ninety_degrees_is_silent(
    pair: Callable[..., RobotConfig], recwarn: pytest.WarningsRecorder
) -> None:
    """The same robot with another zero of a joint."""
    pitch, turned = (
        joint_of("l_pitch"),
        joint_of("l_pitch").replace('xyz="0 0.2 0.3"', 'xyz="0 0.2 0.3" rpy="0 -1.5707963267948966 0"'),
    )
    here, there = (build_body_map(pair(*edit)) for edit in ((), ((pitch, turned),)))
    assert not recwarn.list
    q_BN = here.robot.sample(5, torch.Generator().manual_seed(0))
    moved_BN = q_BN.clone()
    moved_BN[:, 0] += torch.pi / 2
    seen, same = (m.robot_directions(m.robot.forward(q)) for m, q in ((here, q_BN), (there, moved_BN)))
    torch.testing.assert_close(seen, same, atol=1e-5, rtol=0)
