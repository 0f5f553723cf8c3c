"""Steps of optimisation and other starts (`mrhubo.reference.solve`, `mrhubo.reference.polish`).

Legend: B frames, D directions, N joints, C blocks, U poses of the pool, S starts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.plain.human import norm
from mrhubo.fast.plain.robot import jacobian, place, unseen
from mrhubo.fast.plain.soles import add_soles
from mrhubo.fast.sections import Cost

TOLERANCE = 1e-4
"""A block whose joints all move by less [rad] in a step has converged."""
DAMPING, EASIER, HARDER, LEAST, MOST, STUCK, FLOOR = 1e-2, 0.1, 10.0, 1e-7, 1e6, 1e3, 0.01
"""At first; after a step that helped; after one that did not; its bounds; above which a step that does not help is the
last; and what is added to the Hessian's diagonal, which it multiplies. As `DirectionProblem` has them."""
SHORTEST = 1e-6
_CHUNK = 512
"""Frames that are worked on at a time: their numbers stay near the processor."""
FOLLOWED = 2
"""Steps of a stream with each frame."""


def chunks(frames: int, most: int) -> list[slice]:
    """Frames in pieces of so many at most."""
    return [slice(start, start + most) for start in range(0, frames, most)]


@dataclass
class Model:
    """Costs of blocks (B, C), and halves of gradient (B, N) and Hessian (B, N, N)."""

    cost_BC: np.ndarray
    gradient_BN: np.ndarray
    hessian_BNN: np.ndarray

    def rows(self, keep_B: np.ndarray) -> Model:
        """Of some frames alone."""
        return Model(self.cost_BC[keep_B], self.gradient_BN[keep_B], self.hessian_BNN[keep_B])

    def where(self, better_BC: np.ndarray, block_N: np.ndarray, other: Model) -> Model:
        """`other` in the blocks that are better."""
        better_BN = better_BC[:, block_N]
        return Model(
            np.where(better_BC, other.cost_BC, self.cost_BC),
            np.where(better_BN, other.gradient_BN, self.gradient_BN),
            np.where(better_BN[..., None], other.hessian_BNN, self.hessian_BNN),
        )


def quadratic(description: Description, q_BN: np.ndarray, target_BD3: np.ndarray) -> Model:
    """Cost and Gauss-Newton model at joint angles (B, N) [rad] for human directions (B, D, 3), or with places of soles
    after them (`mrhubo.fast.plain.soles`).
    """
    if len(q_BN) <= _CHUNK:
        return _quadratic(description, q_BN, target_BD3)
    parts = [_quadratic(description, q_BN[rows], target_BD3[rows]) for rows in chunks(len(q_BN), _CHUNK)]
    together = zip(*((part.cost_BC, part.gradient_BN, part.hessian_BNN) for part in parts), strict=True)
    return Model(*map(np.concatenate, together))


def _quadratic(description: Description, q_BN: np.ndarray, target_BD3: np.ndarray) -> Model:
    kinematics, cost, human = description.kinematics, description.cost, description.human
    placed = place(kinematics, q_BN)
    jacobian_D3NB = jacobian(kinematics, placed, len(cost.lower_N))
    unit_D3B, weight_DB = goals(cost, target_BD3)
    miss_D3B = placed.direction_D3B - unseen(human.seen_D, placed.view_V33B, unit_D3B)
    model = model_of(cost, q_BN, jacobian_D3NB, miss_D3B, weight_DB)
    if description.legs is not None and target_BD3.shape[1] > len(cost.weight_D):
        found = model.cost_BC, model.gradient_BN, model.hessian_BNN
        add_soles(description, description.legs, placed, target_BD3, *found)
    return model


