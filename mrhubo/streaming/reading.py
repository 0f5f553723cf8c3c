"""What a stream is given with a frame: poses, roots and contacts of its people; what is no such thing is refused.

Legend: B people, J = 21 human joints, P points of soles, N joints.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from mrhubo.body.skeleton import KEYPOINT_NAMES
from mrhubo.errors import UserError
from mrhubo.fast.poses import to_array
from mrhubo.motion import MotionLike, read_poses, to_tensor
from mrhubo.motion.poses import are_crooked
from mrhubo.reference.standing import FAR_M, Legs
from mrhubo.robot import BodyMap

_MOST_PEOPLE = 10_000

Root = tuple[MotionLike, MotionLike]
"""Rotation (3, 3) and place (3,) [m] of a pelvis, with a leading axis of people or without."""


@dataclass(frozen=True)
class FrameReader:
    """Turns what is given into tensors whose first axis is people.

    Raises:
        UserError: the number of people is none.
    """

    body_map: BodyMap
    legs: Legs
    people: int | None
    """None: one, whose arrays have no axis of people."""

    def __post_init__(self) -> None:
        people = self.people
        if people is not None and (type(people) is not int or not 1 <= people <= _MOST_PEOPLE):
            raise UserError(
                f"stream: people must be a whole number from 1 to {_MOST_PEOPLE:,}, or None, found {people}"
            )

    @property
    def contact_points(self) -> tuple[str, ...]:
        """The human keypoints of the soles on which the robot stands; none if it has no feet."""
        return tuple(KEYPOINT_NAMES[k] for k in self.legs.contacts) if self.legs.has_feet else ()

    def poses(self, given: MotionLike | None, last_BJ33: Tensor) -> tuple[Tensor, Tensor]:
        """Poses (B, 21, 3, 3), the last ones of those who are not seen, and who is seen (B,).

        Raises:
            UserError: they have another shape, or hold what is no rotation.
        """
        people = len(last_BJ33)
        if given is None:
            return last_BJ33, torch.zeros(people, dtype=torch.bool, device=last_BJ33.device)
        found = self._of_people(to_tensor(given, self.body_map.skeleton))
        if found.ndim < 2 or len(found) != people:
            wanted = "a single one" if self.people is None else f"{people} of them"
            shape = tuple(to_tensor(given).shape)
            raise UserError(f"stream: expected poses of one frame, {wanted}, found an array of shape {shape}")
        seen_B = found.flatten(1).isfinite().all(dim=1)
        poses = read_poses(found[seen_B])
        if len(poses.shape) != 1:
            raise UserError(f"stream: expected one pose a person, found an array of shape {tuple(found.shape)}")
        local_BJ33, seen_B = last_BJ33.clone(), seen_B.to(last_BJ33.device)
        local_BJ33[seen_B] = poses.local_TJ33.to(local_BJ33)
        return local_BJ33, seen_B

    def roots(self, given: Root, last_B33: Tensor, last_B3: Tensor, seen_B: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Roots (B, 3, 3), (B, 3) [m], the last ones of those who are not seen; and who is seen (B,), which those are
        not whose root is no number.

        Raises:
            UserError: they have another shape, or a rotation is none.
        """
        people = len(seen_B)
        try:
            turn_B33, place_B3 = (self._of_people(to_tensor(part).to(last_B33)) for part in given)
        except (TypeError, ValueError, UserError) as error:
            raise UserError(f"stream: a root is a rotation (3, 3) and a place (3,) [m]: {error}") from error
        if tuple(turn_B33.shape) != (people, 3, 3) or tuple(place_B3.shape) != (people, 3):
            raise UserError(
                "stream: a root is a rotation (3, 3) and a place (3,), with a leading axis if there are several people;"
                f" found {tuple(turn_B33.shape)} and {tuple(place_B3.shape)}"
            )
        seen_B = seen_B & turn_B33.flatten(1).isfinite().all(dim=1) & (place_B3.abs() < FAR_M).all(dim=1)
        if bool((are_crooked(turn_B33) & seen_B).any()):
            raise UserError("stream: the root's matrix is no rotation")
        return (
            torch.where(seen_B[:, None, None], turn_B33, last_B33),
            torch.where(seen_B[:, None], place_B3, last_B3),
            seen_B,
        )

    def contacts(self, given: Any) -> np.ndarray | None:
        """Which points of soles are planted (B, P), where it is given.

        Raises:
            UserError: there are more or fewer.
        """
        if given is None:
            return None
        array, shape = to_array(given), (self.people or 1, len(self.legs.contacts))
        if array.dtype.kind not in "biu" or array.shape != (shape if self.people else shape[1:]):
            raise UserError(
                f"stream: expected contacts of {len(self.legs.contacts)} points: {', '.join(self.contact_points)}"
            )
        return array.astype(bool).reshape(shape)

    def angles(self, given: MotionLike, like: Tensor) -> Tensor:
        """Joint angles of the robots (B, N) [rad], with the type and on the device of `like`.

        Raises:
            UserError: they have another shape, are no numbers, or lie outside the joints' limits.
        """
        robot = self.body_map.robot
        q_BN = self._of_people(to_tensor(given).to(like)).clone()  # the caller's may be changed before the next frame
        if tuple(q_BN.shape) != (self.people or 1, len(robot.joint_names)):
            raise UserError(f"stream: q must have {len(robot.joint_names)} angles a robot, found {tuple(q_BN.shape)}")
        if not bool(((q_BN >= robot.lower_N) & (q_BN <= robot.upper_N)).all()):  # nor NaN
            raise UserError("stream: q lies outside the joints' limits")
        return q_BN

    def _of_people(self, given: Tensor) -> Tensor:
        return given[None] if self.people is None else given
