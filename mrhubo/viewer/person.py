"""The person of a human motion over time, standing on a floor.

Axes: x forward, y left, z up, m; the floor is at z = 0. Legend: T frames, J = 22 joints, P points of soles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mrhubo.body import KEYPOINT_NAMES, Skeleton
from mrhubo.body.joints import PAIRED_KEYPOINTS
from mrhubo.errors import UserError, encodable
from mrhubo.frames import human_to_world
from mrhubo.motion import NOT_FINITE, Motion, refuse_frames
from mrhubo.motion.contacts import find_contacts, root_scale
from mrhubo.viewer.skin import joints_of, world_rotations

SOLE_POINTS: tuple[str, ...] = (*PAIRED_KEYPOINTS["heel"], *PAIRED_KEYPOINTS["toe"])
"""Where a foot touches the floor."""
_FAR_M = 1e5
"""No motion goes so far [m]; in float32, places out there are centimetres apart."""


@dataclass(frozen=True)
class Person:
    """How a person moves."""

    name: str
    """Of the motion."""
    frame_rate: float
    place_TJ3: np.ndarray
    """Joints [m], from the pelvis and along its axes."""
    turn_TJ33: np.ndarray
    """Their rotations, along the pelvis's axes."""
    points_TK3: np.ndarray
    """`KEYPOINT_NAMES` [m], likewise."""
    root_T3: np.ndarray
    """The pelvis on its floor [m]."""
    root_T33: np.ndarray
    """Its rotation."""
    planted_TP: np.ndarray | None
    """Whether each of `SOLE_POINTS` is planted; None where the motion does not tell where its root goes."""
    has_root: bool
    """Whether the motion tells where the root goes."""

    def __len__(self) -> int:
        return len(self.root_T3)

    @cached_property
    def soles_TP3(self) -> np.ndarray:
        """Where `SOLE_POINTS` are [m]."""
        chosen = [KEYPOINT_NAMES.index(name) for name in SOLE_POINTS]
        return self.root_T3[:, None] + self.points_TK3[:, chosen] @ self.root_T33.swapaxes(-1, -2)


def read_person(motion: Motion) -> Person:
    """The person of a motion.

    Where the motion has no root, the lowest point of the soles is on the floor.

    Raises:
        UserError: a rotation or the root holds NaN, infinite numbers, or places out of this world; says in which frame.
    """
    if not len(motion):
        raise UserError(f"{motion.name}: has no frames, so there is nothing to show")
    local_TJ33, way_T3, turn_T33 = motion.local_TJ33, motion.root_position_T3, motion.root_rotation_T33
    refuse_frames(~local_TJ33.flatten(1).isfinite().all(dim=1), NOT_FINITE)
    for part in (way_T3, turn_T33):
        if part is not None:
            refuse_frames(~part.flatten(1).isfinite().all(dim=1), f"a root of {NOT_FINITE}")
            refuse_frames(part.flatten(1).abs().amax(dim=1) > _FAR_M, "a root that is out of this world")
    place_TJ3, turn_TJ33 = joints_of(local_TJ33)
    points_TK3 = human_to_world(Skeleton().keypoints(local_TJ33).double().numpy())
    root_T33 = np.tile(np.eye(3), (len(motion), 1, 1))
    if turn_T33 is not None:
        root_T33 = world_rotations(turn_T33.double().numpy())
    soles = [KEYPOINT_NAMES.index(name) for name in SOLE_POINTS]
    soles_TP3 = points_TK3[:, soles] @ root_T33.swapaxes(-1, -2)
    root_T3, planted_TP = np.zeros((len(motion), 3)), None
    if way_T3 is None:
        root_T3[:, 2] = -soles_TP3[..., 2].min(axis=1)
    else:
        root_T3, planted_TP = _on_floor(way_T3.double().numpy(), soles_TP3, motion.frame_rate)
    return Person(
        encodable(motion.name), motion.frame_rate, place_TJ3, turn_TJ33, points_TK3, root_T3, root_T33, planted_TP,
        way_T3 is not None,
    )  # fmt: skip


def _on_floor(way_T3: np.ndarray, soles_TP3: np.ndarray, frame_rate: float) -> tuple[np.ndarray, np.ndarray]:
    """The root's way (T, 3) [m] above its floor, and which soles are planted (T, P); `mrhubo.motion.contacts` has its
    own axes, whose y is up.
    """
    turned_TP3 = soles_TP3[..., [1, 2, 0]]
    way_T3 = root_scale(turned_TP3, way_T3, frame_rate) * way_T3
    contacts = find_contacts(turned_TP3 + way_T3[:, None], frame_rate, root_T=way_T3[:, 1])
    return human_to_world(way_T3) - [0.0, 0.0, contacts.floor], contacts.planted_TP
