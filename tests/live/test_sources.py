"""Streams of other programs: VMC against a skeleton of its own in Unity's axes, and PICO's joints."""

from __future__ import annotations

import socket
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("pythonosc")
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder

from mrhubo import rotation
from mrhubo.body.joints import JOINT_NAMES, PARENTS, POSED_JOINT_NAMES, REST_K3
from mrhubo.body.skeleton import Skeleton
from mrhubo.errors import UserError
from mrhubo.live.body import LEG_LENGTH, Body, SeenPose
from mrhubo.live.endpoints import Endpoint
from mrhubo.live.inbox import Inbox
from mrhubo.live.messages import Landmarks, Nobody, Refused
from mrhubo.live.sources import vmc
from mrhubo.live.sources.pico import PicoSource, to_landmarks
from mrhubo.live.sources.udp import Datagrams
from mrhubo.live.sources.vmc import ADDRESS, BONES, Bones, VmcSource

UNITY = {"pelvis": "Hips", **{joint: bone for bone, joint in BONES.items()}}
UNITY_OFFSETS = {
    name: (REST_K3[i] - (REST_K3[PARENTS[i]] if i else 0)) * [-1.0, 1.0, 1.0] for i, name in enumerate(JOINT_NAMES)
}
"""Our skeleton in Unity's axes: x to the right, y up, z forward, where the avatar looks."""


def osc(bone: str, xyzw: Any, address: str = ADDRESS, place: Any = (0.0, 1.0, 0.0), more: Any = ()) -> Any:
    builder = OscMessageBuilder(address)
    for value in (bone, *map(float, place), *map(float, xyzw), *more):
        builder.add_arg(value)
    return builder.build()


def bundled(*elements: bytes) -> bytes:
    """A bundle of OSC to be taken at once."""
    return b"#bundle\0" + (1).to_bytes(8) + b"".join(len(element).to_bytes(4) + element for element in elements)


def rotate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A vector turned by a quaternion x, y, z, w, by the formula of quaternions, which knows no handedness."""
    u, w = q[:3], q[3]
    return v + 2 * w * np.cross(u, v) + 2 * np.cross(u, np.cross(u, v))


def times(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    vector = p[3] * q[:3] + q[3] * p[:3] + np.cross(p[:3], q[:3])
    return np.append(vector, p[3] * q[3] - p[:3] @ q[:3])


def unity_places(local: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Where Unity draws the joints of an avatar, by its own chain of transforms."""
    turn, place = {"pelvis": np.array([0.0, 0, 0, 1])}, {"pelvis": np.zeros(3)}
    for i, name in enumerate(JOINT_NAMES[1:], start=1):
        above = JOINT_NAMES[PARENTS[i]]
        place[name] = place[above] + rotate(turn[above], UNITY_OFFSETS[name])
        turn[name] = times(turn[above], local.get(name, np.array([0.0, 0, 0, 1])))
    return place


def test_an_avatar_is_where_unity_draws_it() -> None:
    generator = np.random.default_rng(3)
    local = {name: generator.normal(size=4) + [0, 0, 0, 2] for name in POSED_JOINT_NAMES}
    local = {name: q / np.linalg.norm(q) for name, q in local.items()}
    bundle = OscBundleBuilder(IMMEDIATELY)  # pyright: ignore
    for name, xyzw in local.items():
        bundle.add_content(osc(UNITY[name], xyzw))
    bones = Bones()
    assert bones.take(bundle.build().dgram)
    ours_K3 = Skeleton().keypoints(torch.from_numpy(bones.pose.local_J33[None]))[0].numpy()
    for i, name in enumerate(JOINT_NAMES):
        assert np.allclose(ours_K3[i], unity_places(local)[name] * [-1, 1, 1], atol=1e-5), name


def test_a_left_arm_that_is_lowered_in_unity_is_our_left_arm_lowered() -> None:
    bones, down = Bones(), np.radians(80)
    bones.take(osc("LeftUpperArm", [0, 0, np.sin(down / 2), np.cos(down / 2)]).dgram)  # about z: its arm points to -x
    ours_K3 = Skeleton().keypoints(torch.from_numpy(bones.pose.local_J33[None]))[0].numpy()
    way = ours_K3[JOINT_NAMES.index("left_wrist")] - ours_K3[JOINT_NAMES.index("left_shoulder")]
    assert way[1] < -0.9 * np.linalg.norm(way) and way[0] > 0
    sure_J = bones.pose.sure_J
    assert sure_J[POSED_JOINT_NAMES.index("left_shoulder")] == 1 and sure_J[POSED_JOINT_NAMES.index("right_elbow")] == 0


