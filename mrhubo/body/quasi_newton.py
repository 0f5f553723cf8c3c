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
_CALM = 3
"""Small steps in a row after which a pose is done: one alone may be a step across a curved valley."""
_RADIUS, _LONGEST = 0.3, 2.0
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
    Jacobian is made, and learns from refused steps too. Steps are no longer than the pose's trust radius, which follows
    the ratio of the decrease to what the quadratic model promised. A converged pose makes room for the next one, so
    that the work stays wide to the end.

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
    work = _Work(problem, width, problem.metric if metric_ZZ is None else metric_ZZ)
    waiting = torch.arange(count, device=start_BZ.device)
    free = torch.arange(width, device=start_BZ.device)
    while True:
        fresh, waiting = waiting[: len(free)], waiting[len(free) :]
        work.take_in(free[: len(fresh)], fresh, start_BZ, target_K3B)
        if len(fresh) < len(free):
            work.drop(free[len(fresh) :])
        if not len(work.pose_W):
            return found_BZ
        done_W = work.step(steps, tolerance)
        # Exchanging poses costs about as much as a step of an eighth of them.
        while 8 * int(done_W.sum()) < len(done_W) and bool((~done_W).any()):
            done_W |= work.step(steps, tolerance)
        free = done_W.nonzero()[:, 0]
        found_BZ[work.pose_W[free]] = work.z_ZW[:, free].T


class _Work:
    """The state of the poses that `solve_quasi_newton` is working on."""

    def __init__(self, problem: LatentProblem, width: int, metric_ZZ: Tensor) -> None:
        latent, keypoints = problem.latent, len(problem.keypoints)
        like = metric_ZZ
        self.problem, self.metric_ZZ = problem, metric_ZZ
        self.pose_W = torch.zeros(width, dtype=torch.long, device=like.device)
        self.target_K3W = like.new_zeros(keypoints, 3, width)
        self.z_ZW, self.gradient_ZW = like.new_zeros(latent, width), like.new_zeros(latent, width)
        self.cost_W, self.radius_W, self.steps_W, self.calm_W = (like.new_zeros(width) for _ in range(4))
        self.inverse_WZZ = like.new_zeros(width, latent, latent)
        self.direction_ZW = like.new_zeros(latent, width)  # inverse Hessian times gradient

    def take_in(self, columns: Tensor, poses: Tensor, start_BZ: Tensor, target_K3B: Tensor) -> None:
        """Puts new poses into free columns. With no gradient their first step is a look at their start."""
        self.pose_W[columns] = poses
        self.target_K3W[..., columns] = target_K3B[..., poses]
        self.z_ZW[:, columns] = start_BZ[poses].T
        self.gradient_ZW[:, columns] = 0.0
        self.direction_ZW[:, columns] = 0.0
        self.cost_W[columns] = torch.inf
        self.radius_W[columns] = _RADIUS
        self.steps_W[columns] = -1.0
        self.calm_W[columns] = 0.0
        self.inverse_WZZ[columns] = self.metric_ZZ

    def drop(self, columns: Tensor) -> None:
        """Closes columns that no pose is waiting for."""
        keep = torch.ones_like(self.pose_W, dtype=torch.bool)
        keep[columns] = False
        self.inverse_WZZ = self.inverse_WZZ[keep]
        for name, value in vars(self).items():
            if name.endswith("W"):
                setattr(self, name, value[..., keep])

    def step(self, steps: int, tolerance: float) -> Tensor:
        """One step of every pose; which of them are done (W,)."""
        shorter_W = (self.radius_W / _length(self.direction_ZW)).clamp_max(1.0)
        move_ZW = -shorter_W * self.direction_ZW
        slope_W = (self.gradient_ZW * move_ZW).sum(0)
        trial_ZW = self.z_ZW + move_ZW
        cost_W, gradient_ZW = self.problem.cost_and_gradient(trial_ZW, self.target_K3W)
        taken_W = cost_W <= self.cost_W + 1e-4 * slope_W  # False for NaN too
        lower_W = self.cost_W - cost_W
        fit_W = lower_W / (slope_W.abs() * (1 - 0.5 * shorter_W))  # of the quadratic model; infinite at the first look
        stepped_W = _length(move_ZW)
        wider_W = torch.maximum(self.radius_W, 2 * stepped_W).clamp_max(_LONGEST)
        radius_W = torch.where(fit_W > 0.25, self.radius_W, 0.4 * stepped_W)
        self.radius_W = torch.where(fit_W > 0.7, wider_W, radius_W)
        self.steps_W += 1
        small_W = torch.where(taken_W, lower_W < tolerance * cost_W, -slope_W < 0.1 * tolerance * self.cost_W)
        self.calm_W = torch.where(small_W, self.calm_W + 1, 0.0)
        done_W = (self.calm_W >= _CALM) | (self.radius_W < 1e-4) | (self.steps_W >= steps)
        self.z_ZW = torch.where(taken_W, trial_ZW, self.z_ZW)
        self.cost_W = torch.where(taken_W, cost_W, self.cost_W)
        self._learn(move_ZW, gradient_ZW, taken_W)
        return done_W

    def _learn(self, move_ZW: Tensor, gradient_ZW: Tensor, taken_W: Tensor) -> None:
        """BFGS update of the inverse Hessian, where the curvature along the step is positive; the next direction.

        The matrix is read once and written once: products with what it was before are known, those with what it
        becomes follow from them, as it changes by side move' + move side'.
        """
        change_ZW = gradient_ZW - self.gradient_ZW
        product_ZW = torch.bmm(self.inverse_WZZ, gradient_ZW.T[..., None])[..., 0].T
        pulled_ZW = product_ZW - self.direction_ZW
        curvature_W = (move_ZW * change_ZW).sum(0)
        fit_W = curvature_W > 1e-6 * _length(move_ZW) * _length(change_ZW)  # False for NaN too
        rho_W = torch.where(fit_W, 1 / curvature_W, 0.0)
        stretch_W = rho_W * (1 + rho_W * (change_ZW * pulled_ZW).sum(0))
        side_ZW = torch.where(fit_W, 0.5 * stretch_W * move_ZW - rho_W * pulled_ZW, 0.0)
        side_WZ, move_WZ = side_ZW.T, move_ZW.T
        # Contiguous factors: with others torch makes the products one by one.
        self.inverse_WZZ.baddbmm_(torch.stack((side_WZ, move_WZ), 2), torch.stack((move_WZ, side_WZ), 1))
        self.gradient_ZW = torch.where(taken_W, gradient_ZW, self.gradient_ZW)
        self.direction_ZW = torch.where(taken_W, product_ZW, self.direction_ZW)
        self.direction_ZW += side_ZW * (move_ZW * self.gradient_ZW).sum(0)
        self.direction_ZW += move_ZW * (side_ZW * self.gradient_ZW).sum(0)


def _length(vector_ZW: Tensor) -> Tensor:
    """Norm over the first axis; torch's own is several times slower there."""
    return vector_ZW.square().sum(0).sqrt()
