"""Sets of points that senders of landmarks have, by our names, and the axes that each has them in.

MediaPipe's world landmarks: metres, x to the right of the picture, y down, z away from the camera
(https://ai.google.dev/edge/mediapipe/solutions/vision/pose_landmarker). PICO's 24 joints are SMPL's and two hands
(https://github.com/XR-Robotics); WebXR's are those of `XRBody` (https://immersive-web.github.io/body-tracking), and
nose and ears, by which our page tells how a headset is turned. Both have x to the right, y up, z backwards, as OpenXR
has, which is right-handed as we are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from mrhubo.body.joints import JOINT_NAMES, SIDES
from mrhubo.live.vectors import Vector
from mrhubo.motion.readers.keypoint_sets import SETS

_WEBXR = {
    "hips": "pelvis", "spine-middle": "spine2", "neck": "neck",
    "{side}-arm-upper": "{side}_shoulder", "{side}-arm-lower": "{side}_elbow", "{side}-hand-wrist": "{side}_wrist",
    "{side}-hand-thumb-metacarpal": "{side}_thumb", "{side}-hand-index-phalanx-proximal": "{side}_index",
    "{side}-hand-middle-phalanx-proximal": "{side}_middle", "{side}-hand-little-phalanx-proximal": "{side}_pinky",
    "{side}-upper-leg": "{side}_hip", "{side}-lower-leg": "{side}_knee", "{side}-foot-ankle": "{side}_ankle",
    "{side}-foot-ball": "{side}_foot", "nose": "nose", "{side}_ear": "{side}_ear",
}  # fmt: skip


@dataclass(frozen=True)
class PointSet:
    """The points of one kind of sender."""

    names: tuple[str, ...] | None
    """Ours, in the sender's order, "-" where a point is not used; None: each message names its points."""
    theirs: Mapping[str, str] | None = None
    """Our names of the sender's; None: the sender uses ours."""
    signs: Vector = (1.0, 1.0, 1.0)
    """What turns its axes into right-handed ones with y up."""
    in_world: bool = False
    """Whether points are told in a world that stays, unless a message says otherwise."""
    axes_known: bool = True
    """Whether all senders have the axes that `signs` tells; else they may be left-handed."""


def _webxr() -> dict[str, str]:
    return {theirs.format(side=side): ours.format(side=side) for theirs, ours in _WEBXR.items() for side in SIDES}


POINT_SETS = {
    "mediapipe": PointSet(SETS["MediaPipe"], signs=(1.0, -1.0, -1.0)),
    "pico": PointSet((*JOINT_NAMES, *(f"{side}_middle" for side in SIDES)), in_world=True),
    "webxr": PointSet(None, _webxr(), in_world=True),
    "named": PointSet(None, axes_known=False),
}
"""By the name that a message gives."""
