"""Robot motions for tests: drawn at random, and one by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from mrhubo.robot_motion import FollowingJoint, RobotFacts, RobotMotion
from mrhubo.robot_motion.motion import PER_FRAME

NAMES = st.text(
    st.characters(categories=("L", "N", "P", "Zs"), exclude_characters="\0"), min_size=1, max_size=8
).filter(str.isprintable)
FLOATS = st.floats(-1e6, 1e6, width=32)
RATES = st.one_of(st.sampled_from([24.0, 29.97, 30.0, 59.94, 60.0, 120.0, 239.01]), st.floats(0.5, 2_000))


def arrays(shape: tuple[int, ...], elements: st.SearchStrategy[Any] = FLOATS) -> st.SearchStrategy[np.ndarray]:
    return hnp.arrays(np.float32, shape, elements=elements)


@st.composite
def motions(draw: st.DrawFn) -> RobotMotion:
    frames, names = draw(st.integers(1, 5)), draw(st.lists(NAMES, min_size=1, max_size=4, unique=True))
    branches, directions, feet = (draw(st.lists(NAMES, max_size=2, unique=True)) for _ in range(3))
    unit = st.floats(0, 1, width=32)
    found: dict[str, Any] = {
        "confidence": draw(arrays((frames,), unit)),
        "branch_confidence": draw(arrays((frames, len(branches)), unit)) if branches else None,
        "direction_error_deg": draw(arrays((frames, len(directions)))) if directions else None,
        "phi": draw(arrays((frames,))),
        "collision": draw(hnp.arrays(np.bool_, (frames,))),
        "contact": draw(hnp.arrays(np.bool_, (frames, len(feet)))) if feet else None,
    }
    found = {name: array if draw(st.booleans()) else None for name, array in found.items()}
    if draw(st.booleans()):
        angle = draw(arrays((frames,), st.floats(-3, 3, width=32)))
        found["root_position"] = draw(arrays((frames, 3)))
        found["root_quaternion_wxyz"] = np.stack([np.cos(angle), 0 * angle, 0 * angle, np.sin(angle)], axis=1)
    other = draw(st.lists(NAMES.filter(lambda name: name not in names), max_size=2, unique=True))
    facts = RobotFacts(
        draw(NAMES), draw(NAMES), "00ff",
        *(draw(arrays((len(names),))) if draw(st.booleans()) else None for _ in range(3)),
        tuple(FollowingJoint(name, draw(st.sampled_from(["", names[0]])), draw(st.floats(-3, 3)), draw(st.floats(-3, 3)))
              for name in other),
    )  # fmt: skip
    return RobotMotion(
        draw(arrays((frames, len(names)))), tuple(names), draw(st.none() | RATES), draw(NAMES), draw(NAMES), facts,
        branch_names=tuple(branches) if found["branch_confidence"] is not None else (),
        direction_names=tuple(directions) if found["direction_error_deg"] is not None else (),
        contact_names=tuple(feet) if found["contact"] is not None else (), **found,
    )  # fmt: skip


def plain(frames: int = 6, rate: float | None = 30.0, **more: Any) -> RobotMotion:
    """Two arms' worth of a motion, with all that is known of one."""
    rng = np.random.default_rng(frames)
    names = ("left_shoulder", "left_elbow", "right_shoulder")
    facts = RobotFacts(
        "robo", "package robo-1", "0123456789abcdef", -np.ones(3), np.ones(3), np.full(3, 7.0),
        (FollowingJoint("waist", offset=0.25), FollowingJoint("knee"), FollowingJoint("finger", "left_elbow", -2.0, 0.5)),
    )  # fmt: skip
    known = {
        "confidence": rng.random(frames), "branch_confidence": rng.random((frames, 2)), "phi": rng.random(frames),
        "direction_error_deg": rng.random((frames, 1)), "collision": rng.random(frames) > 0.5,
    }  # fmt: skip
    return RobotMotion(
        rng.uniform(-1, 1, (frames, 3)), names, rate, "wave", "a file", facts, branch_names=("left_arm", "right_arm"),
        direction_names=("left_forearm",), **(known | more),
    )  # fmt: skip


def standing(frames: int = 6) -> RobotMotion:
    """The same with a base that moves, and feet."""
    rng = np.random.default_rng(frames)
    angle = rng.uniform(-3, 3, frames)
    return plain(
        frames, contact=rng.random((frames, 2)) > 0.5, contact_names=("left_foot", "right_foot"),
        root_position=rng.normal(size=(frames, 3)),
        root_quaternion_wxyz=np.stack([np.cos(angle), 0 * angle, 0 * angle, np.sin(angle)], axis=1),
    )  # fmt: skip


def assert_same(found: RobotMotion, expected: RobotMotion, fields: Any = PER_FRAME) -> None:
    """The same numbers, bit by bit, and the same joints."""
    assert found.joint_names == expected.joint_names
    for name in fields:
        a, b = getattr(found, name), getattr(expected, name)
        assert (a is None) == (b is None), name
        if a is not None:
            assert a.dtype == b.dtype, name
            np.testing.assert_array_equal(a, b, err_msg=name)
