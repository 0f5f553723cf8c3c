"""Latent inverse kinematics by a batched quasi-Newton method.

Legend: B batch, K used keypoints, Z latent numbers, W poses that are worked on at once. A shape that ends in W has the
batch last.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.body.latent import LatentProblem

_SAMPLES = 4_096
_WIDTH = {"cpu": 512, "cuda": 65_536}
"""Poses worked on at once: more leave a core's cache, fewer leave the time to the calls."""
_PATIENCE = 3
"""Small decreases in a row after which a pose has converged: one alone may be a step across a curved valley."""
_FIRST_RADIUS, _MAX_RADIUS = 0.3, 2.0
"""First and greatest trust radius, in units of the latent's standard deviation."""


def poses_at_once(device: torch.device) -> int:
    """How many poses to work on at once on a device."""
    return _WIDTH.get(device.type, 512)


@torch.no_grad()
def nearest_samples(problem: LatentProblem, target_BK3: Tensor) -> Tensor:
    """First guesses (B, Z): of 4,096 latents drawn from N(0, I), always the same, the one with the smallest cost.

    From z = 0 a descent ends in a poor local minimum for about one pose in ten.
    """
    generator = torch.Generator().manual_seed(0)
    z_SZ = torch.randn(_SAMPLES, problem.latent, generator=generator).to(target_BK3)
    points_SF = torch.cat([problem.keypoints_of(part) for part in z_SZ.split(1_024)]).flatten(1)
    prior_S = problem.w_prior * z_SZ.square().sum(-1)
    return torch.cat(
        [
            z_SZ[(problem.w_data * torch.cdist(part, points_SF).square() + prior_S).argmin(dim=1)]
            for part in target_BK3.flatten(1).split(1_024)
        ]
    )


@torch.no_grad()
def solve_quasi_newton(
    problem: LatentProblem,
    start_BZ: Tensor,
    target_BK3: Tensor,
    steps: int,
    tolerance: float = 3e-3,
    metric_ZZ: Tensor | None = None,
) -> Tensor:
    """Latents (B, Z) from the given start by BFGS, each pose with its own inverse Hessian, step length and stop.

    One evaluation of cost and gradient a step. The inverse Hessian starts from a metric that all poses share, so no
    Jacobian is made, and is updated by rejected steps too. Steps are no longer than the pose's trust radius, which
    follows the ratio of the decrease to what the quadratic model promised. A converged pose makes room for the next
    one, so that the batch stays wide to the end.

    Unlike Gauss-Newton and Levenberg-Marquardt it sees the curvature of the decoder, which matters where the target
    cannot be reached: with the pairs' weak `w_prior` it ends in lower minima. (Nocedal and Wright, "Numerical
    Optimization", 2006, algorithm 4.1 and equation 6.17.)

    Args:
        problem: cost and gradient.
        start_BZ: first guess.
        target_BK3: keypoints to reach [m].
        steps: evaluations after the first at which a pose is done, converged or not.
        tolerance: a pose is done when three steps in a row lower its cost by less than this share of it.
        metric_ZZ: first guess of the inverse Hessian; default: `LatentProblem.metric`.
    """
    count = len(start_BZ)
    found_BZ = start_BZ.clone()
    target_K3B = target_BK3.permute(1, 2, 0).contiguous()
    width = min(count, poses_at_once(start_BZ.device))
    active = _ActiveSet(problem, width, problem.metric if metric_ZZ is None else metric_ZZ)
    waiting = torch.arange(count, device=start_BZ.device)
    free = torch.arange(width, device=start_BZ.device)
    while True:
        fresh, waiting = waiting[: len(free)], waiting[len(free) :]
        active.load(free[: len(fresh)], fresh, start_BZ, target_K3B)
        if len(fresh) < len(free):
            active.remove(free[len(fresh) :])
        if not len(active.pose_W):
            return found_BZ
        done_W = active.step(steps, tolerance)
        # Exchanging poses costs about as much as a step of an eighth of them.
        while 8 * int(done_W.sum()) < len(done_W) and bool((~done_W).any()):
            done_W |= active.step(steps, tolerance)
        free = done_W.nonzero()[:, 0]
        found_BZ[active.pose_W[free]] = active.z_ZW[:, free].T


