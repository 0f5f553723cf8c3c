"""Five iterations of the network that is the same for every robot (`mrhubo.universal.iterations`), float64 but for the
network's layers. All branches of a robot go on together, as they turn apart from each other.

Legend: B frames, K hypotheses or dampings, N joints, C blocks, D directions, S = 5 slots, W numbers of a joint.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.plain.networks import silu
from mrhubo.fast.plain.robot import jacobian, place, seen
from mrhubo.fast.plain.steps import FLOOR, Model, chunks, costs_of, diagonal, goals, minimise, model_of
from mrhubo.fast.sections import Universal

DAMPINGS = (3e-3, 3e-2, 0.5)
"""Of the steps that the network sees,"""
FINAL_DAMPINGS = (1e-4, 3e-2)
"""and of the iterations without it."""
KEPT = (4, 3, 1, 1)
"""How many hypotheses go into each iteration after the first."""
REFINED = 1
"""In how many of those the network answers too."""
REACH = 1.0
"""How far a correction goes at most [rad]."""
STEPS = 5
"""Levenberg-Marquardt's, for branches that the network does not know."""
_CHUNK = 256
_EPSILON = np.float32(1e-5)
"""Of `torch.nn.LayerNorm`."""


@dataclass(frozen=True)
class Goal:
    """What frames ask for."""

    unit_D3B: np.ndarray
    weight_DB: np.ndarray

    def several(self, count: int) -> Goal:
        """Each frame as often."""
        return Goal(np.repeat(self.unit_D3B, count, axis=-1), np.repeat(self.weight_DB, count, axis=-1))


@dataclass(frozen=True)
class Place:
    """What is known at joint angles (B, N) [rad]; directions as their parts see them."""

    q_BN: np.ndarray
    model: Model
    direction_D3B: np.ndarray
    jacobian_D3NB: np.ndarray
    axis_BN3: np.ndarray
    """Unit, as the parts of `Universal.view_E` see them."""