def test_hips_and_the_avatars_place_are_the_root() -> None:
    """As Unity draws them, mirrored; of an avatar whose legs are half as long as our skeleton's, twice as far away."""
    generator, bones = np.random.default_rng(4), Bones()
    assert bones.take(osc("LeftHand", [0, 0, 0, 1]).dgram) and bones.pose.root is None
    turns = [q / np.linalg.norm(q) for q in generator.normal(size=(2, 4)) + [0, 0, 0, 2]]
    places = [np.array([0.3, 0.9, -0.2]), np.array([2.0, 0.1, 5.0])]
    assert bones.take(osc("Hips", turns[0], place=places[0]).dgram)
    root = bones.pose.root
    assert root is not None and root.place_3 is not None
    np.testing.assert_allclose(root.place_3, places[0] * [-1, 1, 1], atol=1e-6)
    assert bones.take(osc("avatar", turns[1], vmc.ROOT, places[1]).dgram)
    legs = {name: LEG_LENGTH / 4 for name in ("LeftLowerLeg", "LeftFoot")}
    for name, length in legs.items():
        bones.take(osc(name, [0, 0, 0, 1], place=[0.0, -length, 0.0]).dgram)
    root = bones.pose.root
    assert root is not None and root.place_3 is not None
    wanted_3 = places[1] + rotate(turns[1], places[0])
    np.testing.assert_allclose(root.place_3, 2 * wanted_3 * [-1, 1, 1], atol=1e-5)
    both = times(turns[1], turns[0])
    for axis_3 in np.eye(3):
        np.testing.assert_allclose(root.turn_33 @ (axis_3 * [-1, 1, 1]), rotate(both, axis_3) * [-1, 1, 1], atol=1e-6)


@pytest.mark.parametrize("place", [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, 1e6]])
@pytest.mark.parametrize(("bone", "address"), [("Hips", ADDRESS), ("avatar", vmc.ROOT), ("LeftFoot", ADDRESS)])
def test_places_that_are_none_are_refused(place: list[float], bone: str, address: str) -> None:
    bones = Bones()
    bones.take(osc("Hips", [0, 0, 0, 1], place=[0, 1, 0]).dgram)
    assert not bones.take(osc(bone, [0, 0, 0, 1], address, place).dgram) and bones.dropped == 1
    root = bones.pose.root
    assert root is not None and root.place_3 is not None and root.place_3.tolist() == [0, 1, 0]


@pytest.mark.parametrize("more", [(1.0, 1.0, 1.0, 0.0, 0.0, 0.0), ("later",)])
def test_what_newer_versions_tell_after_the_arguments_is_not_read(more: Any) -> None:
    """Version 2.1 tells the avatar's scale and offset after its place, in one bundle with the bones."""
    unit, turned = [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.5, np.sqrt(0.75)]
    messages: list[Any] = [
        ("root", unit, vmc.ROOT, (1, 0, 2)),
        ("Hips", turned),
        ("LeftUpperArm", turned),
        ("LeftFoot", unit),
    ]
    old, new = Bones(), Bones()
    assert old.take(bundled(*(osc(*message).dgram for message in messages)))
    assert new.take(bundled(*(osc(*message, **{"more": more}).dgram for message in messages))) and new.dropped == 0
    assert np.array_equal(new.pose.local_J33, old.pose.local_J33) and np.array_equal(new.pose.sure_J, old.pose.sure_J)
    root, expected = new.pose.root, old.pose.root
    assert root is not None and expected is not None and root.place_3 is not None and expected.place_3 is not None
    assert np.array_equal(root.turn_33, expected.turn_33) and np.array_equal(root.place_3, expected.place_3)


@pytest.mark.parametrize(
    "bad",
    [
        osc("root", [0, 0, 0], vmc.ROOT).dgram,
        osc("root", [0, 0, 0, 0], vmc.ROOT).dgram,
        osc("Hips", [0, 0, 0, 1], place=[0, np.nan, 0]).dgram,
        osc("LeftFoot", [0, 0, 0, 1], place=[0, 1e9, 0]).dgram,
        osc("LeftFoot", [0, 0, 0, 1]).dgram[:-8],  # arguments are missing
        osc("x", [0, 0, 0, 1], "/VMC/Ext/Other").dgram[:-8],
        b"none",
        b"",
    ],
)
def test_a_bad_message_is_dropped_alone(bad: bytes) -> None:
    bones = Bones()
    other = osc("x", [0, 0, 0, 1], "/VMC/Ext/Other").dgram
    arm, hips = osc("LeftUpperArm", [0, 0, 0.5, np.sqrt(0.75)]).dgram, osc("Hips", [0, 0, 0, 1]).dgram
    assert bones.take(bundled(bad, arm, other, bundled(bundled(hips), bad)))
    assert bones.dropped == 2 and bones.pose.root is not None
    assert bones.pose.sure_J[POSED_JOINT_NAMES.index("left_shoulder")] == 1
    with pytest.raises(Refused, match="malformed"):
        bones.take(bundled(arm)[:-4])


