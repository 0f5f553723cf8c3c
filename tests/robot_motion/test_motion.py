"""A robot motion is refused where its parts do not fit together; whatever numbers come, float32 is kept."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from mrhubo.errors import UserError
from mrhubo.robot_motion import FollowingJoint, RobotFacts, RobotMotion
from tests.robot_motion.motions import plain

Q = [[0.0, 1.0], [2.0, 3.0]]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"q": [[0.0], [1.0]]}, r"q has shape \(2, 1\); expected \(2, 2\)"),
        ({"q": [[np.nan, 0.0]]}, "q holds NaN or infinite numbers"),
        ({"q": [[1e300, 0.0]]}, "q holds NaN or infinite numbers"),
        ({"q": [["a", "b"]]}, "q must hold numbers, found <U1"),
        ({"joint_names": ("a", "a")}, "joint_names has 'a' twice"),
        ({"joint_names": ("a", "b\n")}, "a name that is empty or no text"),
        ({"joint_names": (), "q": np.zeros((2, 0))}, "joint_names is empty"),
        ({"frame_rate": 0.0}, "frame_rate must be a positive number"),
        ({"frame_rate": np.inf}, "frame_rate must be a positive number"),
        ({"frame_rate": True}, "frame_rate must be a positive number"),
        ({"frame_rate": 10**400}, "frame_rate must be a positive number .* found 1000"),
        ({"frame_rate": np.complex64(1)}, "frame_rate must be a positive number"),
        ({"confidence": [1.0]}, r"confidence has shape \(1,\); expected \(2,\)"),
        ({"branch_confidence": [[1.0], [1.0]]}, r"branch_confidence has shape \(2, 1\); expected \(2, 0\)"),
        ({"root_position": np.zeros((2, 3))}, "go together"),
        ({"root_position": np.zeros((2, 3)), "root_quaternion_wxyz": np.ones((2, 4))}, "whose norm is not 1"),
        ({"robot": RobotFacts(lower=np.zeros(3))}, r"lower has shape \(3,\)"),
        ({"robot": RobotFacts(others=(FollowingJoint("a"),))}, "joint 'a' is the motion's own"),
        ({"robot": RobotFacts(others=(FollowingJoint("c", "d"),))}, "joint 'c' is the motion's own, or follows"),
    ],
)
def test_what_does_not_fit_together_is_refused(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(UserError, match=message):
        RobotMotion(**({"q": Q, "joint_names": ("a", "b")} | fields))


@pytest.mark.parametrize("number", [np.nan, -np.inf, 10**400, "x"])
@pytest.mark.parametrize("name", ["multiplier", "offset"])
def test_what_follows_does_so_by_a_finite_number(name: str, number: Any) -> None:
    with pytest.raises(UserError, match=f"joint 'c' has a {name} that is no finite number"):
        FollowingJoint("c", "a", **{name: number})


def test_a_pose_becomes_a_motion_of_one_frame_and_several_motions_none() -> None:
    pose = RobotMotion(Q[1], ("a", "b"), confidence=np.float64(0.5))
    assert pose.frames == len(pose) == 1 and pose.q.dtype == np.float32 and pose.q.shape == (2,)
    single = pose.single()
    assert single.q.tolist() == [[2.0, 3.0]] and single.confidence is not None and single.confidence.shape == (1,)
    with pytest.raises(UserError, match=r"one motion, found joint angles of shape \(2, 1, 2\); use \.npz"):
        RobotMotion([[Q[0]], [Q[1]]], ("a", "b")).single()
    motion = plain()
    assert motion.single() is motion


def test_it_needs_no_torch() -> None:
    code = "import mrhubo, sys; mrhubo.RobotMotion; assert not {'torch', 'pyarrow', 'yaml'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
