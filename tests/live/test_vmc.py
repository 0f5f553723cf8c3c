"""VMC as programs send it, written out byte by byte: whatever form they send it in, the avatar is the same."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pythonosc")

from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo.body.joints import POSED_JOINT_NAMES, SIDES
from mrhubo.live.body import SeenPose
from mrhubo.live.endpoints import Endpoint
from mrhubo.live.inbox import Inbox
from mrhubo.live.messages import Nobody
from mrhubo.live.sources.vmc import ADDRESS, BONES, ROOT, STATUS, Bones, VmcSource

Avatar = dict[str, tuple[np.ndarray, np.ndarray]]
"""Places [m] and rotations x, y, z, w of bones, each seen from the one above it, in Unity's axes."""
UNIT = np.array([0.0, 0.0, 0.0, 1.0])
LIMBS = {f"{side}_{name}" for side in SIDES for name in ("shoulder", "elbow", "hip", "knee")}


def padded(text: bytes) -> bytes:
    return text + b"\0" * (4 - len(text) % 4)


def osc(address: str, *told: Any) -> bytes:
    """A message: texts, whole numbers and floats."""
    kinds = "".join("s" if isinstance(value, str) else "i" if isinstance(value, int) else "f" for value in told)
    values = (
        padded(value.encode())
        if isinstance(value, str)
        else struct.pack(">i" if isinstance(value, int) else ">f", value)
        for value in told
    )
    return padded(address.encode()) + padded(f",{kinds}".encode()) + b"".join(values)


def bundled(*elements: bytes, at: int = 1) -> bytes:
    return b"#bundle\0" + at.to_bytes(8) + b"".join(len(element).to_bytes(4) + element for element in elements)


def make_avatar(seed: int = 0) -> Avatar:
    generator = np.random.default_rng(seed)

    def turn() -> np.ndarray:
        quaternion = generator.normal(size=4) + [0, 0, 0, 3]
        return quaternion / np.linalg.norm(quaternion)

    return {bone: (generator.uniform(0.1, 0.5, 3), turn()) for bone in ("Hips", *BONES, "LeftEye", "LeftIndexProximal")}


def told(avatar: Avatar, name: Callable[[str], str] = str, number: Callable[[float], Any] = float) -> list[bytes]:
    return [
        osc(ADDRESS, name(bone), *map(number, place.tolist()), *map(number, turn.tolist()))
        for bone, (place, turn) in avatar.items()
    ]


