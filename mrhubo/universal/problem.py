"""Branches, what is asked of them, and what is known of them at some angles.

Legend: B branches, N joints, S slots, K dampings.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Protocol, TypeVar

import torch
from torch import Tensor

from mrhubo.universal.chains import Chains, Local
from mrhubo.universal.objective import Bounds, Quadratic, quadratic, steps


class Branches(Protocol):
    """Branches that can be asked for directions."""

    def local(self, q_BN: Tensor) -> Local:
        """Directions and Jacobian."""
        ...

    def rows(self, rows: Tensor) -> Branches:
        """Some of them, in that order."""
        ...


@dataclass(frozen=True)
class Problem:
    """Branches, and what is asked of them."""

    branches: Branches
    bounds: Bounds
    target_BS3: Tensor
    weight_BS: Tensor

    @classmethod
    def of_chains(cls, chains: Chains, target_BS3: Tensor) -> Problem:
        """Random chains, and a target of each."""
        bounds = Bounds(chains.lower_BN, chains.upper_BN, chains.present_BN)
        return cls(chains, bounds, target_BS3, chains.weight_BS)

    def rows(self, rows: Tensor) -> Problem:
        """Some of them, in that order."""
        return Problem(self.branches.rows(rows), _rows(self.bounds, rows), self.target_BS3[rows], self.weight_BS[rows])

    def at(self, q_BN: Tensor) -> Place:
        """Everything that is known at joint angles."""
        with torch.no_grad():
            local = self.branches.local(q_BN)
            return Place(self, q_BN, local, quadratic(local, q_BN, self.bounds, self.target_BS3, self.weight_BS))


@dataclass(frozen=True)
class Place:
    """A problem at joint angles."""

    problem: Problem
    q_BN: Tensor
    local: Local
    model: Quadratic

    @property
    def cost_B(self) -> Tensor:
        """The cost; its gradient by the angles is exact where they have one."""
        cost_B = self.model.cost_B
        return cost_B + (2 * self.model.gradient_BN * (self.q_BN - self.q_BN.detach())).sum(-1)

    def steps(self, damping_BK: Tensor) -> Tensor:
        """Damped Gauss-Newton steps (B, K, N); dampings may be (1, K)."""
        damping_BK = damping_BK.to(self.q_BN).expand(len(self.q_BN), -1)
        with torch.no_grad():
            return steps(self.model, self.q_BN, self.problem.bounds, damping_BK)

    def moved(self, step_BN: Tensor) -> Place:
        """Where a step (B, N) [rad] leads, inside the limits: the sum of two roundings may lie beyond them."""
        return self.problem.at(self.problem.bounds.clip(self.q_BN.detach() + step_BN))

    def rows(self, rows: Tensor) -> Place:
        """Some of the problems, in that order."""
        return Place(self.problem.rows(rows), self.q_BN[rows], _rows(self.local, rows), _rows(self.model, rows))


Kind = TypeVar("Kind", Local, Quadratic, Bounds)


def _rows(arrays: Kind, rows: Tensor) -> Kind:
    return type(arrays)(*(getattr(arrays, field.name)[rows] for field in fields(arrays)))


def choose(first: Place, *others: Place) -> Place:
    """The cheapest of several places of one problem, row by row; the first of equal ones."""
    for other in others:
        better_B = other.model.cost_B < first.model.cost_B

        q_BN = torch.where(better_B[:, None], other.q_BN, first.q_BN)
        local, model = _merged(better_B, first.local, other.local), _merged(better_B, first.model, other.model)
        first = Place(first.problem, q_BN, local, model)
    return first


def _merged(better_B: Tensor, one: Kind, two: Kind) -> Kind:
    pairs = [(getattr(one, field.name), getattr(two, field.name)) for field in fields(one)]
    return type(one)(*(torch.where(better_B.view(-1, *[1] * (a.ndim - 1)), b, a) for a, b in pairs))