class Branches:
    """What is looked up once for a robot: the branch of each joint, and its directions.

    `known_N`: 1 where there is a branch; `row_N`: which one; `slot_NS`: its directions.
    """

    def __init__(self, description: Description, universal: Universal) -> None:
        cost = description.cost
        row_C = np.full(len(cost.cell_CU), -1)
        row_C[universal.block_E] = np.arange(len(universal.block_E))
        self.description, self.universal = description, universal
        self.known_N, self.row_N = row_C[cost.block_N] >= 0, row_C[cost.block_N]
        self.slot_NS = np.where(self.known_N[:, None], universal.slot_E5[self.row_N], -1)
        self.sense_N = universal.sense_N.astype(np.float64)

    @cached_property
    def apart_NN(self) -> np.ndarray:
        """Very low where two joints are of different branches, else 0; float32."""
        block_N = self.description.cost.block_N
        return np.where(block_N[:, None] == block_N, 0, -1e9).astype(np.float32)

    def at(self, q_BN: np.ndarray, goal: Goal) -> Place:
        """Everything there."""
        d, u = self.description, self.universal
        placed, see = place(d.kinematics, q_BN), d.human.seen_D
        turned_D3NB = jacobian(d.kinematics, placed, q_BN.shape[1])
        jacobian_D3NB = np.einsum("dijb,dinb->djnb", placed.view_V33B[see], turned_D3NB)
        direction_D3B = seen(see, placed.view_V33B, placed.direction_D3B)
        model = model_of(d.cost, q_BN, jacobian_D3NB, direction_D3B - goal.unit_D3B, goal.weight_DB)
        axis_N3B = np.einsum("nijb,nj->nib", placed.rotation_L33B[u.joint_N + 1], d.kinematics.axis_A3[u.joint_N])
        axis_N3B = seen(u.view_E[self.row_N], placed.view_V33B, axis_N3B)
        return Place(q_BN, model, direction_D3B, jacobian_D3NB, np.moveaxis(axis_N3B, -1, 0))

    def cost(self, q_BKN: np.ndarray, goal: Goal) -> np.ndarray:
        """What blocks cost (B, K, C)."""
        d, (batch, count, joints) = self.description, q_BKN.shape
        q_XN, goal = q_BKN.reshape(-1, joints), goal.several(count)
        placed = place(d.kinematics, q_XN)
        direction_D3X = seen(d.human.seen_D, placed.view_V33B, placed.direction_D3B)
        return costs_of(d.cost, q_XN, direction_D3X - goal.unit_D3B, goal.weight_DB).reshape(batch, count, -1)

    def steps(self, found: Place, damping_K: tuple[float, ...]) -> np.ndarray:
        """Damped Gauss-Newton steps (B, K, N) [rad], as `mrhubo.universal.objective.steps`."""
        cost, model, q_BN = self.description.cost, found.model, found.q_BN
        lower_BN, upper_BN = cost.lower_N - q_BN, cost.upper_N - q_BN
        frozen_BN = ((lower_BN >= 0) & (model.gradient_BN > 0)) | ((upper_BN <= 0) & (model.gradient_BN < 0))
        extra_BN, steps = diagonal(model.hessian_BNN) + FLOOR, []
        for damping in damping_K:
            damped_BNN = model.hessian_BNN.copy()
            diagonal(damped_BNN)[:] += damping * extra_BN
            step_BN = _solve(damped_BNN, -model.gradient_BN, frozen_BN)
            fixed_BN = np.clip(step_BN, lower_BN, upper_BN)
            hits_BN = fixed_BN != step_BN
            again_B = hits_BN.any(axis=1)
            if again_B.any():
                fixed_XN = np.where(hits_BN, fixed_BN, 0.0)[again_B]
                right_XN = -model.gradient_BN[again_B] - (damped_BNN[again_B] @ fixed_XN[..., None])[..., 0]
                held_XN = (frozen_BN | hits_BN)[again_B]
                found_XN = _solve(damped_BNN[again_B], right_XN, held_XN) + fixed_XN
                step_BN[again_B] = np.clip(found_XN, lower_BN[again_B], upper_BN[again_B])
            steps.append(step_BN)
        return np.stack(steps, axis=1)

    def joint_features(self, found: Place, goal: Goal, step_BKN: np.ndarray) -> np.ndarray:
        """What is seen of each joint (B, N, 44), as `mrhubo.universal.network` has them."""
        cost, q_BN, sense_N = self.description.cost, found.q_BN, self.sense_N
        joints, there_NS = q_BN.shape[1], self.slot_NS >= 0
        root_DB = np.sqrt(goal.weight_DB)
        rows_DNB3 = np.moveaxis(found.jacobian_D3NB, 1, -1) * root_DB[:, None, :, None]
        rows_NSB3 = rows_DNB3[self.slot_NS, np.arange(joints)[:, None]] * sense_N[:, None, None, None]
        rows_NSB3 *= there_NS[:, :, None, None]
        miss_DB3 = np.moveaxis((found.direction_D3B - goal.unit_D3B) * root_DB[:, None], 1, -1)
        pull_NSB = np.einsum("nsbi,nsbi->nsb", rows_NSB3, miss_DB3[self.slot_NS])
        rows_NSB3 = rows_NSB3 * self.universal.flip_E53[self.row_N][:, :, None]
        gradient_BN, diagonal_BN = found.model.gradient_BN, diagonal(found.model.hessian_BNN)
        ends = np.stack((cost.upper_N - q_BN, q_BN - cost.lower_N))
        up_BN, down_BN = np.where(sense_N > 0, ends, ends[::-1])
        away_BN, half_N = (q_BN - cost.middle_N) * sense_N, (cost.upper_N - cost.lower_N) / 2
        frozen_BN = ((ends[1] <= 0) & (gradient_BN > 0)) | ((ends[0] <= 0) & (gradient_BN < 0))
        ones_BN, siblings_N = np.ones_like(q_BN), cost.joints_NC.sum(axis=0)[cost.block_N]
        step_BNK = np.moveaxis(step_BKN * sense_N, 1, -1)
        numbers = [
            np.arcsinh(30 * gradient_BN * sense_N), np.sqrt(np.maximum(diagonal_BN, 0.0)), diagonal_BN,
            np.minimum(up_BN, 3.0), np.minimum(down_BN, 3.0), np.exp(up_BN / -0.1), np.exp(down_BN / -0.1),
            np.exp(up_BN / -0.5), np.exp(down_BN / -0.5), away_BN / half_N, ones_BN * np.minimum(half_N, 3.0), ones_BN,
            1.0 - frozen_BN, np.clip(away_BN, -3.0, 3.0), ones_BN / siblings_N,
        ]  # fmt: skip
        axis_BN3 = found.axis_BN3 * self.universal.axial_E3[self.row_N] * sense_N[:, None]
        rows_BNR = np.moveaxis(rows_NSB3, 2, 0).reshape(*q_BN.shape, -1)
        parts = (axis_BN3, rows_BNR, np.moveaxis(pull_NSB, -1, 0), np.clip(step_BNK, -1.5, 1.5))
        return np.concatenate((*parts, np.arcsinh(10 * step_BNK), np.stack(numbers, axis=-1)), axis=-1)

    def branch_features(self, found: Place, goal: Goal, first: bool) -> np.ndarray:
        """What is seen of each joint's branch (B, N, 37)."""
        u, batch = self.universal, len(found.q_BN)
        weight_ESB = goal.weight_DB[u.slot_E5] * (u.slot_E5 >= 0)[..., None]
        signs_ES3B = ((weight_ESB > 0)[:, :, None] * u.flip_E53[..., None]).astype(np.float64)
        vectors = [(array[u.slot_E5] * signs_ES3B).reshape(len(u.slot_E5), 15, batch)
                   for array in (found.direction_D3B, goal.unit_D3B)]  # fmt: skip
        cost_EB = np.log(found.model.cost_BC.T[u.block_E] + 1e-4) / 5
        told = (cost_EB[:, None], np.full_like(cost_EB[:, None], float(first)))
        seen_EFB = np.concatenate((*vectors, np.sqrt(weight_ESB), *told), axis=1)
        return np.moveaxis(seen_EFB, -1, 0)

    def answer(self, found: Place, goal: Goal, step_BKN: np.ndarray, first: bool) -> np.ndarray:
        """The network's next angles (B, K, N) [rad]: K hypotheses in the first iteration, else one."""
        w, (heads, _) = self.universal.weights, self.universal.size_2.tolist()
        batch, joints = found.q_BN.shape
        feature_BNF = self.joint_features(found, goal, step_BKN).astype(np.float32)
        seen_BEF = self.branch_features(found, goal, first).astype(np.float32)
        branch_BNW = (seen_BEF @ w["branch.weight"].T)[:, self.row_N]
        x_BNW = silu(feature_BNF @ w["joint.weight"].T + w["joint.bias"] + branch_BNW)
        scale = np.float32((x_BNW.shape[-1] // heads) ** -0.5)
        for layer in ("layers.0.", "layers.1."):
            parts = _affine(w, layer + "mix", _norm(w, layer + "norm1", x_BNW)).reshape(batch, joints, 3, heads, -1)
            query, key, value = parts.transpose(2, 0, 3, 1, 4)
            score_BANN = query @ key.swapaxes(-1, -2) * scale + self.apart_NN
            mixed_BNW = (_softmax(score_BANN) @ value).swapaxes(1, 2).reshape(batch, joints, -1)
            x_BNW = x_BNW + _affine(w, layer + "mixed", mixed_BNW)
            up_BNW = silu(_affine(w, layer + "up", _norm(w, layer + "norm2", x_BNW)))
            x_BNW = x_BNW + _affine(w, layer + "down", up_BNW)
        out_BNKO = _affine(w, "first" if first else "later", _norm(w, "norm", x_BNW)).reshape(batch, joints, -1, 4)
        step_BNK = np.moveaxis(step_BKN, 1, -1)
        moved_BNK = (_softmax(out_BNKO[..., :3]) * step_BNK[:, :, None]).sum(-1)
        moved_BNK = moved_BNK + REACH * np.tanh(out_BNKO[..., 3]) * self.sense_N[:, None]
        cost = self.description.cost
        return np.clip(found.q_BN[:, None] + moved_BNK.swapaxes(1, 2), cost.lower_N, cost.upper_N)


def _solve(matrix_BNN: np.ndarray, right_BN: np.ndarray, held_BN: np.ndarray) -> np.ndarray:
    """x (B, N) with A x = b among the components that are not held; those are 0."""
    free_BN = 1.0 - held_BN
    system_BNN = matrix_BNN * (free_BN[:, :, None] * free_BN[:, None, :])
    diagonal(system_BNN)[:] += held_BN
    return np.linalg.solve(system_BNN, (right_BN * free_BN)[..., None])[..., 0]


def _affine(w: Mapping[str, np.ndarray], name: str, x: np.ndarray) -> np.ndarray:
    return x @ w[f"{name}.weight"].T + w[f"{name}.bias"]


def _norm(w: Mapping[str, np.ndarray], name: str, x: np.ndarray) -> np.ndarray:
    x = x - x.mean(axis=-1, keepdims=True)
    return x / np.sqrt((x * x).mean(axis=-1, keepdims=True) + _EPSILON) * w[f"{name}.weight"] + w[f"{name}.bias"]


def _softmax(x: np.ndarray) -> np.ndarray:
    with np.errstate(under="ignore"):  # who has made this an error means other sums
        x = np.exp(x - x.max(axis=-1, keepdims=True))
    return x / x.sum(axis=-1, keepdims=True)


class Best:
    """The cheapest angles of each block that have been come by."""

    def __init__(self, q_BN: np.ndarray, cost_BC: np.ndarray, block_N: np.ndarray) -> None:
        self.q_BN, self.cost_BC, self._block_N = q_BN, cost_BC, block_N

    def see(self, q_BKN: np.ndarray, cost_BKC: np.ndarray, keep: int) -> np.ndarray:
        """Takes what is cheaper, and gives the cheapest (B, keep, N), block by block."""
        order_BKC = cost_BKC.argsort(axis=1, kind="stable")[:, :keep]
        kept_BKN = np.take_along_axis(q_BKN, order_BKC[..., self._block_N], axis=1)
        cost_BC = np.take_along_axis(cost_BKC, order_BKC[:, :1], axis=1)[:, 0]
        better_BC = cost_BC < self.cost_BC
        self.q_BN = np.where(better_BC[:, self._block_N], kept_BKN[:, 0], self.q_BN)
        self.cost_BC = np.where(better_BC, cost_BC, self.cost_BC)
        return kept_BKN


def joint_angles(branches: Branches, target_BD3: np.ndarray) -> np.ndarray:
    """Joint angles (B, N) [rad], inside the limits, float32, for human directions (B, D, 3)."""
    found = [_unroll(branches, target_BD3[rows]) for rows in chunks(len(target_BD3), _CHUNK)]
    cost = branches.description.cost
    lower_N, upper_N = cost.lower_N.astype(np.float32), cost.upper_N.astype(np.float32)
    q_BN = np.concatenate([np.empty((0, len(lower_N))), *found]).astype(np.float32)
    return np.minimum(np.maximum(np.nan_to_num(q_BN, nan=0.0), lower_N), upper_N)


def _unroll(branches: Branches, target_BD3: np.ndarray) -> np.ndarray:
    d = branches.description
    block_N, goal, batch = d.cost.block_N, Goal(*goals(d.cost, target_BD3)), len(target_BD3)
    q_BN = np.tile((d.cost.lower_N + d.cost.upper_N) / 2, (batch, 1))
    if branches.known_N.any():
        place = branches.at(q_BN, goal)
        best = Best(q_BN, place.model.cost_BC, block_N)
        tried_BKN = branches.answer(place, goal, branches.steps(place, DAMPINGS), first=True)
        cost_BKC = branches.cost(tried_BKN, goal)
        for turn, keep in enumerate(KEPT):
            kept_BKN = best.see(tried_BKN, cost_BKC, keep)
            goal_X = goal.several(kept_BKN.shape[1])
            place = branches.at(kept_BKN.reshape(-1, len(block_N)), goal_X)
            step_XKN = branches.steps(place, DAMPINGS if turn < REFINED else FINAL_DAMPINGS)
            first_XN = place.q_BN + step_XKN[:, 0]
            if turn < REFINED:
                network_XN = branches.answer(place, goal_X, step_XKN, first=False)[:, 0]
                ways = np.stack((network_XN, first_XN))
            else:
                ways = np.stack((first_XN, place.q_BN + step_XKN[:, 1]))
            tried_BKN, cost_BKC = _choose(branches, goal, ways.reshape(2, *kept_BKN.shape))
        best.see(tried_BKN, cost_BKC, 1)
        q_BN = np.where(branches.known_N, best.q_BN, q_BN)
    if not branches.known_N.all():
        q_BN = np.where(branches.known_N, q_BN, minimise(d, q_BN, target_BD3, STEPS)[0])
    return q_BN


def _choose(branches: Branches, goal: Goal, ways_2BKN: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The cheaper of two ways, block by block; the first of equal ones. Angles and costs."""
    first_BKC, second_BKC = (branches.cost(way_BKN, goal) for way_BKN in ways_2BKN)
    better_BKC = second_BKC < first_BKC
    better_BKN = better_BKC[..., branches.description.cost.block_N]
    return np.where(better_BKN, *ways_2BKN[::-1]), np.where(better_BKC, second_BKC, first_BKC)
