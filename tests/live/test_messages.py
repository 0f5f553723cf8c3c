"""What docs/live.md specifies is read; anything else is refused, and changes nothing."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo.fast.rotations import axis_angle_to_matrix
from mrhubo.live.body import SeenPose
from mrhubo.live.inbox import FAULTS, Inbox
from mrhubo.live.messages import MAX_BYTES, Heartbeat, Landmarks, Message, Nobody, Refused, read_message
from mrhubo.live.point_sets import POINT_SETS
from tests.live.messages import REST, beat, landmarks, message


def test_the_kinds() -> None:
    assert read_message(beat(3, 1.5)).content == Heartbeat(True)
    found = read_message(message(7, "nobody", 2.0))
    assert found.content == Nobody() and (found.session, found.number, found.time) == ("s", 7, 2.0)
    axis_J3 = np.random.default_rng(0).normal(size=(21, 3))
    pose = read_message(message(1, rotations=axis_J3.tolist(), confidence=[0.5] * 21)).content
    assert isinstance(pose, SeenPose) and pose.sure_J.tolist() == [0.5] * 21
    assert np.allclose(pose.local_J33, axis_angle_to_matrix(axis_J3), atol=1e-6)
    half_J1 = np.linalg.norm(axis_J3, axis=1, keepdims=True) / 2
    xyzw_J4 = np.concatenate([axis_J3 / (2 * half_J1) * np.sin(half_J1), np.cos(half_J1)], axis=1)
    same = read_message(message(1, rotations=(1.5 * xyzw_J4).tolist())).content
    assert isinstance(same, SeenPose) and np.allclose(same.local_J33, pose.local_J33, atol=1e-6)


def test_what_newer_senders_tell_besides_is_not_read() -> None:
    root = {"rotation": [0.0, 0.7, 0.0], "place": [0.2, 0.9, 1.4]}
    old = read_message(message(1, root=root)).content
    new = read_message(message(1, root={**root, "speed": 3}, hands=[[1]], version="1.2")).content
    assert isinstance(old, SeenPose) and isinstance(new, SeenPose) and old.root is not None and new.root is not None
    assert np.array_equal(new.local_J33, old.local_J33) and np.array_equal(new.root.turn_33, old.root.turn_33)
    assert read_message(message(1, "heartbeat", held=True, grip=0.5)).content == Heartbeat(True)
    told = {"set": "webxr", "names": ["left-arm-upper", "left-third-arm"], "points": [[1, 2, 3], [4, 5, 6]]}
    found = read_message(message(1, "landmarks", **told, radii=[0.1, 0.1])).content
    assert isinstance(found, Landmarks) and found.points == {"left_shoulder": (1, 2, 3)}


def test_mediapipe_has_y_down_and_z_away() -> None:
    points: list[Any] = [[0.1 * i, 0.2, 0.3] for i in range(33)]
    points[12] = None
    visibility = [1.0] * 33
    visibility[13] = 0.1
    told = message(1, "landmarks", set="mediapipe", points=points, visibility=visibility)
    found = read_message(told).content
    assert isinstance(found, Landmarks)
    assert found.points["left_shoulder"] == pytest.approx((1.1, -0.2, -0.3))
    assert not {"right_shoulder", "left_elbow"} & set(found.points), "missing, and not visible"


def test_webxr_has_its_own_names() -> None:
    names = ["left-arm-upper", "left-arm-lower", "left-hand-wrist", "root", "right-lower-leg"]
    told = message(1, "landmarks", set="webxr", names=names, points=[[i, 0, 0] for i in range(5)])
    found = read_message(told).content
    assert isinstance(found, Landmarks)
    assert found.points == {
        "left_shoulder": (0, 0, 0),
        "left_elbow": (1, 0, 0),
        "left_wrist": (2, 0, 0),
        "right_knee": (4, 0, 0),
    }


def test_pico_has_the_joints_of_smpl_and_two_hands() -> None:
    names = POINT_SETS["pico"].names
    assert (
        names is not None
        and len(names) == 24
        and names[0] == "pelvis"
        and names[22:] == ("left_middle", "right_middle")
    )
    found = read_message(message(1, "landmarks", set="pico", points=[[0, 1, i] for i in range(24)])).content
    assert isinstance(found, Landmarks) and found.points["right_wrist"] == (0, 1, 21)


GOOD = json.loads(message(1))
WRONG: list[tuple[str, Any]] = [
    ("malformed", {"session": ""}), ("malformed", {"session": 3}), ("malformed", {"session": "x" * 65}),
    ("malformed", {"number": -1}), ("malformed", {"number": 1.5}), ("malformed", {"number": True}), ("malformed", {"number": 2**60}),
    ("malformed", {"time": None}), ("malformed", {"time": "0"}), ("malformed", {"time": 1e300}),
    ("malformed", {"kind": "shutdown"}), ("malformed", {"kind": ["rotations"]}),
    ("version", {"mrhubo": 2}), ("version", {"mrhubo": True}), ("version", {"mrhubo": None}),
    ("malformed", {"rotations": REST[:-1]}), ("malformed", {"rotations": [[0, 0]] * 21}), ("malformed", {"rotations": None}),
    ("malformed", {"rotations": [[0, 0, 0, 0]] * 21}), ("malformed", {"rotations": [[1e9, 0, 0]] * 21}),
    ("malformed", {"rotations": [["0", 0, 0]] * 21}), ("malformed", {"rotations": [[0, 0, 0], *[[0, 0, 0, 1]] * 20]}),
    ("malformed", {"confidence": [1.0]}), ("malformed", {"confidence": [None] * 21}),
    ("malformed", {"kind": "heartbeat", "held": 1}), ("malformed", {"kind": "landmarks", "set": "nobody's", "points": []}),
    ("malformed", {"kind": "landmarks", "set": "mediapipe", "points": [[0, 0, 0]] * 32}),
    ("malformed", {"kind": "landmarks", "set": "mediapipe", "points": [[0, 0, 2000]] * 33}),
    ("malformed", {"kind": "landmarks", "set": "mediapipe", "points": [[0, 0]] * 33}),
    ("malformed", {"kind": "landmarks", "set": "named", "names": ["nose", "nose"], "points": [[0, 0, 0]] * 2}),
    ("malformed", {"kind": "landmarks", "set": "named", "names": ["n" * 99], "points": [[0, 0, 0]]}),
    ("malformed", {"kind": "landmarks", "set": "named", "names": ["nose"] * 300, "points": [[0, 0, 0]] * 300}),
]  # fmt: skip


@pytest.mark.parametrize(("fault", "changes"), WRONG)
def test_what_is_refused(fault: str, changes: dict[str, Any]) -> None:
    assert read_message(json.dumps(GOOD)).number == 1
    with pytest.raises(Refused, match=f"^{fault}$"):
        read_message(json.dumps({**GOOD, **changes}))


TEXTS: list[tuple[str, bytes]] = [
    ("malformed", b""), ("malformed", b"\xff\xfe\x00"), ("malformed", b"[]"), ("malformed", b"[" * 60_000), ("malformed", b'{"a":' * 10_000),
    ("malformed", message(1).replace(b"0.0", b"NaN")), ("malformed", message(1).replace(b"0.0", b"1e999")),
    ("malformed", message(1).replace(b"0.0", b"1" * 6_000, 1)), ("too_long", b" " * (MAX_BYTES + 1)),
]  # fmt: skip


@pytest.mark.parametrize(("fault", "data"), TEXTS)
def test_texts_that_are_refused(fault: str, data: bytes) -> None:
    with pytest.raises(Refused, match=f"^{fault}$"):
        read_message(data)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(sorted(GOOD) + ["points", "set", "held"]), inner, max_size=4),
    max_leaves=12,
)  # fmt: skip


@settings(max_examples=80, deadline=None)
@given(
    st.one_of(
        st.binary(max_size=60),
        st.dictionaries(
            st.sampled_from(sorted(GOOD) + ["points", "set", "names", "visibility", "held"]), JSON, max_size=5
        ),
    )
)
def test_no_other_error_whatever_comes(changes: Any) -> None:
    data = changes if isinstance(changes, bytes) else json.dumps({**GOOD, **changes})
    inbox = Inbox(0.25)
    try:
        read_message(data)
    except Refused as fault:
        assert str(fault) in FAULTS
        assert not inbox.offer(data, "a", 0.0) and inbox.counts[str(fault)] == 1 and inbox.take_frame() is None


# What of them is taken


def test_repeated_and_reordered_are_counted() -> None:
    inbox = Inbox(0.25)
    taken = [inbox.offer(message(number, time=0.0), "a", 0.0) for number in (5, 5, 4, 6, 0)]
    assert taken == [True, False, False, True, False] and inbox.counts["repeated"] == 3
    assert inbox.counts["superseded"] == 1 and inbox.counts["frames"] == 2


def test_late_frames_are_counted_and_clocks_may_drift() -> None:
    inbox = Inbox(0.25)
    assert inbox.offer(message(0, time=50.0), "a", 10.0)
    assert not inbox.offer(message(1, time=50.1), "a", 10.5) and inbox.counts["late"] == 1
    assert inbox.offer(message(2, time=50.5), "a", 10.5) and inbox.frame_at == 10.5
    assert inbox.offer(message(3, time=50.6), "a", 10.75) and inbox.frame_at == pytest.approx(10.6, abs=1e-3)
    drifting = Inbox(0.25)
    for second in range(4_000):  # half an hour and more; this clock runs 0.5 per thousand slow
        assert drifting.offer(Message("s", second, second * 0.9995, Nobody()), "a", float(second))


def test_who_was_held_up_takes_nothing_afterwards_for_late() -> None:
    inbox, clock = Inbox(0.25), [0.0]
    inbox.clock = lambda: clock[0]
    for number in range(200):
        sent = number / 40
        now = 1.0 if 1.0 < sent <= 1.4 else sent  # the period began, and then others had the processor
        clock[0] = max(sent, 1.4) if sent >= 1.0 else sent
        assert inbox.offer(beat(number, sent), "a", now) or 1.0 <= sent < 1.2
        if sent > 1.4:
            assert inbox.heartbeat_at == pytest.approx(clock[0])
    assert inbox.counts["late"] < 10


def test_one_sender_steers_until_it_is_silent_or_gone() -> None:
    inbox = Inbox(0.25)
    assert inbox.offer(message(0), "a", 0.0)
    assert not inbox.offer(message(0), "b", 0.5) and not inbox.offer(message(1, session="t"), "a", 0.5)
    assert inbox.counts["other_sender"] == 2
    assert inbox.offer(beat(0), "b", 0.5), "heartbeats may be another's"
    assert inbox.offer(message(0), "b", 1.2)
    assert not inbox.offer(message(1), "a", 1.3)
    inbox.gone("b")
    assert inbox.held is False and inbox.offer(message(1), "a", 1.3)
    assert not inbox.offer(message(0), "a", 9.0), "an old message is not taken again after a silence"


def test_a_clock_that_was_set_back_is_followed_after_a_silence() -> None:
    inbox = Inbox(0.25)
    assert inbox.offer(message(0, time=100.0), "a", 0.0)
    assert not inbox.offer(message(1, time=90.0), "a", 0.5)
    assert inbox.offer(message(2, time=90.6), "a", 1.1)


def test_it_holds_one_frame_and_few_senders_however_many_come() -> None:
    inbox = Inbox(0.25)
    for number in range(3_000):
        inbox.offer(Message("s", number, 0.0, Nobody()), f"a{number}", 2.0 * number)
    assert len(inbox._numbers) <= 64 and inbox.take_frame() is not None and inbox.take_frame() is None


def test_points_that_are_named() -> None:
    found = read_message(landmarks(1, {"nose": [1, 2, 3], "left_wrist": [4, 5, 6], "tail": [0, 0, 0]})).content
    assert isinstance(found, Landmarks) and found.points == {"nose": (1, 2, 3), "left_wrist": (4, 5, 6)}
