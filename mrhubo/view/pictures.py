"""Pictures of pairs and of retargeted clips.

Legend: T frames, J = 21 human joints, N robot joints.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch
from PIL.Image import Image
from torch import Tensor

from mrhubo.body import BodyPrior, Skeleton
from mrhubo.evaluation.clips import Clip
from mrhubo.pairing import PairFilter
from mrhubo.robot import Robot, link_poses
from mrhubo.rotation import stack_columns
from mrhubo.view import (
    Solids,
    contact_sheet,
    distributions,
    figure_animation,
    figure_sheet,
    human_figure,
)
from mrhubo.view.robot import RobotShape

PAIR_TITLES = {"phi": "phi", "residual_m": "keypoint distance [mm]", "z_norm": "|z|"}
"""Measures of pairs that pictures show, and their titles."""
PAIR_MEASURES = {"phi": 1.0, "residual_m": 1000.0, "z_norm": 1.0}
"""Their units in pictures, per unit in the files."""
_REFERENCE_TINT = (0.55, 0.62, 0.72)
_FIGURE_HEIGHT_M = 1.7
GIF_RATE = 12.0
"""Frames per second of an animation."""


class Artist:
    """Draws one robot and the human, both at one height."""

    def __init__(self, robot: Robot, skeleton: Skeleton | None = None) -> None:
        self.robot, self.skeleton = robot, skeleton or Skeleton()
        self.shape = RobotShape(robot.description)
        height = float(np.ptp(self.robot_figure(robot.home(), scaled=False).bounds()[:, 2]))
        self.scale = _FIGURE_HEIGHT_M / max(height, 1e-3)
        self.shape = self.shape.coarser(height)

    def human(self, local_J33: Tensor) -> Solids:
        """A human in a pose, local rotations (21, 3, 3)."""
        return human_figure(local_J33, self.skeleton)

    def robot_figure(self, q_N: Tensor, scaled: bool = True) -> Solids:
        """The robot at joint angles (N,) [rad], scaled to the human's height."""
        poses = link_poses(self.robot.description.parsed, self.robot.configuration(q_N.numpy()))
        solids = self.shape.solids(poses)
        return solids.scaled(self.scale) if scaled else solids

    def pairs(self, pairs: dict[str, Tensor], pair_filter: PairFilter, prior: BodyPrior, count: int = 3) -> Image:
        """Robot pose, human pose and denoised human pose, as in the paper's figure 1: feasible above, extreme below."""
        order = pairs["phi"].argsort()
        kept = int((pairs["phi"] <= pair_filter.threshold).sum())
        feasible = [int(order[int(share * max(kept - 1, 0))]) for share in np.linspace(0.02, 0.6, count)]
        extreme = [
            int(order[-1 - int(share * max(len(order) - kept - 1, 0))]) for share in np.linspace(0.0, 0.5, count)
        ]
        rows, titles = [], []
        with torch.no_grad():
            for kind, chosen in (("feasible", feasible), ("extreme", extreme)):
                for index in chosen:
                    pose = pairs["H"][index]
                    denoised = prior.denoise(pose[None])[0]
                    humans = (self.human(stack_columns(sixd)) for sixd in (pose, denoised))
                    rows.append([self.robot_figure(pairs["q"][index]), *humans])
                    titles.append(f"{kind}\nphi {float(pairs['phi'][index]):.2g}")
        columns = ["robot pose q", "human pose H", "denoised H~"]
        return figure_sheet(rows, columns, titles, f"{self.robot.name}: pairs by reconstruction error phi")

    def pair_sheet(self, pairs: Mapping[str, Tensor], measures: Mapping[str, Mapping[str, Tensor]]) -> Image:
        """`ranked_pairs` over the distributions of `measures`: phi, residual_m and z_norm (P,) by where pairs start."""
        figures = self.ranked_pairs(pairs)
        shown = {
            f"from {source}": {name: unit * values[name].numpy() for name, unit in PAIR_MEASURES.items()}
            for source, values in measures.items()
        }
        charts = distributions(shown, PAIR_TITLES, (figures.width, 300))
        return contact_sheet([[figures], [charts]], gap=0)

    def ranked_pairs(self, pairs: Mapping[str, Tensor]) -> Image:
        """Best, median and worst pairs by the cost of their inverse kinematics."""
        order = pairs["cost"].argsort()
        last = len(order) - 1
        places = {"best": (0, 1), "median": (last // 2, last // 2 + 1), "worst": (last - 1, last)}
        chosen = [(word, int(order[min(place, last)])) for word, pair in places.items() for place in pair]
        rows = [
            [self.robot_figure(pairs["q"][index]) for _, index in chosen],
            [self.human(stack_columns(pairs["H"][index])) for _, index in chosen],
        ]
        titles = [
            f"{word}: {1000 * float(pairs['residual_m'][i]):.1f} mm, phi {float(pairs['phi'][i]):.2g}"
            for word, i in chosen
        ]
        caption = f"{self.robot.name}: best, median and worst of {len(order):,} pairs, by the cost of their keypoints"
        return figure_sheet(rows, titles, ["robot pose q", "human pose H"], caption, (170, 220))

    def key_poses(self, clip: Clip, predictions: Mapping[str, Tensor], count: int = 6) -> Image:
        """Human, reference and predictions (T, N) by their names at evenly spaced frames of a clip."""
        frames = [round(f) for f in np.linspace(0.08, 0.92, count) * (len(clip.reference_TN) - 1)]
        rows = [
            [self.human(clip.motion.local_TJ33[f]) for f in frames],
            [self.robot_figure(clip.reference_TN[f]).recolored(_REFERENCE_TINT) for f in frames],
            *([self.robot_figure(q_TN[f]) for f in frames] for q_TN in predictions.values()),
        ]
        columns = [f"{f / clip.motion.frame_rate:.1f} s" for f in frames]
        return figure_sheet(rows, columns, ["human", "reference", *predictions], self.clip_title(clip))

    def animation(self, clip: Clip, predictions: Mapping[str, Tensor], seconds: float = 4.0) -> list[Image]:
        """The middle of a clip, `GIF_RATE` frames a second: human, reference and predictions (T, N) by their names."""
        rate, last = clip.motion.frame_rate, len(clip.reference_TN) - 1
        shown = min(seconds * rate, last)
        times = np.arange((last - shown) / 2, (last + shown) / 2 + 1e-6, rate / GIF_RATE)
        frames = [round(f) for f in times]
        columns = [
            [self.human(clip.motion.local_TJ33[f]) for f in frames],
            [self.robot_figure(clip.reference_TN[f]).recolored(_REFERENCE_TINT) for f in frames],
            *([self.robot_figure(q_TN[f]) for f in frames] for q_TN in predictions.values()),
        ]
        captions = [f"{self.clip_title(clip)}, {f / rate:.1f} s" for f in frames]
        return figure_animation(columns, ["human", "reference", *predictions], captions)

    def clip_title(self, clip: Clip) -> str:
        """`nao: 13_18 (laugh)`."""
        known = ("", clip.name)
        description = "" if clip.motion.description in known else f" ({clip.motion.description})"
        return f"{self.robot.name}: {clip.name}{description}"


def liveliness(clip: Clip) -> float:
    """Mean speed [rad/s] of the robot's joints in the reference's answer to a clip."""
    return float(clip.reference_TN.diff(dim=0).abs().mean()) * clip.motion.frame_rate
