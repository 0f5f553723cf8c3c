"""A part of a robot's motion is all of what is known of those frames."""

from __future__ import annotations

import numpy as np
import pytest

from mrhubo.errors import UserError
from mrhubo.robot_motion import RobotMotion, trim_robot_motion
from mrhubo.robot_motion.motion import PER_FRAME


@pytest.fixture
def motion() -> RobotMotion:
    random = np.random.default_rng(0)
    return RobotMotion(
        random.normal(size=(11, 2)), ("a", "b"), 10.0, "theirs",
        confidence=random.uniform(size=11), collision=random.uniform(size=11) > 0.5,
        root_position=random.normal(size=(11, 3)), root_quaternion_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (11, 1)),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("start", "end", "rows"), [(0.0, None, slice(0, 11)), (0.3, None, slice(3, 11)), (0.25, 0.55, slice(3, 6))]
)
def test_all_of_a_span_is_kept(motion: RobotMotion, start: float, end: float | None, rows: slice) -> None:
    found = trim_robot_motion(motion, start, end)
    for name in PER_FRAME:
        given, kept = getattr(motion, name), getattr(found, name)
        assert (given is None) == (kept is None), name
        if given is not None:
            np.testing.assert_array_equal(kept, given[rows], err_msg=name)
    assert (found.joint_names, found.frame_rate, found.robot) == (motion.joint_names, 10.0, motion.robot)


def test_seconds_need_a_rate(motion: RobotMotion) -> None:
    bare = RobotMotion(motion.q, motion.joint_names)
    assert len(trim_robot_motion(bare, 0.5, rate=20.0)) == 1
    with pytest.raises(UserError, match="the robot motion: does not tell its frame rate"):
        trim_robot_motion(bare, 0.5)


def test_what_is_no_part_is_refused(motion: RobotMotion) -> None:
    with pytest.raises(UserError, match="theirs: has no frame from 2 s; it lasts from 0 to 1.000 s"):
        trim_robot_motion(motion, 2.0)
    with pytest.raises(UserError, match="is no span of time"):
        trim_robot_motion(motion, 0.5, 0.2)
