"""What Xsens MVN streams: the body that its file has, whichever way it comes."""

from __future__ import annotations

import socket
import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import mrhubo
from mrhubo import UserError
from mrhubo.body.joints import JOINT_NAMES, OFFSETS_J3, PARENTS
from mrhubo.fast.plain.human import norm, normalize
from mrhubo.fast.rotations import angles_between
from mrhubo.live.body import LEG_LENGTH, SeenPose
from mrhubo.live.endpoints import Endpoint
from mrhubo.live.inbox import Inbox
from mrhubo.live.messages import Refused
from mrhubo.live.sources.xsens import PORT, Segments, XsensSource
from mrhubo.motion.readers.xsens import SEGMENTS
from tests.motion.readers.test_mvnx import mvnx, subject
from tests.motion.readers.test_nymeria import FRAMES, JOINTS, TO_ROBOT, body

_ALL = tuple(range(1, len(SEGMENTS) + 1))


def datagram(
    frame: int, numbers: Sequence[int] = _ALL, kind: bytes = b"02", sample: int | None = None, character: int = 0,
    fingers: int = 0,
) -> bytes:  # fmt: skip
    """Segments of our body in a frame, by their numbers from 1 on."""
    place_TJ3, world_TJ33 = body()
    joints = [JOINT_NAMES.index(name) for name in JOINTS]
    places = place_TJ3[frame][joints] @ TO_ROBOT.T
    turns = np.roll(Rotation.from_matrix(TO_ROBOT @ world_TJ33[frame][joints] @ TO_ROBOT.T).as_quat(), 1, axis=1)
    data = b"".join(struct.pack(">I7f", number, *places[number - 1], *turns[number - 1]) for number in numbers)
    data += b"".join(struct.pack(">I7f", 24 + number, 1, 2, 3, 1, 0, 0, 0) for number in range(fingers))
    items = len(numbers) + fingers
    head = struct.pack(
        ">IBBIBBBBHH", frame if sample is None else sample, 0x80, items, 17, character, 23, 0, fingers, 0, len(data)
    )
    return b"MXTP" + kind + head + data


def seen(*datagrams: bytes) -> SeenPose:
    """The body after datagrams, of which the last makes it whole."""
    segments = Segments()
    told = [segments.take(data) for data in datagrams]
    assert told == [False] * (len(told) - 1) + [True]
    assert isinstance(segments.content, SeenPose)
    return segments.content


def test_parts_are_turned_and_limbs_point_as_the_bodys() -> None:
    place_TJ3, world_TJ33 = body()
    for frame in range(FRAMES):
        pose = seen(datagram(frame))
        assert pose.root is not None and pose.root.place_3 is not None and (pose.sure_J == 1).all()
        turns = {0: pose.root.turn_33}
        for joint in range(1, 22):
            turns[joint] = turns[PARENTS[joint]] @ pose.local_J33[joint - 1]
        for name in ("pelvis", "spine1", "spine2", "spine3", "neck", "head", "left_wrist", "right_ankle"):
            joint = JOINT_NAMES.index(name)
            assert angles_between(turns[joint][None].astype(float), world_TJ33[frame, joint][None]).max() < 1e-3, name
        for start, end in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle")):
            i, j = JOINT_NAMES.index(f"left_{start}"), JOINT_NAMES.index(f"left_{end}")
            way_3 = normalize(place_TJ3[frame, j] - place_TJ3[frame, i])
            np.testing.assert_allclose(turns[i] @ normalize(OFFSETS_J3[j - 1].astype(float)), way_3, atol=1e-5)
        left = [JOINT_NAMES.index(f"left_{joint}") for joint in ("hip", "knee", "ankle")]
        leg = float(norm(np.diff(place_TJ3[frame, left], axis=0)).sum())
        np.testing.assert_allclose(pose.root.place_3, place_TJ3[frame, 0] * LEG_LENGTH / leg, atol=1e-3)