class _ActiveSet:
    """The state of the poses that `solve_quasi_newton` is working on."""

    def __init__(self, problem: LatentProblem, width: int, metric_ZZ: Tensor) -> None:
        latent, keypoints = problem.latent, len(problem.keypoints)
        like = metric_ZZ
        self.problem, self.metric_ZZ = problem, metric_ZZ
        self.pose_W = torch.zeros(width, dtype=torch.long, device=like.device)
        self.target_K3W = like.new_zeros(keypoints, 3, width)
        self.z_ZW, self.gradient_ZW = like.new_zeros(latent, width), like.new_zeros(latent, width)
        self.cost_W, self.radius_W, self.steps_W, self.small_in_a_row_W = (like.new_zeros(width) for _ in range(4))
        self.inverse_WZZ = like.new_zeros(width, latent, latent)
        self.direction_ZW = like.new_zeros(latent, width)  # inverse Hessian times gradient

    def load(self, columns: Tensor, poses: Tensor, start_BZ: Tensor, target_K3B: Tensor) -> None:
        """Puts new poses into free columns. With no gradient their first step evaluates their start."""
        self.pose_W[columns] = poses
        self.target_K3W[..., columns] = target_K3B[..., poses]
        self.z_ZW[:, columns] = start_BZ[poses].T
        self.gradient_ZW[:, columns] = 0.0
        self.direction_ZW[:, columns] = 0.0
        self.cost_W[columns] = torch.inf
        self.radius_W[columns] = _FIRST_RADIUS
        self.steps_W[columns] = -1.0
        self.small_in_a_row_W[columns] = 0.0
        self.inverse_WZZ[columns] = self.metric_ZZ

    def remove(self, columns: Tensor) -> None:
        """Closes columns that no pose is waiting for."""
        keep = torch.ones_like(self.pose_W, dtype=torch.bool)
        keep[columns] = False
        self.inverse_WZZ = self.inverse_WZZ[keep]
        for name, value in vars(self).items():
            if name.endswith("W"):
                setattr(self, name, value[..., keep])

    def step(self, steps: int, tolerance: float) -> Tensor:
        """One step of every pose; which of them are done (W,)."""
        fraction_W = (self.radius_W / _norm(self.direction_ZW)).clamp_max(1.0)
        step_ZW = -fraction_W * self.direction_ZW
        directional_W = (self.gradient_ZW * step_ZW).sum(0)  # derivative along the step
        trial_ZW = self.z_ZW + step_ZW
        cost_W, gradient_ZW = self.problem.cost_and_gradient(trial_ZW, self.target_K3W)
        accepted_W = cost_W <= self.cost_W + 1e-4 * directional_W  # False for NaN too
        decrease_W = self.cost_W - cost_W
        # Of the actual decrease to that of the quadratic model; infinite at the first evaluation.
        ratio_W = decrease_W / (directional_W.abs() * (1 - 0.5 * fraction_W))
        step_length_W = _norm(step_ZW)
        wider_W = torch.maximum(self.radius_W, 2 * step_length_W).clamp_max(_MAX_RADIUS)
        radius_W = torch.where(ratio_W > 0.25, self.radius_W, 0.4 * step_length_W)
        self.radius_W = torch.where(ratio_W > 0.7, wider_W, radius_W)
        self.steps_W += 1
        negligible_W = -directional_W < 0.1 * tolerance * self.cost_W
        small_W = torch.where(accepted_W, decrease_W < tolerance * cost_W, negligible_W)
        self.small_in_a_row_W = torch.where(small_W, self.small_in_a_row_W + 1, 0.0)
        done_W = (self.small_in_a_row_W >= _PATIENCE) | (self.radius_W < 1e-4) | (self.steps_W >= steps)
        self.z_ZW = torch.where(accepted_W, trial_ZW, self.z_ZW)
        self.cost_W = torch.where(accepted_W, cost_W, self.cost_W)
        self._update_inverse_hessian(step_ZW, gradient_ZW, accepted_W)
        return done_W

    def _update_inverse_hessian(self, step_ZW: Tensor, gradient_ZW: Tensor, accepted_W: Tensor) -> None:
        """BFGS update of the inverse Hessian, where the curvature along the step is positive; the next direction.

        The matrix is read once and written once: products with what it was before are known, those with what it
        becomes follow from them, as it changes by a matrix of rank two,
        u step' + step u', where u is `rank_two_ZW`.
        """
        gradient_change_ZW = gradient_ZW - self.gradient_ZW
        product_ZW = torch.bmm(self.inverse_WZZ, gradient_ZW.T[..., None])[..., 0].T
        inverse_change_ZW = product_ZW - self.direction_ZW
        curvature_W = (step_ZW * gradient_change_ZW).sum(0)
        convex_W = curvature_W > 1e-6 * _norm(step_ZW) * _norm(gradient_change_ZW)  # False for NaN too
        rho_W = torch.where(convex_W, 1 / curvature_W, 0.0)
        coefficient_W = rho_W * (1 + rho_W * (gradient_change_ZW * inverse_change_ZW).sum(0))
        rank_two_ZW = torch.where(convex_W, 0.5 * coefficient_W * step_ZW - rho_W * inverse_change_ZW, 0.0)
        rank_two_WZ, step_WZ = rank_two_ZW.T, step_ZW.T
        # Contiguous factors: with others torch makes the products one by one.
        self.inverse_WZZ.baddbmm_(torch.stack((rank_two_WZ, step_WZ), 2), torch.stack((step_WZ, rank_two_WZ), 1))
        self.gradient_ZW = torch.where(accepted_W, gradient_ZW, self.gradient_ZW)
        self.direction_ZW = torch.where(accepted_W, product_ZW, self.direction_ZW)
        self.direction_ZW += rank_two_ZW * (step_ZW * self.gradient_ZW).sum(0)
        self.direction_ZW += step_ZW * (rank_two_ZW * self.gradient_ZW).sum(0)


def _norm(vector_ZW: Tensor) -> Tensor:
    """Norm over the first axis; torch's own is several times slower there."""
    return vector_ZW.square().sum(0).sqrt()
