"""Finds the weights of a retargeter's confidence: on human poses of its body prior, whole and spoilt.

Of every pose it is known how the person stood, whatever is done to what the retargeter is given: nothing (for half of
them but rotations shared out differently, and the shaking of a good recording), noise, elbows bent backwards, joints
turned at random. So it is known which answers are good. No human motion is needed, as for everything else that a
robot's set-up takes. What is wrong and looks right, another plausible pose, no signal tells; there is none of it here,
so confidence says nothing about it.

Legend: B poses, C branches, S = 4 signals.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import torch
from scipy.optimize import minimize
from scipy.special import expit
from torch import Tensor

from mrhubo.fast.retargeter import POLISH
from mrhubo.motion import Motion, reshare
from mrhubo.reference import angle_between
from mrhubo.retargeter.confidence import GOOD_DEG, SIGNALS, ConfidenceModel, Weights, scaled, shake
from mrhubo.retargeter.judging import signals_of
from mrhubo.retargeter.package import Retargeter
from mrhubo.retargeter.spoiling import bent_backwards, dislocated, shaken

POSES = 2_000
_SHARES = {"whole": 0.6, "noise": 0.2, "backwards": 0.1, "dislocated": 0.1}
"""What becomes of the poses."""
_NOISE_DEG = (2.0, 30.0)
"""Standard deviation of a joint's noise; as many between 2 and 4 degrees as between 4 and 8."""
_RECORDING_DEG = 1.0
"""Most noise of a good recording."""
_BACKWARDS_DEG, _DISLOCATED_DEG, _DISLOCATED_SHARE = (30.0, 90.0), 120.0, 0.5
_RATE = 60.0
"""Frames per second of the moments before and after each pose."""
_FRAMES = 7
"""Moments of each pose: as many as its noise is averaged over, and one before and after."""
_USUAL = 0.95
"""Share of whole poses that have the usual phi or less,"""
_LEAST_PHI = 2 / 9 * math.radians(3.0) ** 2
"""which is that of joints pulled by three degrees at least: files of different skeletons differ by more, and an arm
that is no human's pulls the other one by a degree or two. A turn by a small angle a changes the six numbers by
4/3 a^2 in the sum of squares, in the mean over its axes."""
_RIDGE = 1e-4
"""Weight of the squared weights beside the mean loss: keeps those finite that nothing speaks against."""
_EXACT = {"maxiter": 1_000, "ftol": 1e-13, "gtol": 1e-8}
"""When the weights are found."""


@torch.no_grad()
def calibrate(retargeter: Retargeter, poses: int = POSES, seed: int = 0) -> ConfidenceModel:
    """The confidence model of a retargeter; takes some seconds."""
    generator = torch.Generator().manual_seed(seed)
    body_map, parts, device = retargeter.body_map, retargeter.body_map.keypoints.parts, retargeter.device
    latent_BZ = torch.randn(poses, retargeter.prior.latent, generator=generator)
    true_BJ33 = retargeter.prior.decode_matrices(latent_BZ.to(device)).cpu()
    ends = [round(poses * sum(list(_SHARES.values())[: i + 1])) for i in range(len(_SHARES))]
    whole, noisy, backwards = (slice(start, end) for start, end in zip([0, *ends], ends[:3], strict=False))
    given_BJ33 = true_BJ33.clone()
    half = slice(0, ends[0] // 2)
    given_BJ33[half] = reshare(Motion("", true_BJ33[half], frame_rate=1e-2), seed).local_TJ33  # a habit for each pose
    low, high = _BACKWARDS_DEG
    angle_B = low + (high - low) * torch.rand(ends[2] - ends[1], generator=generator)
    given_BJ33[backwards] = bent_backwards(true_BJ33[backwards], angle_B, parts)
    given_BJ33[ends[2] :] = dislocated(true_BJ33[ends[2] :], parts, _DISLOCATED_SHARE, _DISLOCATED_DEG, generator)
    noise_B = _RECORDING_DEG * torch.rand(poses, generator=generator)
    ratio = _NOISE_DEG[1] / _NOISE_DEG[0]
    noise_B[noisy] = _NOISE_DEG[0] * ratio ** torch.rand(ends[1] - ends[0], generator=generator)
    moments = [shaken(given_BJ33, noise_B, generator).to(device) for _ in range(_FRAMES)]
    # People who stand still, each for as many frames.
    seen_BFD3 = torch.stack([body_map.human_directions(moment) for moment in moments], dim=1)
    shake_BD = shake(seen_BFD3, _RATE)[:, _FRAMES // 2]
    seen_BJ33, target_BD3 = moments[_FRAMES // 2], seen_BFD3[:, _FRAMES // 2]
    q_BN = retargeter.answer(seen_BJ33, target_BD3, POLISH)
    answer_BD3 = body_map.robot_directions(body_map.robot.forward(q_BN))
    signals = signals_of(retargeter, target_BD3, answer_BD3, shake_BD)
    error_BD = torch.rad2deg(angle_between(answer_BD3, body_map.human_directions(true_BJ33.to(device))))
    error_BC = torch.stack([error_BD[:, list(b.columns)].mean(dim=1) for b in retargeter.branches], dim=1)
    good_X = (error_BC < GOOD_DEG).flatten().cpu()
    usual_phi = max(float(signals.phi[whole].flatten().quantile(_USUAL)), _LEAST_PHI)
    still = dataclasses.replace(signals, shake_deg=None)
    moving_XS, still_XS = (scaled(s, usual_phi).flatten(0, 1).cpu() for s in (signals, still))
    return ConfidenceModel(usual_phi, fit_weights(moving_XS, good_X), fit_weights(still_XS, good_X))


def fit_weights(signal_XS: Tensor, good_X: Tensor) -> Weights:
    """Weights of a logistic regression of what is good (X,) on signals (X, S), none negative, with a small ridge.

    A convex problem with bounds, by L-BFGS-B (R. Byrd et al., "A limited memory algorithm for bound constrained
    optimization", 1995).
    """
    seen_XS, wanted_X = signal_XS.double().numpy(), good_X.double().numpy()

    def loss(weight: np.ndarray) -> tuple[float, np.ndarray]:
        logit_X = weight[0] - seen_XS @ weight[1:]
        miss_X = (expit(logit_X) - wanted_X) / len(wanted_X)
        cost = np.mean(np.logaddexp(0.0, logit_X) - wanted_X * logit_X) + _RIDGE * np.square(weight[1:]).sum()
        slope = np.concatenate(([miss_X.sum()], 2 * _RIDGE * weight[1:] - miss_X @ seen_XS))
        return float(cost), slope

    begin = np.concatenate(([0.0], np.full(len(SIGNALS), math.log(2.0))))
    bounds = [(None, None), *[(0.0, None)] * len(SIGNALS)]
    found = minimize(loss, begin, jac=True, method="L-BFGS-B", bounds=bounds, options=_EXACT)
    return Weights(*(float(x) for x in found.x))