def goals(cost: Cost, target_BD3: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Human directions of length 1 (D, 3, B), and how much each counts (D, B)."""
    target_D3B = np.ascontiguousarray(np.moveaxis(target_BD3[:, : len(cost.weight_D)], 0, -1))
    length_DB = np.sqrt(np.einsum("dib,dib->db", target_D3B, target_D3B))
    length_DB = np.where(cost.partial_D[:, None] > 0, length_DB, 1.0)
    return target_D3B / np.maximum(length_DB, SHORTEST)[:, None], cost.weight_D[:, None] * length_DB


def costs_of(cost: Cost, q_BN: np.ndarray, miss_D3B: np.ndarray, weight_DB: np.ndarray) -> np.ndarray:
    """What each block costs (B, C), by differences of directions in any axes."""
    from_middle_BN = q_BN - cost.middle_N
    cost_BC = (np.einsum("dib,dib->db", miss_D3B, miss_D3B) * weight_DB).T @ cost.directions_DC
    return cost_BC + (from_middle_BN * from_middle_BN * cost.ridge_N) @ cost.joints_NC


def model_of(
    cost: Cost, q_BN: np.ndarray, jacobian_D3NB: np.ndarray, miss_D3B: np.ndarray, weight_DB: np.ndarray
) -> Model:
    """The model by differences of directions and their Jacobian, both in the same axes."""
    cost_BC = costs_of(cost, q_BN, miss_D3B, weight_DB)
    gradient_BN = (q_BN - cost.middle_N) * cost.ridge_N
    hessian_BNN = np.zeros((*q_BN.shape, q_BN.shape[1]))
    for block in range(cost_BC.shape[1]):
        own_D, own_N = np.flatnonzero(cost.block_D == block), np.flatnonzero(cost.block_N == block)
        rows_RN3B = jacobian_D3NB.swapaxes(1, 2)[own_D[:, None], own_N]
        weighted_RN3B = rows_RN3B * weight_DB[own_D, None, None]
        gradient_BN[:, own_N] += np.einsum("rnib,rib->nb", weighted_RN3B, miss_D3B[own_D]).T
        own_NNB = np.einsum("rnib,rmib->nmb", weighted_RN3B, rows_RN3B)
        hessian_BNN[:, own_N[:, None], own_N] = np.moveaxis(own_NNB, -1, 0)
    diagonal(hessian_BNN)[:] += cost.ridge_N
    return Model(cost_BC, gradient_BN, hessian_BNN)


def diagonal(matrix_BNN: np.ndarray) -> np.ndarray:
    """A view (B, N) of the diagonals, which can be written to."""
    return np.einsum("bnn->bn", matrix_BNN)


def step(
    cost: Cost, q_BN: np.ndarray, model: Model, damping_BN: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> np.ndarray:
    """Damped Gauss-Newton step (B, N) [rad] of joints that no limit holds; `lower`, `upper`: limits (N,) or (B, N)."""
    frozen_BN = ((q_BN <= lower) & (model.gradient_BN > 0)) | ((q_BN >= upper) & (model.gradient_BN < 0))
    free_BN = 1.0 - frozen_BN
    diagonal_BN = diagonal(model.hessian_BNN)
    system_BNN = model.hessian_BNN * (free_BN[:, :, None] * free_BN[:, None, :])
    diagonal(system_BNN)[:] += np.where(frozen_BN, 1.0, damping_BN * (diagonal_BN + FLOOR))
    return -np.linalg.solve(system_BNN, (model.gradient_BN * free_BN)[..., None])[..., 0]


Quadratic = Callable[[Description, np.ndarray, np.ndarray], Model]
"""What `quadratic` is, however it is worked out."""


def minimise(
    description: Description,
    q_BN: np.ndarray,
    target_BD3: np.ndarray,
    steps: int,
    tolerance: float = TOLERANCE,
    quadratic: Quadratic = quadratic,
) -> tuple[np.ndarray, np.ndarray]:
    """Joint angles (B, N) [rad] after as many steps at most, and what each block costs there (B, C)."""
    cost = description.cost
    block_N, joints_NC = cost.block_N, cost.joints_NC
    model = quadratic(description, q_BN, target_BD3)
    found_BN, found_cost_BC = q_BN.copy(), model.cost_BC.copy()
    damping_BC = np.full_like(model.cost_BC, DAMPING)
    row_B = np.arange(len(q_BN))
    for _ in range(steps):
        moved_BN = step(cost, q_BN, model, damping_BC[:, block_N], cost.lower_N, cost.upper_N)
        trial_BN = np.clip(q_BN + moved_BN, cost.lower_N, cost.upper_N)
        trial = quadratic(description, trial_BN, target_BD3)
        better_BC = trial.cost_BC < model.cost_BC
        moved_BC = (np.abs(trial_BN - q_BN)[..., None] * joints_NC).max(axis=1)
        going_B = ~((moved_BC < tolerance) | (~better_BC & (damping_BC > STUCK))).all(axis=1)
        q_BN = np.where(better_BC[:, block_N], trial_BN, q_BN)
        model = model.where(better_BC, block_N, trial)
        damping_BC = np.clip(np.where(better_BC, damping_BC * EASIER, damping_BC * HARDER), LEAST, MOST)
        found_BN[row_B], found_cost_BC[row_B] = q_BN, model.cost_BC
        if not going_B.any():
            break
        if not going_B.all():
            row_B, q_BN, target_BD3, model = row_B[going_B], q_BN[going_B], target_BD3[going_B], model.rows(going_B)
            damping_BC = damping_BC[going_B]
    return found_BN, found_cost_BC


def follow(
    description: Description,
    q_BN: np.ndarray,
    target_BD3: np.ndarray,
    pull_B: np.ndarray,
    lower_BN: np.ndarray,
    upper_BN: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Joint angles (B, N) [rad] after a stream's steps on  cost + pull |q - where they began|^2,  inside bounds, and
    what each block costs there (B, C), without the pull. As `mrhubo.streaming.branches` makes them.
    """
    cost, centre_BN = description.cost, q_BN
    block_N, joints_NC = cost.block_N, cost.joints_NC
    pull_B1 = pull_B[:, None]
    model = quadratic(description, q_BN, target_BD3)
    damping_BC = np.full_like(model.cost_BC, DAMPING)
    for _ in range(FOLLOWED):
        hessian_BNN = model.hessian_BNN.copy()
        diagonal(hessian_BNN)[:] += pull_B1
        pulled = Model(model.cost_BC, model.gradient_BN + pull_B1 * (q_BN - centre_BN), hessian_BNN)
        moved_BN = step(cost, q_BN, pulled, damping_BC[:, block_N], lower_BN, upper_BN)
        trial_BN = np.clip(q_BN + moved_BN, lower_BN, upper_BN)
        trial = quadratic(description, trial_BN, target_BD3)
        pull_BC = pull_B1 * ((trial_BN - centre_BN) ** 2 - (q_BN - centre_BN) ** 2) @ joints_NC
        better_BC = trial.cost_BC + pull_BC < model.cost_BC
        q_BN = np.where(better_BC[:, block_N], trial_BN, q_BN)
        model = model.where(better_BC, block_N, trial)
        damping_BC = damping_BC * np.where(better_BC, EASIER, HARDER)
    return q_BN, model.cost_BC


def polish(description: Description, q_BN: np.ndarray, target_BD3: np.ndarray, steps: int) -> np.ndarray:
    """Joint angles (B, N) [rad] that cost no more than the given ones in any block: steps from there, and from other
    places for the blocks that are far off then.
    """
    cost, constants = description.cost, description.settings.constants
    q_BN, cost_BC = minimise(description, q_BN, target_BD3, steps)
    weight_BC = weights(cost, target_BD3)
    far_BC = cost_BC > weight_BC * constants["far_rad"] ** 2
    if not steps or not far_BC.any():
        return q_BN
    row_X = np.flatnonzero(far_BC.any(axis=1))
    other_XN, other_cost_XC = _again(description, q_BN[row_X], target_BD3[row_X], far_BC[row_X], steps)
    enough_XC = cost_BC[row_X] - weight_BC[row_X] * constants["gain_rad"] ** 2
    better_XC = far_BC[row_X] & (other_cost_XC < enough_XC)
    q_BN[row_X] = np.where(better_XC[:, cost.block_N], other_XN, q_BN[row_X])
    return q_BN


def weights(cost: Cost, target_BD3: np.ndarray) -> np.ndarray:
    """How much the directions of each block count together (B, C)."""
    return (norm(target_BD3[:, : len(cost.weight_D)]) * cost.weight_D) @ cost.directions_DC


def _again(
    description: Description, q_XN: np.ndarray, target_XD3: np.ndarray, far_XC: np.ndarray, steps: int
) -> tuple[np.ndarray, np.ndarray]:
    """What the blocks that are far off find from other starts, and its cost; the others stay."""
    cost, constants = description.cost, description.settings.constants
    starts, first = int(constants["starts"]), int(constants["first_steps"])
    start_XSN = np.where(far_XC[:, None, cost.block_N], near(cost, target_XD3, starts), q_XN[:, None])
    target_YD3 = np.repeat(target_XD3, starts, axis=0)
    found_YN, cost_YC = minimise(description, start_XSN.reshape(-1, q_XN.shape[1]), target_YD3, min(steps, first))
    return minimise(description, _best(cost, found_YN, cost_YC, starts), target_XD3, steps)


NEAREST_STEPS = 3
"""Steps from the nearest poses, where no network answers (`mrhubo.retargeter.nearest`)."""


def nearest(description: Description, target_BD3: np.ndarray) -> np.ndarray:
    """Joint angles (B, N) [rad] of robots without a network, float32: the best of the pool's poses after some steps."""
    cost, starts = description.cost, int(description.settings.constants["starts"])
    start_BSN, target_YD3 = near(cost, target_BD3, starts), np.repeat(target_BD3, starts, axis=0)
    found_YN, cost_YC = minimise(description, start_BSN.reshape(-1, start_BSN.shape[2]), target_YD3, NEAREST_STEPS)
    lower_N, upper_N = cost.lower_N.astype(np.float32), cost.upper_N.astype(np.float32)
    return np.clip(_best(cost, found_YN, cost_YC, starts).astype(np.float32), lower_N, upper_N)


def _best(cost: Cost, found_YN: np.ndarray, cost_YC: np.ndarray, starts: int) -> np.ndarray:
    """The cheapest of as many answers to each frame, block by block (B, N)."""
    best_BC = cost_YC.reshape(-1, starts, cost_YC.shape[1]).argmin(axis=1)
    found_BSN = found_YN.reshape(-1, starts, found_YN.shape[1])
    return np.take_along_axis(found_BSN, best_BC[:, None, cost.block_N], axis=1)[:, 0]


def near(cost: Cost, target_XD3: np.ndarray, starts: int) -> np.ndarray:
    """The pool's best pose of each cell, block by block (X, S, N) [rad]."""
    found_XSN = np.empty((len(target_XD3), starts, len(cost.lower_N)))
    for block in range(len(cost.cell_CU)):
        own_D, own_N = np.flatnonzero(cost.block_D == block), np.flatnonzero(cost.block_N == block)
        wanted_XR = (target_XD3[:, own_D] * cost.weight_D[own_D, None]).reshape(len(target_XD3), -1)
        pool_UR = cost.pool_UD3[:, own_D].reshape(len(cost.pool_UD3), -1)
        for start in range(starts):
            cell_U = np.flatnonzero(cost.cell_CU[block] == start)
            score_XU = cost.pool_ridge_CU[block, cell_U] - 2 * wanted_XR.astype(np.float32) @ pool_UR[cell_U].T
            found_XSN[:, start, own_N] = cost.pool_UN[cell_U[score_XU.argmin(axis=1)]][:, own_N]
    return found_XSN
