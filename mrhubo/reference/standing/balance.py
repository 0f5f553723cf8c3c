"""The centre of mass over what supports the robot, while the person stands still (`robot.balance`).

Planted soles carry the root, so what can be chosen is where the root is above them: it is shifted, smoothly, until the
centre of mass is over the support polygon, which is the convex hull of the corners of planted soles, shrunk towards
their mean. The legs then give way as they do anyway, so that soles stay in their places.

World: the human's, x left, y up, z forward; m.

Legend: T frames or B problems, P points of soles, C = 2 P corners (the right and the left one at each point), Y pairs
of corners.
"""

from __future__ import annotations

import numpy as np
import torch
from scipy.ndimage import uniform_filter1d
from torch import Tensor, nn

from mrhubo.reference.standing.human import HumanSteps
from mrhubo.reference.standing.legs import Legs
from mrhubo.robot import LinkPoses
from mrhubo.robot.centre_of_mass import CentreOfMass

MARGIN = 0.3
"""By which share the polygon is shrunk: a controller has to have room."""
STILL_M_S, GOING_M_S = 0.1, 0.3
"""Speeds [m/s] of a person's root, on the robot's scale and level with the floor, up to which it stands still, and from
which it does not; between them balance counts less and less."""
LOW_M, AWAY_M = (0.75, 0.6), (0.25, 0.35)
"""Who sits, kneels or lies is not held by the feet: there the root is lower over the floor than the first height, and
farther beside the feet than the first distance [m]; from the second ones on that is sure."""
SMOOTH_S = 0.5
"""Over which time [s] that speed, and then the shift, is the mean."""
_ALONG = 0.8
"""How far the centre of mass goes where the root does: planted legs stay behind."""
_ROUNDS = 4
"""How often what a smooth shift has left is shifted too."""
_FLAT = [0, 2]
_INSIDE_M = 1e-6
"""Corners that are no farther beyond a point of an edge are on it, but for rounding."""
_FAR = 1e12


class Balance(nn.Module):
    """Shifts of the root of one robot."""

    def __init__(self, legs: Legs) -> None:
        """Looks masses and corners up.

        Raises:
            UserError: the robot's URDF tells no masses.
        """
        super().__init__()
        self.legs, self.centre = legs, CentreOfMass(legs.body_map.robot)
        self.strength = legs.body_map.robot.balance
        """How much of the shift is made: 0..1."""
        self._corners = _corners(legs)

    def shift(self, poses: LinkPoses, steps: HumanSteps, root_T3: np.ndarray, moved_TP3: np.ndarray) -> np.ndarray:
        """How far the root is to go (T, 3) [m].

        Args:
            poses: of the robot.
            steps: the person's.
            root_T3: where the robot's root is.
            moved_TP3: how far from where they are there, points of soles are to be.
        """
        mass_T3, corner_TC3 = self.places(poses, steps, torch.from_numpy(root_T3))
        corner_TC3 = corner_TC3 + torch.from_numpy(moved_TP3).repeat_interleave(2, dim=1)
        counts_TC = torch.from_numpy(steps.contacts.planted_TP).repeat_interleave(2, dim=1)
        gone_T2, still_T1 = np.zeros((len(root_T3), 2)), (stillness(steps) * on_feet(steps, self.legs.scale))[:, None]
        width = 2 * round(SMOOTH_S * steps.frame_rate / 2) + 1
        for _ in range(_ROUNDS):
            there_T2 = mass_T3[:, _FLAT] + _ALONG * torch.from_numpy(gone_T2)
            off_T2 = outside(there_T2, corner_TC3[..., _FLAT], counts_TC).numpy()
            more_T2 = uniform_filter1d(still_T1 * -off_T2 / _ALONG, width, axis=0, mode="nearest")
            gone_T2 = gone_T2 + uniform_filter1d(more_T2, width, axis=0, mode="nearest")
        found_T3 = np.zeros_like(root_T3)
        found_T3[:, _FLAT] = self.strength * gone_T2
        return found_T3

    def places(self, poses: LinkPoses, steps: HumanSteps, root_T3: Tensor) -> tuple[Tensor, Tensor]:
        """Where the centre of mass (T, 3) and corners of soles (T, C, 3) are in the world [m], float64."""
        _, axes_T33, from_T3 = self.legs.seen(poses)
        mass_T3 = ((self.centre(poses) - from_T3)[:, None] @ axes_T33)[:, 0]
        seen_TX3 = torch.cat((mass_T3[:, None], self.legs.places(poses).ball_BK3[:, self._corners]), dim=1)
        found_TX3 = (seen_TX3 @ steps.turn_T33.to(seen_TX3).mT).double().cpu() + root_T3[:, None]
        return found_TX3[:, 0], found_TX3[:, 1:]