@pytest.fixture
def source() -> Any:
    found = VmcSource(Endpoint("127.0.0.1", 0))
    found.open()
    yield found
    found.close()


def test_datagrams_between_two_periods_are_one_frame(source: VmcSource) -> None:
    inbox, unit = Inbox(0.25), [0.0, 0.0, 0.0, 1.0]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        wrong = [osc("LeftHand", [0, 0, 0, 0]), osc("LeftHand", [9, 9, 9, 9]), osc("LeftHand", [0, 0, 1])]
        for data in (
            osc("LeftUpperArm", unit),
            osc("RightUpperArm", unit),
            osc("Tail", unit),
            osc("x", unit, "/other"),
            *wrong,
        ):
            sender.sendto(data.dgram, ("127.0.0.1", source.endpoint.port))
        sender.sendto(b"\0\1garbage", ("127.0.0.1", source.endpoint.port))
        source.read(inbox, 0.0)
        assert inbox.counts["frames"] == 1 and inbox.counts["malformed"] == 4
        source.read(inbox, 0.1)
        assert inbox.counts["frames"] == 1


def test_two_avatars_do_not_become_one(source: VmcSource) -> None:
    inbox, unit, turned = Inbox(0.25), [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.6, 0.8]
    address = ("127.0.0.1", source.endpoint.port)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as two,
    ):
        two.sendto(b"garbage", address)  # steers nothing
        for step in range(3):
            one.sendto(osc("LeftUpperArm", unit).dgram, address)
            two.sendto(osc("RightUpperArm", turned).dgram, address)
            source.read(inbox, 0.1 * step)
        assert inbox.counts["frames"] == 3 and inbox.counts["other_sender"] == 3
        assert np.isfinite(source._feed._at_J).sum() == 1
        two.sendto(osc("RightUpperArm", turned).dgram, address)
        source.read(inbox, 2.0)  # the first one has been silent
        one.sendto(osc("LeftUpperArm", unit).dgram, address)
        source.read(inbox, 2.1)
    assert inbox.counts["frames"] == 4 and inbox.counts["other_sender"] == 4
    seen = inbox.take_frame()
    assert isinstance(seen, SeenPose)
    shoulders = [seen.sure_J[POSED_JOINT_NAMES.index(f"{side}_shoulder")] for side in ("left", "right")]
    assert shoulders == [0, 1], "nothing of the first avatar is left"


def test_a_datagram_of_too_many_messages_is_refused_whole() -> None:
    arm = osc("LeftUpperArm", [0, 0, 0.6, 0.8]).dgram
    assert Bones().take(bundled(*[arm] * 300))
    for datagram in (bundled(*[b""] * 10_000), bundled(*[bundled(*[arm] * 100)] * 6)):
        bones = Bones()
        with pytest.raises(Refused, match="too_long"):
            bones.take(datagram)
        assert not np.isfinite(bones._at_J).any()


def test_a_flood_leaves_time_for_the_robot() -> None:
    """Whatever comes, and however fast: a session that reads for long tells the robot nothing meanwhile."""
    datagrams, came = Datagrams(Endpoint("127.0.0.1", 0)), []
    for size in (60_000, 10):
        datagrams._socket = SimpleNamespace(recvfrom=lambda most, size=size: (b"x" * size, ("127.0.0.1", 1)))  # pyright: ignore
        came.clear()
        datagrams.read(lambda data, sender: came.append(len(data)))
        assert sum(came) <= 200_000 and len(came) <= 512


@settings(max_examples=60, deadline=None)
@given(st.one_of(st.binary(max_size=80), st.binary(max_size=40).map(lambda tail: b"#bundle\0" + tail), st.binary(max_size=40).map(lambda tail: ADDRESS.encode() + b"\0\0\0,sfffffff\0\0\0" + tail)))  # fmt: skip
def test_whatever_is_sent_is_read_or_refused(data: bytes) -> None:
    bones = Bones()
    try:
        bones.take(data)
    except Refused as fault:
        assert str(fault) == "malformed"
        assert not np.isfinite(bones._at_J).any()
    assert np.isfinite(bones.pose.local_J33).all()


def test_vmc_stays_on_this_machine() -> None:
    with pytest.raises(UserError, match="no token"):
        VmcSource(Endpoint("0.0.0.0", vmc.PORT))


# PICO


def rows(pose: torch.Tensor) -> np.ndarray:
    """What the SDK gives of a person of our skeleton: its joints and the middle of its hands, with any rotations."""
    place_K3 = Skeleton().keypoints(pose[None])[0].numpy()
    from mrhubo.body.joints import KEYPOINT_NAMES

    hands = [KEYPOINT_NAMES.index(f"{side}_middle") for side in ("left", "right")]
    turned = np.concatenate([place_K3[:22], place_K3[hands]]) @ np.diag([-1.0, 1.0, -1.0])  # the person looks at us
    return np.concatenate([turned + [1.0, 0.5, 2.0], np.full((24, 4), 0.5)], axis=1)


