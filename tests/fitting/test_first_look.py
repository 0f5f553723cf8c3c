"""What the reference's answer to one motion says about a mapping."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mrhubo.config import RobotConfig, load_config
from mrhubo.describing.run import open_robot
from mrhubo.evaluation import Clip
from mrhubo.fitting.first_look import FirstLook, judge, look_at
from mrhubo.motion import read_motion, resample, trim
from mrhubo.reference import OptimizationRetargeter
from mrhubo.robot import BodyMap, build_body_map
from tests.robot.more_robots import more_robot


def look(root: Path, config: RobotConfig, seconds: float = 4.0) -> FirstLook:
    body_map = build_body_map(config)
    motion = trim(resample(read_motion(root / "data" / "motions" / "pointing.npz"), 6.0), 0.0, seconds)
    answer = OptimizationRetargeter(body_map).retarget(motion.local_TJ33, motion.frame_rate)
    return judge(body_map, Clip(motion, answer.q_TN.float()))


def test_a_right_mapping_leaves_no_doubt(root: Path) -> None:
    found = look(root, load_config(root / "conf" / "coman.yaml").robot)
    assert found.doubts == () and found.jumps == 0
    assert max(found.error_deg.values()) < 2
    assert found.at_limit["LWrj2"] > 0.3  # its range is 0.2 rad, so that says nothing
    assert set(found.metrics) >= {"mapping/at_limit/LElbj", "mapping/error_deg/left_elbow", "mapping/jumps"}
    assert "LWrj2" in str(found)


@pytest.mark.filterwarnings("ignore::mrhubo.errors.InputWarning")
def test_thumbs_that_point_down_hold_joints_at_limits_and_bend_arms_backwards(root: Path) -> None:
    thumbs = {f"{side}_hand": {"link": f"{side}_wrist_yaw_link", "fingers": [1, 0, 0], "thumb": [0, 0, -1]}
              for side in ("left", "right")}  # fmt: skip
    found = look(root, more_robot("g1", keypoints=thumbs))
    left = r"robot.keypoints.left_hand: the joint 'left_shoulder_yaw_joint' is at a limit in \d+% .*axes tell: left_hand: {"
    elbow = r"robot.ranges.right_elbow_joint: the limb is bent backwards in .*: right_elbow_joint: \[-1.047, 1.5\d+\]"
    for expected in (left, elbow):
        assert any(re.match(expected, doubt) for doubt in found.doubts)
    assert found.backwards["right_elbow_joint"] > 0.05


@pytest.mark.filterwarnings("ignore::mrhubo.errors.InputWarning")
def test_a_limb_that_is_missed_is_named(root: Path) -> None:
    fixed = {"hold": {"left_shoulder_roll_joint": 0.0}, "joints": more_robot("g1").joints}
    fixed["joints"] = [name for name in fixed["joints"] if name != "left_shoulder_roll_joint"]
    beside = {"left_shoulder": {"link": "left_shoulder_yaw_link", "offset": [0, 0.1, 0.1]}}
    found = look(root, more_robot("g1", keypoints=beside, **fixed))
    assert any("the left upper arm misses the human's by" in doubt for doubt in found.doubts)


@pytest.mark.filterwarnings("ignore::mrhubo.errors.InputWarning")
def test_a_robot_that_reaches_no_farther_is_not_told_to_write_what_stands_there(root: Path, tmp_path: Path) -> None:
    text = (root / "data" / "robots" / "nao" / "nao.urdf").read_text()
    for joint in ("LShoulderRoll", "LElbowYaw", "RShoulderRoll", "RElbowYaw"):  # what is left are two hinges an arm
        assert f'<joint name="{joint}" type="revolute">' in text
        text = text.replace(f'<joint name="{joint}" type="revolute">', f'<joint name="{joint}" type="fixed">')
    (tmp_path / "nao.urdf").write_text(text)
    body_map = BodyMap.of(open_robot(str(tmp_path / "nao.urdf")))
    doubts = [doubt for doubt in look_at(body_map).doubts if "misses" in doubt or "at a limit" in doubt]
    assert doubts and all("look at the picture" in doubt and "axes tell" not in doubt for doubt in doubts)