ROOT_20 = osc(ROOT, "root", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
ROOT_21 = osc(ROOT, "root", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
FACE = [osc("/VMC/Ext/Blend/Val", "Joy", 0.25), osc("/VMC/Ext/Blend/Apply")]
DEVICES = [
    osc("/VMC/Ext/Cam", "Camera", 0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 1.0, 60.0),
    osc("/VMC/Ext/Hmd/Pos", "LHR-1", 0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 1.0),
]


def in_parts(avatar: Avatar) -> list[bytes]:
    """As Virtual Motion Capture does: 13 bones a bundle, the last of them in a bundle with root, camera and state."""
    bones = told(avatar)
    parts = [bundled(*bones[start : start + 13]) for start in range(0, len(bones) - 13, 13)]
    rest = bundled(*bones[13 * len(parts) :])
    more = [ROOT_21, rest, *DEVICES, osc(STATUS, 1, 3, 0), osc("/VMC/Ext/T", 12.5)]
    return [*parts, bundled(*FACE), bundled(*more)]


SENDERS: dict[str, Callable[[Avatar], list[bytes]]] = {
    "one message a datagram": lambda avatar: [osc(STATUS, 1), osc("/VMC/Ext/T", 1.0), ROOT_20, *told(avatar), *FACE],
    "bundles of 13": in_parts,
    "one bundle, with a time": lambda avatar: [bundled(osc(STATUS, 1), ROOT_20, *told(avatar), at=3_900_000_000 << 32)],
    "state with tracking": lambda avatar: [bundled(osc(STATUS, 1, 3, 0, 1), *told(avatar), *FACE)],
    "no state": told,
    "names of VRM": lambda avatar: [bundled(*told(avatar, lambda bone: bone[0].lower() + bone[1:]))],
    "whole numbers where they are": lambda avatar: told(avatar, number=lambda v: int(v) if v.is_integer() else v),
}


def pose_of(datagrams: list[bytes], bones: Bones | None = None) -> SeenPose:
    bones = bones or Bones()
    for datagram in datagrams:
        bones.take(datagram)
    assert bones.dropped == 0 and bones.shows_somebody
    return bones.pose


@pytest.mark.parametrize("sender", SENDERS)
def test_every_form_is_the_same_avatar(sender: str) -> None:
    avatar = make_avatar() | {"Neck": (np.array([0.0, 1.0, 0.0]), UNIT)}
    found, expected = (pose_of(SENDERS[form](avatar)) for form in (sender, "one message a datagram"))
    assert np.array_equal(found.local_J33, expected.local_J33) and (found.sure_J == 1).all()
    assert found.root is not None and expected.root is not None
    assert found.root.place_3 is not None and expected.root.place_3 is not None
    assert np.array_equal(found.root.turn_33, expected.root.turn_33)
    assert np.array_equal(found.root.place_3, expected.root.place_3)


@settings(max_examples=30, deadline=None)
@given(st.sets(st.sampled_from(sorted(BONES))), st.booleans())
def test_limbs_that_are_never_sent_are_not_sure(missing: set[str], small: bool) -> None:
    avatar = {bone: at for bone, at in make_avatar().items() if bone not in missing}
    pose = pose_of([bundled(*told(avatar, str.lower if small else str))])
    for place, joint in enumerate(POSED_JOINT_NAMES):
        assert pose.sure_J[place] == (joint not in LIMBS or joint not in {BONES[bone] for bone in missing})


def test_limbs_that_come_no_more_are_not_sure_until_they_come_again() -> None:
    bones, avatar = Bones(), make_avatar()
    left = {bone: at for bone, at in avatar.items() if not bone.startswith("Right")}
    expected = pose_of([bundled(*told(avatar))]).local_J33
    for now, sent, gone in (
        (0.0, avatar, False),
        (0.4, left, False),
        (0.6, left, True),
        (60.0, left, True),
        (60.1, avatar, False),
    ):
        bones.take(bundled(*told(sent)), now)
        unsure = {joint for joint, sure in zip(POSED_JOINT_NAMES, bones.pose.sure_J, strict=True) if not sure}
        assert unsure == ({joint for joint in LIMBS if joint.startswith("right")} if gone else set())
        assert np.array_equal(bones.pose.local_J33, expected), "it stays where it was"


WAITING = [(0,), (0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 2, 2), (1, 3, 0, 0)]


@pytest.mark.parametrize("state", WAITING)
def test_an_avatar_that_its_sender_does_not_move_is_nobody(state: tuple[int, ...]) -> None:
    """It stands in its T-pose until its model is loaded and calibrated, and wherever it was where nobody is tracked."""
    source, inbox = VmcSource(Endpoint("127.0.0.1", 0)), Inbox(0.25)
    t_pose = {bone: (place, UNIT) for bone, (place, _) in make_avatar().items()}
    datagrams: list[bytes] = []
    source._datagrams.read = lambda take: [take(datagram, "udp:127.0.0.1:5") for datagram in datagrams]  # pyright: ignore

    def seen(now: float, *told_now: bytes) -> Any:
        datagrams[:] = told_now
        source.read(inbox, now)
        return inbox.take_frame()

    assert isinstance(seen(0.0, bundled(osc(STATUS, *state), *told(t_pose))), Nobody)
    assert isinstance(seen(0.1, *told(t_pose)), Nobody), "a state holds until another one comes"
    assert seen(0.2, osc(STATUS, *state)) is None
    assert isinstance(seen(0.3, osc(STATUS, 1, 3, 0), *told(make_avatar())), SeenPose)
    assert isinstance(seen(0.4, bundled(*told(make_avatar()), osc(STATUS, *state))), Nobody)


@pytest.mark.parametrize("state", [(), ("1",), (1, "3")])
def test_a_state_that_is_none_is_dropped(state: tuple[Any, ...]) -> None:
    bones = Bones()
    bones.take(osc(STATUS, 0))
    bones.take(osc(STATUS, *state))
    assert bones.dropped == 1 and not bones.shows_somebody