def stillness(steps: HumanSteps) -> np.ndarray:
    """How much a person stands still (T,), 0..1: the root is slow, and a foot is planted."""
    path_T2, rate = steps.path_T3[:, _FLAT].double().cpu().numpy(), steps.frame_rate
    speed_T = np.zeros(len(path_T2))
    if len(path_T2) > 1:
        speed_T = np.linalg.norm(np.gradient(path_T2, 1 / rate, axis=0), axis=1)
    speed_T = uniform_filter1d(speed_T, 2 * round(SMOOTH_S * rate / 2) + 1, mode="nearest")
    slow_T = np.clip((GOING_M_S - speed_T) / (GOING_M_S - STILL_M_S), 0.0, 1.0)
    return slow_T * steps.contacts.weight_TP.max(axis=1)


def on_feet(steps: HumanSteps, scale: float) -> np.ndarray:
    """How surely it is the feet that hold a person (T,), 0..1, whose path is on the robot's scale."""
    root_T3 = steps.path_T3.double().cpu() / scale
    off_T2 = outside(root_T3[:, _FLAT], torch.from_numpy(steps.place_TP3[..., _FLAT]),
                     torch.from_numpy(steps.contacts.planted_TP))  # fmt: skip
    shares = [
        np.clip((value_T.numpy() - first) / (second - first), 0.0, 1.0)
        for value_T, (first, second) in ((root_T3[:, 1], LOW_M), (off_T2.norm(dim=1), AWAY_M))
    ]
    return 1 - shares[0] * shares[1]


def outside(point_B2: Tensor, corner_BC2: Tensor, counts_BC: Tensor) -> Tensor:
    """How far points (B, 2) are off the convex hulls of corners (B, C, 2) that count (B, C), shrunk by `MARGIN`: the
    vector from the nearest point, 0 inside and where no corner counts.
    """
    counts_BC = counts_BC.to(point_B2)
    mean_BC = counts_BC / counts_BC.sum(dim=1, keepdim=True).clamp_min(1.0)
    mean_B12 = mean_BC[:, None] @ corner_BC2
    shrunk_BC2 = mean_B12 + (1 - MARGIN) * (corner_BC2 - mean_B12)
    one_Y, other_Y = torch.triu_indices(counts_BC.shape[1], counts_BC.shape[1], device=point_B2.device)
    start_BY2, along_BY2 = shrunk_BC2[:, one_Y], shrunk_BC2[:, other_Y] - shrunk_BC2[:, one_Y]
    length_BY = along_BY2.square().sum(-1).clamp_min(1e-12)
    part_BY = (((point_B2[:, None] - start_BY2) * along_BY2).sum(-1) / length_BY).clamp(0, 1)
    off_BY2 = point_B2[:, None] - start_BY2 - part_BY[..., None] * along_BY2
    nowhere_BY = counts_BC[:, one_Y] * counts_BC[:, other_Y] == 0
    best_B1 = torch.where(nowhere_BY, _FAR, off_BY2.square().sum(-1)).argmin(dim=1, keepdim=True)
    off_B2 = off_BY2.take_along_dim(best_B1[..., None], dim=1)[:, 0]
    # Of a point inside, the nearest of all segments between corners leaves some corners on its own side.
    beyond_BC = ((shrunk_BC2 - (point_B2 - off_B2)[:, None]) * off_B2[:, None]).sum(-1)
    most_B = torch.where(counts_BC > 0, beyond_BC, -_FAR).amax(dim=1)
    inside_B = (most_B > _INSIDE_M * off_B2.norm(dim=1)) | (counts_BC.sum(dim=1) == 0)
    return torch.where(inside_B[:, None], 0.0, off_B2)


def _corners(legs: Legs) -> list[int]:
    """Of each point of a sole the balls that are there farthest to the right and to the left."""
    found, first = [], 0
    for number, sole in enumerate(legs.soles):
        forward_3, up_3 = legs.body_map.keypoints.ends[sole.part.name].axes_23.numpy().astype(float)
        left_K = sole.balls_K4[:, :3] @ np.cross(up_3, forward_3)
        for point in (2 * number, 2 * number + 1):
            near_K = legs.ball_PK[point, first : first + len(left_K)]
            found += [first + int(np.where(near_K, sign * left_K, np.inf).argmin()) for sign in (1.0, -1.0)]
        first += len(left_K)
    return found