def test_pico_joints_become_the_pose_that_they_are_of() -> None:
    turns = torch.zeros(21, 3)
    for name, turn in (("left_shoulder", (0.2, 0.3, -0.9)), ("left_elbow", (0, -0.8, 0)), ("right_elbow", (0, 1.2, 0))):
        turns[POSED_JOINT_NAMES.index(name)] = torch.tensor(turn)
    pose = rotation.axis_angle_to_matrix(turns)
    content = to_landmarks(rows(pose))
    found = Body().see(content.points, content.sure)
    assert isinstance(found, SeenPose)
    wanted_K3, seen_K3 = (
        Skeleton().keypoints(local[None])[0].numpy() for local in (pose, torch.from_numpy(found.local_J33))
    )
    for side in ("left", "right"):
        for start, end in (("shoulder", "elbow"), ("elbow", "wrist")):
            ways = [
                k[JOINT_NAMES.index(f"{side}_{end}")] - k[JOINT_NAMES.index(f"{side}_{start}")]
                for k in (wanted_K3, seen_K3)
            ]
            assert np.allclose(*ways, atol=2e-3), (side, end)


def test_pico_numbers_that_a_newer_sdk_adds_are_not_read() -> None:
    old = rows(torch.eye(3).expand(21, 3, 3))
    assert to_landmarks(np.concatenate([old, np.full((24, 2), np.nan)], axis=1)) == to_landmarks(old)


@pytest.mark.parametrize(
    "poses",
    [None, [], "x", np.zeros((23, 7)), np.zeros((24, 6)), np.zeros(24), np.full((24, 7), np.nan), [[1, 2]] * 24],
)
def test_pico_what_is_no_pose(poses: Any) -> None:
    with pytest.raises(Refused):
        to_landmarks(poses)


def test_pico_an_sdk_that_fails_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing() -> bool:
        raise RuntimeError("the service has gone")

    sdk = SimpleNamespace(init=lambda: None, close=lambda: None, is_body_data_available=failing)
    monkeypatch.setitem(sys.modules, "xrobotoolkit_sdk", sdk)
    source = PicoSource()
    source.open()
    with pytest.raises(UserError, match="--source pico: .* the service has gone"):
        source.read(Inbox(0.25), 0.0)


class PicoSdk:
    """The SDK 1.1 as it was seen to behave, beside a service that sends what the app in the headset does: a body is told
    for ever after the first one, and never a body's own time, unless the app gives it."""

    def __init__(self) -> None:
        self.calls: list[str] = []
        self.body: list[list[float]] | None = None
        self.stamp, self.joint_stamps = 0, [0] * 24

    def init(self) -> None:
        self.calls.append("init")

    def close(self) -> None:
        self.calls.append("close")

    def is_body_data_available(self) -> bool:
        return self.body is not None

    def get_body_joints_pose(self) -> list[list[float]]:
        return [list(row) for row in self.body or [[0.0] * 7] * 24]

    def get_body_timestamp_ns(self) -> int:
        return self.stamp

    def get_body_joints_timestamp(self) -> list[int]:
        return list(self.joint_stamps)


def test_pico_is_followed_as_long_as_the_headset_tells_something_new(monkeypatch: pytest.MonkeyPatch) -> None:
    sdk = PicoSdk()
    monkeypatch.setitem(sys.modules, "xrobotoolkit_sdk", sdk)
    source, inbox = PicoSource(), Inbox(0.25)
    now = iter(np.arange(100) / 60)
    source.open()
    source.read(inbox, next(now))
    assert isinstance(inbox.take_frame(), Nobody)
    seen = rows(torch.eye(3).expand(21, 3, 3))
    for step in range(5):  # without any time of the body
        sdk.body = (seen + 1e-6 * step).tolist()
        source.read(inbox, next(now))
        frame = inbox.take_frame()
        assert isinstance(frame, Landmarks) and frame.points["pelvis"][0] == seen[0, 0] + 1e-6 * step
    before = inbox.counts["frames"]
    for _ in range(5):  # the headset has gone
        source.read(inbox, next(now))
    assert inbox.counts["frames"] == before
    sdk.joint_stamps[3] += 1  # who stands still to the last digit is seen yet
    source.read(inbox, next(now))
    sdk.stamp += 1
    source.read(inbox, next(now))
    assert inbox.counts["frames"] == before + 2
    source.close()
    source.close()
    assert sdk.calls == ["init", "close"]
    monkeypatch.setitem(sys.modules, "xrobotoolkit_sdk", None)
    with pytest.raises(UserError, match=r"pip install 'mrhubo\[pico\]'"):
        PicoSource()
