"""A step that foresees contacts is the least of its sum, whatever rounding says, and the same in PyTorch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import torch
from scipy.optimize import minimize

from mrhubo.fast.plain.contact_steps import Contacts, foreseeing_step
from mrhubo.fast.plain.steps import FLOOR, Model
from mrhubo.reference import contact_steps as in_pytorch
from mrhubo.reference.terms import Quadratic

FRAMES, JOINTS, PAIRS = 60, 7, 9


@dataclass(frozen=True)
class Bounds:
    """What a step reads of a robot's cost."""

    lower_N: np.ndarray
    upper_N: np.ndarray


@pytest.fixture(scope="module")
def problem() -> tuple[Bounds, np.ndarray, Model, np.ndarray, Contacts]:
    """Frames whose directions leave two joints nearly free, some joints at a limit, pairs on either side of the bend."""
    random = np.random.default_rng(0)
    bounds = Bounds(np.full(JOINTS, -0.3), np.full(JOINTS, 0.4))
    q_BN = np.clip(random.normal(0.0, 0.3, (FRAMES, JOINTS)), bounds.lower_N, bounds.upper_N)
    rows_BDN = random.normal(size=(FRAMES, JOINTS - 2, JOINTS))
    hessian_BNN = rows_BDN.swapaxes(1, 2) @ rows_BDN + 1e-3 * np.eye(JOINTS)
    model = Model(np.zeros((FRAMES, 1)), random.normal(0.0, 0.3, (FRAMES, JOINTS)), hessian_BNN)
    row_X = np.sort(random.integers(0, FRAMES, FRAMES * PAIRS))
    near = Contacts(row_X, random.normal(-0.2, 0.4, len(row_X)), random.normal(0.0, 6.0, (len(row_X), JOINTS)))
    return bounds, q_BN, model, np.geomspace(1e-4, 1.0, FRAMES), near


def step(cost: Bounds, *rest: object) -> tuple[np.ndarray, np.ndarray]:
    return foreseeing_step(cost, *rest)  # pyright: ignore[reportArgumentType]


def test_it_is_the_least_of_its_sum(problem: tuple[Bounds, np.ndarray, Model, np.ndarray, Contacts]) -> None:
    """Against SciPy, which goes on from the step itself: it finds hardly anything more to win."""
    bounds, q_BN, model, damping_B, near = problem
    found_BN, won_B = step(*problem)
    assert bool(((found_BN >= bounds.lower_N) & (found_BN <= bounds.upper_N)).all())
    assert bool((won_B > 0).all())
    missed = []
    for b in range(FRAMES):
        own = near.row_X == b
        damped_NN = model.hessian_BNN[b] + damping_B[b] * np.diag(np.diag(model.hessian_BNN[b]) + FLOOR)

        def total(q_N: np.ndarray, b: int = b, own: np.ndarray = own, damped_NN: np.ndarray = damped_NN) -> float:
            x_N = q_N - q_BN[b]
            lack_X = np.maximum(near.short_X[own] + near.rows_XN[own] @ x_N, 0.0)
            return float(2 * model.gradient_BN[b] @ x_N + x_N @ damped_NN @ x_N + lack_X @ lack_X)

        assert total(q_BN[b]) - total(found_BN[b]) == pytest.approx(won_B[b], rel=1e-6, abs=1e-8)
        limits = list(zip(bounds.lower_N, bounds.upper_N, strict=True))
        least = minimize(total, found_BN[b], bounds=limits, method="L-BFGS-B", options={"ftol": 1e-15}).fun
        missed.append((total(found_BN[b]) - least) / won_B[b])
    assert np.median(missed) < 1e-5 and max(missed) < 0.02


def test_rounding_chooses_nothing(problem: tuple[Bounds, np.ndarray, Model, np.ndarray, Contacts]) -> None:
    """A turn that ends where the sum is least leaves slopes of nothing but rounding; none of them decides."""
    bounds, q_BN, model, damping_B, near = problem
    found_BN, _ = step(*problem)
    noise_XN = 1 + 1e-13 * np.random.default_rng(1).normal(size=near.rows_XN.shape)
    shaken = Contacts(near.row_X, near.short_X, near.rows_XN * noise_XN)
    again_BN, _ = step(bounds, q_BN, model, damping_B, shaken)
    assert np.abs(again_BN - found_BN).max() < 1e-9


def test_frames_do_not_know_of_each_other(problem: tuple[Bounds, np.ndarray, Model, np.ndarray, Contacts]) -> None:
    bounds, q_BN, model, damping_B, near = problem
    found_BN, won_B = step(*problem)
    keep_B = np.arange(FRAMES) % 3 == 1
    some_BN, some_B = step(bounds, q_BN[keep_B], model.rows(keep_B), damping_B[keep_B], near.rows(keep_B))
    np.testing.assert_allclose(some_BN, found_BN[keep_B], atol=1e-10)
    np.testing.assert_allclose(some_B, won_B[keep_B], atol=1e-9)


def test_pytorch_makes_the_same(problem: tuple[Bounds, np.ndarray, Model, np.ndarray, Contacts]) -> None:
    bounds, q_BN, model, damping_B, near = problem
    found_BN, won_B = step(*problem)
    limits = torch.from_numpy(bounds.lower_N), torch.from_numpy(bounds.upper_N)
    quadratic = Quadratic(*map(torch.from_numpy, (model.cost_BC, model.gradient_BN, model.hessian_BNN)))
    contacts = in_pytorch.Contacts(*map(torch.from_numpy, (near.row_X, near.short_X, near.rows_XN)))
    again_BN, again_B = in_pytorch.foreseeing_step(
        limits, torch.from_numpy(q_BN), quadratic, torch.from_numpy(damping_B), contacts
    )
    np.testing.assert_allclose(again_BN.numpy(), found_BN, atol=1e-10)
    np.testing.assert_allclose(again_B.numpy(), won_B, atol=1e-9)
