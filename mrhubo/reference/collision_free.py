"""A robot motion as near to the human's as it can be without the robot touching itself.

The cost of `solve` with one term more, self-collision, the same limits and the same solver, and ten times the
smoothness. The margin is wider than what the penalty gives way, so the result is free of collision, not nearly so;
where it still is not (every start of a frame ends in a collision), the motion rests in the free pose that is nearest in
time. Joints of this motion may turn faster than they can: where two ways out lie on two sides of an obstacle, a slow
motion between them would touch it.

Legend: B problems, T frames, S starts, D directions, N joints, C = 1 block.
"""

from __future__ import annotations

import torch
from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.reference.refine import refine_around, widen
from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.starts import StartPool
from mrhubo.reference.terms import SelfCollisionTerm, Smoothness
from mrhubo.reference.trajectory import best_path
from mrhubo.robot import BodyMap

_WEIGHTS = (1e3, 1e4)
_MARGIN = 0.005
_REACH = 12
_SWEEPS, _TOLERANCE = 20, 3e-3
"""Contacts come and go with each step: what more steps gain is lost again when the contacts weigh more."""
_SMOOTHER = 10.0


class CollisionFreeProblem(DirectionProblem):
    """The cost above for one body map."""

    def __init__(self, body_map: BodyMap, margin: float = _MARGIN) -> None:
        """`margin` [m] that links keep."""
        contact = SelfCollisionTerm(body_map.collision, margin, _WEIGHTS[-1])
        super().__init__(body_map, [contact])
        self.contact, self.collision = contact, body_map.collision


def avoid_collisions(
    problem: CollisionFreeProblem, pool: StartPool, q_TN: Tensor, target_TD3: Tensor, pull: float
) -> tuple[Tensor, Tensor]:
    """A motion (T, N) [rad] without collision, from the best one that may have some, and which frames had to rest (T,).

    Args:
        problem: cost and collision geometry.
        pool: where frames that cannot be freed by small steps start again.
        q_TN: the motion to begin with.
        target_TD3: the human's directions.
        pull: weight of |q_t - q_(t-1)|^2.

    Raises:
        UserError: no frame, and not even the robot's home pose, is free of collision.
    """
    rests_T = torch.zeros(len(q_TN), dtype=torch.bool, device=q_TN.device)
    # Pushed by many contacts, frames find different ways out; at the pull of free motion the way would change often.
    pull = _SMOOTHER * pull
    close_T = rests_T.index_fill(0, problem.collision.near(q_TN, problem.contact.margin).row_X, True)
    if not bool(close_T.any()):
        return q_TN, rests_T
    free_TN = _refine_around(problem, q_TN, close_T, target_TD3, pull)
    if bool((touching_T := problem.collision.collides(free_TN)).any()):
        again_TN = _start_again(problem, pool, free_TN, touching_T, target_TD3, pull)
        changed_T = (again_TN != free_TN).any(dim=1)
        free_TN = _refine_around(problem, again_TN, changed_T | touching_T, target_TD3, pull)
    if bool((rests_T := problem.collision.collides(free_TN)).any()):
        free_TN = _rest(problem, free_TN, rests_T)
    return free_TN, rests_T


def _refine_around(
    problem: CollisionFreeProblem, q_TN: Tensor, close_T: Tensor, target_TD3: Tensor, pull: float
) -> Tensor:
    """`refine` for the frames within half a second of those in `close_T`; the others stay."""
    for problem.contact.weight in _WEIGHTS:
        near_T = widen(close_T, _REACH)
        q_TN = refine_around(problem, q_TN, target_TD3, Smoothness(pull), near_T, _SWEEPS, _TOLERANCE)
    return q_TN


def _start_again(
    problem: CollisionFreeProblem, pool: StartPool, q_TN: Tensor, touching_T: Tensor, target_TD3: Tensor, pull: float
) -> Tensor:
    """The best path (T, N) through new candidates in the frames that touch and near them, elsewhere what there was."""
    count = pool.starts
    around_T = widen(touching_T, _REACH)
    candidates_TSN = q_TN[:, None].repeat(1, count + 1, 1)
    cost_TSC = problem.quadratic(q_TN, target_TD3).cost_BC[:, None].repeat(1, count + 1, 1)
    target_XD3 = target_TD3[around_T]
    found_YN, cost_YC = problem.minimise(
        pool.near(target_XD3).flatten(0, 1), target_XD3.repeat_interleave(count, dim=0), steps=25, tolerance=1e-3
    )
    candidates_TSN[around_T, 1:] = found_YN.unflatten(0, (-1, count))
    cost_TSC[around_T, 1:] = cost_YC.unflatten(0, (-1, count))
    # Whatever it costs, a candidate that touches is only taken where there is no other.
    touches_TS = problem.collision.collides(candidates_TSN.flatten(0, 1)).unflatten(0, candidates_TSN.shape[:2])
    return best_path(candidates_TSN, cost_TSC + 10.0 * touches_TS[..., None], problem.blocks.joints_NC, pull)[0]


def _rest(problem: CollisionFreeProblem, q_TN: Tensor, touching_T: Tensor) -> Tensor:
    """The motion with the pose of the nearest free frame in every frame that touches."""
    if bool(touching_T.all()):
        home_N = problem.robot.home()
        if bool(problem.collision.collides(home_N[None])):
            raise UserError(
                f"{problem.robot.urdf}: the robot collides with itself in every pose that was tried, its home pose"
                " among them; check the collision geometry"
            )
        return home_N.expand_as(q_TN).clone()
    free_X = torch.nonzero(~touching_T)[:, 0]
    frames_T = torch.arange(len(q_TN), device=q_TN.device)
    nearest_T = free_X[(frames_T[:, None] - free_X[None]).abs().argmin(dim=1)]
    return q_TN[nearest_T]