def test_it_is_what_the_file_of_the_same_body_has(tmp_path: Path) -> None:
    (tmp_path / "dance.mvnx").write_text(mvnx(subject()))
    motion = mrhubo.read_motion(tmp_path / "dance.mvnx")
    chest = JOINT_NAMES.index("spine3")
    for frame in range(FRAMES):
        pose, there = seen(datagram(frame)), motion.arrays.local_TJ33[frame]
        for name in ("left_wrist", "right_wrist", "left_ankle", "head"):
            here, file = np.eye(3), np.eye(3)
            joint = JOINT_NAMES.index(name)
            while joint > 0 and joint != chest:
                here, file = pose.local_J33[joint - 1] @ here, there[joint - 1] @ file
                joint = PARENTS[joint]
            assert angles_between(here[None].astype(float), file[None].astype(float)).max() < 2e-3, name


def test_a_sample_in_several_datagrams_is_one_body() -> None:
    whole = seen(datagram(3))
    first, last = _ALL[:9], _ALL[9:]
    parts = seen(datagram(3, first), datagram(3, last, fingers=40))
    np.testing.assert_array_equal(parts.local_J33, whole.local_J33)
    late = seen(datagram(2, first), datagram(3, last), datagram(3, first))  # of another sample, the first is left out
    np.testing.assert_array_equal(late.local_J33, whole.local_J33)


def test_other_kinds_and_other_bodies_are_passed_over() -> None:
    segments = Segments()
    assert not segments.take(datagram(0, kind=b"25")) and segments.take(datagram(0, character=1))
    assert not segments.take(datagram(1, character=2))
    assert isinstance(segments.content, SeenPose) and segments.dropped == 0
    np.testing.assert_array_equal(segments.content.local_J33, seen(datagram(0)).local_J33)
    mixed = Segments()
    assert not mixed.take(datagram(0, _ALL[:9], character=1)) and not mixed.take(datagram(0, _ALL[9:], character=2))


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"MXTP02",
        b"OTHER!" + datagram(0)[6:],
        datagram(0)[:-1],
        datagram(0)[:28] + struct.pack(">f", np.nan) + datagram(0)[32:],
        datagram(0)[:40] + bytes(16) + datagram(0)[56:],
        datagram(0)[:28] + struct.pack(">f", 1e9) + datagram(0)[32:],
    ],
)
def test_what_is_none_of_it_is_refused_and_changes_nothing(data: bytes) -> None:
    segments = Segments()
    assert segments.take(datagram(0))
    with pytest.raises(Refused, match="malformed"):
        segments.take(data)
    assert isinstance(segments.content, SeenPose)
    np.testing.assert_array_equal(segments.content.local_J33, seen(datagram(0)).local_J33)
    with pytest.raises(Refused, match="too_long"):
        segments.take(bytes(70_000))


@given(st.one_of(st.binary(max_size=900), st.binary(max_size=900).map(lambda tail: b"MXTP02" + tail)))
def test_whatever_is_sent_is_read_or_refused(data: bytes) -> None:
    segments = Segments()
    try:
        if segments.take(data):
            assert isinstance(segments.content, SeenPose) and np.isfinite(segments.content.local_J33).all()
    except Refused as fault:
        assert str(fault) == "malformed"


def test_a_sender_on_this_machine_is_heard_and_none_elsewhere() -> None:
    with pytest.raises(UserError, match=r"--source xsens:0\.0\.0\.0:9763: MVN's stream has no token"):
        XsensSource(Endpoint("0.0.0.0", PORT))
    source, inbox = XsensSource(Endpoint("127.0.0.1", 0)), Inbox(0.25)
    source.open()
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for data in (datagram(0), b"noise", datagram(1)):
                sender.sendto(data, ("127.0.0.1", source.endpoint.port))
            source.read(inbox, 0.0)
    finally:
        source.close()
    assert inbox.counts["frames"] == 1 and inbox.counts["malformed"] == 1
    frame = inbox.take_frame()
    assert isinstance(frame, SeenPose)
    np.testing.assert_array_equal(frame.local_J33, seen(datagram(1)).local_J33)
