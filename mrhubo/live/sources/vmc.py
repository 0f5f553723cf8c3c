"""The Virtual Motion Capture protocol: rotations of an avatar's bones, as OSC messages over UDP.

Protocol: https://protocol.vmc.info/english (`/VMC/Ext/Bone/Pos` with the name of a Unity humanoid bone, its position
and its rotation, both relative to the bone above it; `/VMC/Ext/Root/Pos` with the place of the whole avatar, and from
version 2.1 on its scale and offset for mixed reality, which are not read). Unity's axes are left-handed: x to the
right, y up, z forward, which is where an avatar looks. Mirrored in x they are ours. A bone's rotation refers to the
avatar's T-pose, in which VRM has all rotations 0, as our rest pose has.
`/VMC/Ext/OK` tells whether a model is loaded, whether it is calibrated, and whether the sender sees its person; what is
not told is so. An avatar that waits for that stands in its T-pose, which nobody shows.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mrhubo.body.joints import POSED_JOINT_NAMES, SIDES
from mrhubo.lazy import import_optional
from mrhubo.live.body import LEG_LENGTH, Root, SeenPose
from mrhubo.live.endpoints import Endpoint
from mrhubo.live.messages import MAX_BYTES, Content, Nobody, Refused, numbers, of_quaternions, quaternion
from mrhubo.live.sources.tokenless import TokenlessSource

PORT = 39_539
"""On which programs that receive VMC listen by default."""
ADDRESS, ROOT, STATUS = "/VMC/Ext/Bone/Pos", "/VMC/Ext/Root/Pos", "/VMC/Ext/OK"
_CALIBRATED = 3
_ARGUMENTS = 8
"""Name, position and rotation. What newer versions of the protocol tell after them is not read."""
_MOST_MESSAGES = 512
"""Of one datagram: an avatar has some sixty bones, and some hundred other values."""
_BUNDLE, _BUNDLE_HEADER, _SIZE = b"#bundle\0", 16, 4
"""How a bundle of OSC begins, and bytes: before its first element, and of an element's size."""
_CENTRAL = {"Spine": "spine1", "Chest": "spine2", "UpperChest": "spine3", "Neck": "neck", "Head": "head"}
_SIDED = {
    "Shoulder": "collar", "UpperArm": "shoulder", "LowerArm": "elbow", "Hand": "wrist",
    "UpperLeg": "hip", "LowerLeg": "knee", "Foot": "ankle", "Toes": "foot",
}  # fmt: skip
BONES = {
    **_CENTRAL,
    **{f"{side.capitalize()}{bone}": f"{side}_{joint}" for side in SIDES for bone, joint in _SIDED.items()},
}
"""Our joints, by Unity's names of bones."""
_HIPS, _LEG = "hips", ("leftlowerleg", "leftfoot")
"""The bone of the pelvis, and the bones whose positions tell how long a leg is."""
_SHORTEST_LEG = 0.05
_FARTHEST = 1e3
_SILENT = 0.5
"""Seconds without a bone, while others come, after which it is not seen: as of a tracker that has lost its limb."""
_PLACE = {bone.lower(): POSED_JOINT_NAMES.index(joint) for bone, joint in BONES.items()}
"""Whatever their letters' case: VRM writes the same names with a small first letter."""
_LIMBS = [POSED_JOINT_NAMES.index(f"{side}_{name}") for side in SIDES for name in ("shoulder", "elbow", "hip", "knee")]


