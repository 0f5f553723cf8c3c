"""`scale: auto`: the robot's directions at a human's lengths.

Keypoints are chained outwards from the shoulders (hips, neck) of a human who stands upright, along the robot's
directions: each limb gets the human's length. No number is tuned. `scale: manual` is in `manual_scale`.

Legend: B batch, D directions, K keypoints.
"""

from __future__ import annotations

import itertools

import torch
from torch import Tensor, nn

from mrhubo import rotation
from mrhubo.body.skeleton import KEYPOINT_NAMES, keypoint_indices
from mrhubo.robot.directions import Directions
from mrhubo.robot.model import LinkPoses
from mrhubo.robot.parts import LimbPart, OrientedPart

_PINNED = ("left_knee", "right_knee", "left_ankle", "right_ankle", "neck", "left_shoulder", "right_shoulder")
"""Keypoints held at the upright rest pose, where no part of the robot moves them: the human stands."""


class AutoScale(nn.Module):
    """Target keypoints of one robot at the lengths of a human."""

    rest_K3: Tensor
    offset_K3: Tensor

    def __init__(self, directions: Directions) -> None:
        super().__init__()
        self.directions = directions
        self._parts = [part for part in directions.keypoints.parts if part.seen_from]
        inner: dict[str, str] = {}
        """The keypoint from which each one is reached."""
        for part in self._parts:
            if isinstance(part, LimbPart):
                inner[part.end] = part.start
            elif isinstance(part, OrientedPart):
                inner |= {outer: before for before, outer in itertools.pairwise(part.turned_by)}
                inner |= dict.fromkeys(part.points, part.joint)
        self.keypoint_names = (*(name for name in _PINNED if name not in inner), *inner)
        """Names of the target keypoints."""
        self.keypoint_indices = keypoint_indices(self.keypoint_names)
        """Their positions in the skeleton's keypoints."""
        self._names = tuple(dict.fromkeys((*self.keypoint_names, *inner.values())))
        rest = directions.skeleton.rest_K3
        rest_K3 = rest[keypoint_indices(self._names)]
        origin_K3 = rest[[KEYPOINT_NAMES.index(inner.get(name, name)) for name in self._names]]
        self.register_buffer("rest_K3", rest_K3, persistent=False)
        self.register_buffer("offset_K3", rest_K3 - origin_K3, persistent=False)

    def targets(self, poses: LinkPoses) -> Tensor:
        """Target keypoints (B, K, 3) [m], human frame, of robot poses."""
        return self.keypoints(self.directions.view_robot(poses).direction_BD3)

    def keypoints(self, direction_BD3: Tensor) -> Tensor:
        """Keypoints (B, K, 3) [m] of an upright human whose parts have these directions."""
        found = {name: self.rest_K3[i].expand(len(direction_BD3), 3) for i, name in enumerate(self._names)}
        offset = dict(zip(self._names, self.offset_K3, strict=True))
        column = {name: direction_BD3[:, i] for i, name in enumerate(self.directions.names)}
        turned: dict[str, Tensor] = {}
        """Of parts from which others are seen, how far they are turned; the others are upright."""
        for part in self._parts:
            from_B33 = turned.get(part.seen_from or "")
            if isinstance(part, LimbPart):
                along_B3 = column[part.end]
                along_B3 = along_B3 if from_B33 is None else (from_B33 @ along_B3[..., None])[..., 0]
                found[part.end] = found[part.start] + offset[part.end].norm() * along_B3
            elif isinstance(part, OrientedPart):
                turn_B33, shares = part.turn(*(column[name] for name in part.direction_names)), len(part.turned_by)
                for count, (inner, outer) in enumerate(itertools.pairwise(part.turned_by), start=1):
                    share_B3 = rotation.matrix_to_axis_angle(turn_B33) * count / shares
                    share_B33 = rotation.axis_angle_to_matrix(share_B3)
                    share_B33 = share_B33 if from_B33 is None else from_B33 @ share_B33
                    found[outer] = found[inner] + share_B33 @ offset[outer]
                turn_B33 = turn_B33 if from_B33 is None else from_B33 @ turn_B33
                turned[part.name] = turn_B33
                for point in part.points:
                    found[point] = found[part.joint] + turn_B33 @ offset[point]
        return torch.stack([found[name] for name in self.keypoint_names], dim=1)
