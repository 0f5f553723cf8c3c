"""How far to trust an answer, frame by frame and for each branch of the robot (an arm, the head).

A confidence is a probability: that the branch's limbs point within `GOOD_DEG` degrees of where the person's pointed.
Four signals tell, each of which only lowers it:

miss        the answer's limbs point elsewhere than the input's: what the robot cannot do, or what went wrong
implausible the directions are no human's: phi of what the robot reads (`mrhubo.robot.plausibility`), beyond that of the
            prior's own poses, and beyond three degrees
excess      joints of the pose that the robot reads leave their anatomical range
shake       limbs change their course faster than a person's can: noise; only where a frame rate is known

They are put together by a logistic function whose weights a fit finds on poses of the body prior, whole and spoilt
(`mrhubo.retargeter.calibration`); without one, by weights that were found for NAO. A frame's confidence is that of its
least certain branch.

Legend: T frames, D directions, C branches, S = 4 signals.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import torch
from torch import Tensor
from torch.nn.functional import normalize

from mrhubo.body.skeleton import SIDE_OF
from mrhubo.errors import UserError
from mrhubo.reference import DirectionProblem, angle_between
from mrhubo.robot.parts import LimbPart
from mrhubo.robot.plausibility import Reading, turned_joints

GOOD_DEG = 15.0
"""Mean angle [deg] of a branch's limbs to the person's up to which an answer is good: one sees the same gesture."""
SIGNALS = ("miss", "implausible", "excess", "shake")
EXCESS_DEG, SHAKE_DEG = 30.0, 10.0
"""What makes 1 of these signals. Of a miss, GOOD_DEG does, and half of that nothing yet, as inputs err too."""
ACCELERATION = 60.0
"""Angular acceleration of limbs [rad/s^2] that people reach now and then; in 24 frames a second 0.9 of ten frames of
lively mocap stay below it. A course that bends faster is noise, or nearly so."""
NEIGHBOURS = 2
"""Frames before and after one over which its noise is averaged."""
_TINY = 1e-12


@dataclass(frozen=True)
class Branch:
    """A part of the robot that turns apart from the others."""

    name: str
    columns: tuple[int, ...]
    """Directions by which its answer is measured: its limbs, or its axes where it has no limbs."""
    joints: tuple[int, ...]
    """Human joints (positions in POSED_JOINT_NAMES) that it reads."""


def branches_of(problem: DirectionProblem) -> tuple[Branch, ...]:
    """The branches of a robot that have something to be measured by, called after side and region of what they turn:
    `left_arm`, `right_arm`, `head`.
    """
    body_map, found = problem.body_map, []
    for turned_D in (problem.blocks.directions_DC.T > 0).tolist():
        rows = [i for i, turned in enumerate(turned_D) if turned]
        measured = [i for i in rows if i in body_map.measured]
        columns = [i for i in measured if isinstance(body_map.directions[i].part, LimbPart)] or measured
        if not columns:
            continue
        parts = [body_map.directions[i].part for i in columns]
        words = dict.fromkeys("_".join(filter(None, (SIDE_OF.get(part.joint), part.region))) for part in parts)
        joints = turned_joints(body_map.directions[i].part for i in rows)
        found.append(Branch("_and_".join(words), tuple(columns), tuple(joints)))
    return tuple(found)


@dataclass(frozen=True)
class Signals:
    """What tells about each branch of each frame (T, C); degrees, and phi."""

    miss_deg: Tensor
    phi: Tensor
    excess_deg: Tensor
    shake_deg: Tensor | None
    """None where no frame rate is known."""


def find_signals(
    branches: Sequence[Branch],
    human_TD3: Tensor,
    robot_TD3: Tensor,
    reading: Reading,
    shake_TD: Tensor | None,
) -> Signals:
    """The signals of some frames.

    Args:
        branches: the robot's.
        human_TD3: directions of the human poses, as of `BodyMap.human_directions`.
        robot_TD3: of the robot's answers, as of `BodyMap.robot_directions`.
        reading: what the robot reads of the human poses.
        shake_TD: `shake` of the human's directions.
    """

    def over(angle_TD: Tensor) -> Tensor:
        means = [angle_TD[:, list(branch.columns)].mean(dim=1) for branch in branches]
        return torch.rad2deg(torch.stack(means, dim=1))

    return Signals(
        over(angle_between(robot_TD3, human_TD3)),
        torch.stack([reading.phi(branch.joints) for branch in branches], dim=1),
        torch.rad2deg(torch.stack([reading.excess(branch.joints) for branch in branches], dim=1)),
        None if shake_TD is None else over(shake_TD),
    )


def shake(human_XTD3: Tensor, frame_rate: float) -> Tensor:
    """How far directions of motions (..., T, D, 3) are off the middle of those before and after (..., T, D) [rad],
    beyond what a person's acceleration explains; root mean square over a few frames. Motions of one or two frames tell
    nothing: 0.
    """
    *more, frames, directions, _ = human_XTD3.shape
    if frames < 3 or not human_XTD3.numel():
        return human_XTD3.new_zeros(*more, frames, directions)
    before, here, after = human_XTD3[..., :-2, :, :], human_XTD3[..., 1:-1, :, :], human_XTD3[..., 2:, :, :]
    off_XTD = angle_between(normalize(before + after, dim=-1), here)
    beyond_XTD = (off_XTD - 0.5 * ACCELERATION / frame_rate**2).clamp_min(0.0)
    squared_Y1T = beyond_XTD.square().transpose(-1, -2).reshape(-1, 1, frames - 2)
    padded_Y1T = torch.nn.functional.pad(squared_Y1T, (NEIGHBOURS + 1, NEIGHBOURS + 1), mode="replicate")
    mean_Y1T = torch.nn.functional.avg_pool1d(padded_Y1T, 2 * NEIGHBOURS + 1, 1)
    return mean_Y1T.clamp_min(0.0).sqrt().reshape(*more, directions, frames).transpose(-1, -2)


@dataclass(frozen=True)
class Weights:
    """logit = certain - sum of weight * signal; no weight is negative."""

    certain: float
    """Logit of a frame of which no signal says anything."""
    miss: float
    implausible: float
    excess: float
    shake: float

    def logit(self, signal_XS: Tensor) -> Tensor:
        """Logits (...) of signals (..., S), in the order of SIGNALS."""
        weight_S = signal_XS.new_tensor([getattr(self, name) for name in SIGNALS])
        return self.certain - signal_XS @ weight_S


@dataclass(frozen=True)
class ConfidenceModel:
    """Confidence of signals."""

    usual_phi: float
    """phi that one in twenty of the prior's own poses exceeds, and of three degrees at least; up to it a pose is as
    plausible as can be."""
    moving: Weights
    """Where a frame rate is known, and so how much a motion shakes."""
    still: Weights
    """Where none is."""

    def __call__(self, signals: Signals) -> Tensor:
        """Confidence (T, C), 0..1; what cannot be told is not trusted: 0."""
        weights = self.still if signals.shake_deg is None else self.moving
        return torch.nan_to_num(torch.sigmoid(weights.logit(scaled(signals, self.usual_phi))), nan=0.0)

    def to_json(self) -> str:
        """For the header of a package."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> ConfidenceModel:
        """What `to_json` gave.

        Raises:
            UserError: it is something else, holds no number, or a weight is negative.
        """
        try:
            content = json.loads(text)
            model = cls(float(content["usual_phi"]), _weights(content["moving"]), _weights(content["still"]))
        except (ValueError, OverflowError, TypeError, KeyError, AttributeError) as error:
            raise UserError("the confidence's weights are none that this version reads") from error
        numbers = [model.usual_phi, *asdict(model.moving).values(), *asdict(model.still).values()]
        lowest = [value for w in (model.moving, model.still) for name, value in asdict(w).items() if name in SIGNALS]
        if not all(map(math.isfinite, numbers)) or min(lowest) < 0 or model.usual_phi <= 0:
            raise UserError("the confidence's weights must be finite, and no signal's negative")
        return model


def _weights(content: Mapping[str, float]) -> Weights:
    return Weights(**{name: float(value) for name, value in content.items()})


def scaled(signals: Signals, usual_phi: float) -> Tensor:
    """Signals (T, C, S) in the order of SIGNALS, 0 where all is well, about 1 where it is not."""
    shaken = torch.zeros_like(signals.miss_deg) if signals.shake_deg is None else signals.shake_deg
    return torch.stack(
        (
            (2 * signals.miss_deg / GOOD_DEG - 1).clamp_min(0.0),
            torch.log(signals.phi.clamp_min(_TINY) / usual_phi).clamp_min(0.0),
            signals.excess_deg / EXCESS_DEG,
            shaken / SHAKE_DEG,
        ),
        dim=-1,
    )


STANDARD = ConfidenceModel(
    usual_phi=0.0006,
    moving=Weights(certain=3.3, miss=3.1, implausible=2.0, excess=1.0, shake=1.3),
    still=Weights(certain=2.5, miss=2.8, implausible=1.8, excess=1.0, shake=0.0),
)
"""Of a retargeter that was never calibrated: what NAO's is, rounded, and some weight for the excess."""