class Bones:
    """The newest rotations of an avatar's bones."""

    def __init__(self) -> None:
        self._xyzw_J4 = np.tile([0.0, 0.0, 0.0, 1.0], (len(POSED_JOINT_NAMES), 1))
        self._at_J = np.full(len(POSED_JOINT_NAMES), -math.inf)
        """When each came last [s]."""
        self._now = 0.0
        self._poses: dict[str, Root] = {}
        """Hips, and the avatar's own place in the world, mirrored in x."""
        self._lengths: dict[str, float] = {}
        """Of the bones above `_LEG` [m]."""
        self.shows_somebody = True
        """Whether its sender says that the avatar moves as a person does."""
        self.dropped = 0
        """Messages that told no bone as the protocol does."""

    def take(self, datagram: bytes, now: float = 0.0) -> bool:
        """Takes the bones of one datagram; whether there were any. A message in it that tells no bone as the protocol
        does is dropped alone.

        Args:
            datagram: as it came.
            now: when it came [s].

        Raises:
            Refused: the datagram is too long, or cut off.
        """
        if len(datagram) > MAX_BYTES:
            raise Refused("too_long")
        is_any, self._now = False, now
        for message in _messages(datagram):
            try:
                is_any |= self._take(*_osc(message))
            except Refused:
                self.dropped += 1
        return is_any

    def _take(self, address: str, arguments: list[Any]) -> bool:
        if address == STATUS:
            self.shows_somebody = _shows_somebody(arguments)
            return False
        if address not in (ADDRESS, ROOT):
            return False
        if len(arguments) < _ARGUMENTS or not isinstance(arguments[0], str):
            raise Refused("malformed")
        position, rotation = arguments[1:4], arguments[4:_ARGUMENTS]
        name = ROOT if address == ROOT else arguments[0].lower()
        place = None if address == ROOT else _PLACE.get(name)
        # all of it is read before any of it is kept
        pose = _pose(position, rotation) if name in (ROOT, _HIPS) else None
        length = float(np.linalg.norm(_position(position))) if name in _LEG else None
        if place is not None:
            x, y, z, w = quaternion(rotation)
            self._xyzw_J4[place] = x, -y, -z, w  # mirrored in x
            self._at_J[place] = self._now
        if pose is not None:
            self._poses[name] = pose
        if length is not None:
            self._lengths[name] = length
        return place is not None or pose is not None

    @property
    def pose(self) -> SeenPose:
        """As they are now; a bone that has never come rests. Limbs are sure as long as they come: each frame tells all
        bones that its sender has.
        """
        sure_J = np.ones(len(self._at_J))
        sure_J[_LIMBS] = self._at_J[_LIMBS] >= self._now - _SILENT
        return SeenPose(of_quaternions(self._xyzw_J4).astype(np.float32), sure_J, self._root())

    @property
    def content(self) -> Content:
        """What is seen: nobody, while its sender says so."""
        return self.pose if self.shows_somebody else Nobody()

    def _root(self) -> Root | None:
        """Where the pelvis is, of a person whose legs are as long as our skeleton's; None as long as no hips came."""
        hips = self._poses.get(_HIPS)
        if hips is None or hips.place_3 is None:
            return None
        turn_33, place_3 = hips.turn_33, hips.place_3
        avatar = self._poses.get(ROOT)
        if avatar is not None and avatar.place_3 is not None:
            turn_33, place_3 = avatar.turn_33 @ turn_33, avatar.place_3 + avatar.turn_33 @ place_3
        length = sum(self._lengths.values()) if len(self._lengths) == len(_LEG) else 0.0
        return Root(turn_33, place_3 * (LEG_LENGTH / length if length > _SHORTEST_LEG else 1.0))


def _shows_somebody(told: list[Any]) -> bool:
    """What a sender says of its avatar: loaded, and since version 2.5 the state and the kind of its calibration, since
    2.7 whether somebody is tracked.
    """
    if not told or any(not isinstance(value, int | float) for value in told[:4]):
        raise Refused("malformed")
    loaded, calibration, _, tracked = (list(told[:4]) + [None] * 3)[:4]
    return bool(loaded) and calibration in (None, _CALIBRATED) and tracked != 0


def _position(values: list[Any]) -> np.ndarray:
    return np.array(numbers(values, 3, _FARTHEST)) * [-1.0, 1.0, 1.0]


def _pose(position: list[Any], rotation: list[Any]) -> Root:
    x, y, z, w = quaternion(rotation)
    return Root(of_quaternions(np.array([[x, -y, -z, w]]))[0], _position(position))


def _messages(datagram: bytes) -> list[bytes]:
    """The OSC messages of a datagram: itself, or those of a bundle and of bundles in it
    (https://opensoundcontrol.stanford.edu/spec-1_0.html). python-osc gives up a bundle for one bad message in it.

    Raises:
        Refused: a bundle is cut off, or has too many messages.
    """
    found: list[bytes] = []
    waiting = [(0, len(datagram))]
    while waiting:
        start, end = waiting.pop()
        if not datagram.startswith(_BUNDLE, start, end):
            found.append(datagram[start:end])
            continue
        inner, start = [], start + _BUNDLE_HEADER
        while start < end:
            size, start = int.from_bytes(datagram[start : start + _SIZE]), start + _SIZE
            if size > end - start:
                raise Refused("malformed")
            inner.append((start, start + size))
            start += size
            if len(found) + len(waiting) + len(inner) > _MOST_MESSAGES:
                raise Refused("too_long")
        waiting += inner[::-1]  # so that they come out in order
    return found


def _osc(message: bytes) -> tuple[str, list[Any]]:
    """Address and arguments of a message.

    Raises:
        Refused: it is none.
    """
    from pythonosc.osc_message import OscMessage

    try:
        if not OscMessage.dgram_is_message(message):
            raise Refused("malformed")
        read = OscMessage(message)
        return read.address, list(read.params)
    except Refused:
        raise
    except Exception as error:  # whatever python-osc makes of a stranger's bytes
        raise Refused("malformed") from error


class VmcSource(TokenlessSource):
    """A VMC receiver."""

    def __init__(self, endpoint: Endpoint) -> None:
        """Where to listen.

        Raises:
            UserError: python-osc is not installed, or the host is reached by others.
        """
        import_optional("pythonosc.osc_message", "VMC needs python-osc: pip install 'mrhubo[live]'")
        super().__init__(endpoint, "vmc", "VMC", Bones)
