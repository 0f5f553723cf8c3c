"""Inverse kinematics of the human body: the most plausible poses whose keypoints lie where they should.

Source: VPoser's inverse kinematics (Pavlakos et al., "Expressive Body Capture", CVPR 2019), its cost and its weights.
Legend: B batch, K keypoints.
"""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from mrhubo.body.latent import LatentProblem
from mrhubo.body.prior import BodyPrior
from mrhubo.body.quasi_newton import nearest_samples, solve_quasi_newton
from mrhubo.body.skeleton import Skeleton, keypoint_indices
from mrhubo.errors import UserError


def inverse_kinematics(
    prior: BodyPrior,
    targets: Mapping[str, Tensor],
    skeleton: Skeleton | None = None,
    w_data: float = 100.0,
    w_prior: float = 0.01,
    steps: int = 150,
) -> Tensor:
    """The most plausible poses (B, 21, 6), 6D, whose keypoints lie at the targets.

        minimise over z   w_data * sum_k |P_k(z) - P_k|^2 + w_prior * |z|^2

    Every pose is solved on its own by a quasi-Newton search, from the nearest of 4,096 samples of the prior.

    Args:
        prior: what a plausible pose is.
        targets: positions (B, 3) [m] by name of keypoint (`KEYPOINT_NAMES`), in the pelvis's frame: x to the body's
            left, y up, z forward, the pelvis at the origin.
        skeleton: whose keypoints they are; default: the open skeleton.
        w_data: weight of the squared distances, 1/m^2.
        w_prior: weight of the squared norm of the latent.
        steps: most iterations; a converged pose stops earlier.

    Raises:
        UserError: a name is unknown, no target is given, shapes differ, or a number is not finite.
    """
    if not targets:
        raise UserError("inverse kinematics: no keypoint is given")
    indices = keypoint_indices(list(targets))
    shapes = {name: tuple(target.shape) for name, target in targets.items()}
    if len(set(shapes.values())) > 1 or any(len(s) != 2 or s[1] != 3 for s in shapes.values()):
        raise UserError(f"inverse kinematics: targets must all have one shape (poses, 3), found {shapes}")
    target_BK3 = torch.stack([target.to(prior.decoder.identity_F) for target in targets.values()], dim=1)
    if not bool(torch.isfinite(target_BK3).all()):
        raise UserError("inverse kinematics: a target holds NaN or infinite numbers")
    skeleton = (skeleton or Skeleton()).to(prior.device)
    problem = LatentProblem(prior.decoder, skeleton, indices, w_data, w_prior)
    start = nearest_samples(problem, target_BK3)
    return prior.decode(solve_quasi_newton(problem, start, target_BK3, steps, tolerance=1e-4))
