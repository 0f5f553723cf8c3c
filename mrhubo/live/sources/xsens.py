"""Xsens MVN's Network Streamer: where a body's segments are and how they are turned, in UDP datagrams.

Of its kinds of datagrams "Position + Orientation (Quaternion)", `MXTP02`, is read (MVN Real-time Network Streaming
Protocol Specification, MV0305P): a header of 24 bytes, then 32 bytes a segment: its number, where it begins [m] and a
quaternion, w first, all with the most significant byte first. World: z up. Segments of one moment have one sample
counter, in one datagram or several. Other kinds that come beside it are passed over.
"""

from __future__ import annotations

import struct

import numpy as np

from mrhubo.body.joints import JOINT_NAMES, OFFSETS_J3, PARENTS, POSED_JOINT_NAMES, SIDES, local_rotations
from mrhubo.fast.plain.human import norm, normalize
from mrhubo.fast.rotations import shortest_turn
from mrhubo.live.body import LEG_LENGTH, Root, SeenPose
from mrhubo.live.endpoints import Endpoint
from mrhubo.live.messages import MAX_BYTES, Content, Nobody, Refused, numbers, of_quaternions, quaternion
from mrhubo.live.sources.tokenless import TokenlessSource
from mrhubo.motion.readers.xsens import BEGINS, HUMAN_33, SEGMENTS

PORT = 9763
"""On which MVN sends by default."""
_HEADER = struct.Struct(">4s2sIBBIBBBBHH")
"""Protocol, kind, sample and datagram counters, items, time, character, segments, props, fingers, nothing, bytes."""
_SEGMENT = struct.Struct(">I7f")
_PROTOCOL, _KIND = b"MXTP", b"02"
_FARTHEST = 1e4
"""No place is further from 0 [m]."""
_TRUNK = {
    "pelvis": "Pelvis", "spine1": "L3", "spine2": "T12", "spine3": "T8", "neck": "Neck", "head": "Head",
}  # fmt: skip
_OF_JOINT = _TRUNK | {
    f"{side}_{joint}": f"{side.capitalize()}{segment}" for side in SIDES for segment, joint in BEGINS.items()
}
_SEGMENT_J = [SEGMENTS.index(_OF_JOINT[joint]) for joint in JOINT_NAMES]
"""The segment that is turned as each of our joints."""
_STARTS, _ENDS = (
    [JOINT_NAMES.index(f"{side}_{joint}") for joint in joints for side in SIDES]
    for joints in (("shoulder", "elbow", "hip", "knee"), ("elbow", "wrist", "knee", "ankle"))
)
"""Bones of limbs, those of the legs last."""
_LEGS = slice(2 * len(SIDES), None)
_BONES_L3 = normalize(OFFSETS_J3[[end - 1 for end in _ENDS]].astype(np.float64))
_HIPS = [JOINT_NAMES.index(f"{side}_hip") for side in SIDES]
_HIPS_3 = OFFSETS_J3[[hip - 1 for hip in _HIPS]].mean(axis=0).astype(np.float64)
"""The middle of the hips, from the pelvis, at rest."""
assert PARENTS[_HIPS[0]] == 0


class Segments:
    """The newest segments of a body."""

    def __init__(self) -> None:
        self._place_S3 = np.zeros((len(SEGMENTS), 3))
        self._turn_S4 = np.zeros((len(SEGMENTS), 4))
        self._came: set[int] = set()
        """Segments of the sample that is coming in."""
        self._sample = (-1, -1)
        """Its counter, and whose it is."""
        self._character = -1
        """Whose body was whole first."""
        self._whole = np.zeros((0, 3)), np.zeros((0, 4))
        """Of the newest sample that came whole."""
        self.dropped = 0

    def take(self, datagram: bytes, now: float = 0.0) -> bool:
        """Takes the segments of one datagram; whether a body is whole with them.

        Raises:
            Refused: the datagram is none of MVN's, cut off, or tells what no segment is.
        """
        if len(datagram) > MAX_BYTES:
            raise Refused("too_long")
        if len(datagram) < _HEADER.size or not datagram.startswith(_PROTOCOL):
            raise Refused("malformed")
        _, kind, sample, _, items, _, character, *_ = _HEADER.unpack_from(datagram)
        if kind != _KIND or (self._character >= 0 and character != self._character):
            return False  # another body's
        if len(datagram) < _HEADER.size + items * _SEGMENT.size:
            raise Refused("malformed")
        found = {}
        for at in range(_HEADER.size, _HEADER.size + items * _SEGMENT.size, _SEGMENT.size):
            number, *values = _SEGMENT.unpack_from(datagram, at)
            if 1 <= number <= len(SEGMENTS):  # props and fingers come after them
                found[number - 1] = numbers(values[:3], 3, _FARTHEST), quaternion(values[3:])
        if (sample, character) != self._sample:
            self._came.clear()
        self._sample = sample, character
        for segment, (place, turn) in found.items():
            self._place_S3[segment], self._turn_S4[segment] = place, turn
            self._came.add(segment)
        if len(self._came) < len(SEGMENTS):
            return False
        self._came.clear()
        self._character = character
        self._whole = self._place_S3.copy(), self._turn_S4.copy()
        return True

    @property
    def content(self) -> Content:
        """What is seen; nobody before a body was whole."""
        return _pose(*self._whole) if len(self._whole[0]) else Nobody()


def _pose(place_S3: np.ndarray, turn_S4: np.ndarray) -> SeenPose:
    """The pose of a body: parts are turned as segments, limbs point from where one begins to where the next does."""
    world_J33 = HUMAN_33 @ of_quaternions(np.roll(turn_S4, -1, axis=1))[_SEGMENT_J] @ HUMAN_33.T
    place_J3 = (place_S3 @ HUMAN_33.T)[_SEGMENT_J]
    way_L3 = place_J3[_ENDS] - place_J3[_STARTS]
    length_L = norm(way_L3)
    there_L3 = normalize(way_L3)
    here_L3 = (world_J33[_STARTS] @ _BONES_L3[..., None])[..., 0]
    turn_L33 = np.where((length_L > 1e-3)[:, None, None], shortest_turn(here_L3, there_L3), np.eye(3))
    world_J33[_STARTS] = turn_L33 @ world_J33[_STARTS]
    leg = float(length_L[_LEGS].sum()) / len(SIDES)
    hips_3 = place_J3[_HIPS].mean(axis=0) * (LEG_LENGTH / leg if leg > 0.05 else 1.0)
    local_J33 = local_rotations(world_J33[None])[0].astype(np.float32)
    root = Root(world_J33[0], hips_3 - world_J33[0] @ _HIPS_3)
    return SeenPose(local_J33, np.ones(len(POSED_JOINT_NAMES)), root)


class XsensSource(TokenlessSource):
    """A receiver of what MVN streams."""

    def __init__(self, endpoint: Endpoint) -> None:
        """Where to listen.

        Raises:
            UserError: the host is reached by others.
        """
        super().__init__(endpoint, "xsens", "MVN's stream", Segments)
