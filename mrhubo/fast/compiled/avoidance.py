"""As `mrhubo.fast.plain.avoidance`, for one frame, or for several side by side (`mrhubo.fast.compiled.lanes`)."""

from __future__ import annotations

import math

from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.collision import touches
from mrhubo.fast.compiled.contact_steps import add_pairs, foreseeing_step, look
from mrhubo.fast.compiled.human import put, row, turn_back
from mrhubo.fast.compiled.lanes import alike, choose, no, some
from mrhubo.fast.compiled.robot import place
from mrhubo.fast.compiled.tables import INNER, LIMB_D, SEEN_D, size, whole
from mrhubo.fast.plain.avoidance import STEPS, WEIGHT, WORTH
from mrhubo.fast.plain.contact_steps import REACH
from mrhubo.fast.plain.steps import DAMPING, EASIER, HARDER, LEAST, MOST, STUCK, TOLERANCE

_ROOT = math.sqrt(WEIGHT)


@njit(**INNER)
def whole_model(t, work, q_N):
    """The cost of all blocks and of contacts at joint angles [rad], for the goal in `work`; its model stands in
    `next_gradient_N` and `next_hessian_NN`.
    """
    cost, count = look(t, work, q_N, _ROOT, 0.0)
    add_pairs(work, work.short_Y, count, work.next_gradient_N, work.next_hessian_NN)
    return cost


@njit(**INNER)
def _aim_at_own(t, work):
    """Takes the directions of the robot as it is placed as the goal, weighed as that in `work` was."""
    for d in range(size(t, LIMB_D)):
        put(work.goal_D3, d, turn_back(work.view_V33, whole(t, SEEN_D, d), row(work.direction_D3, d)))


@njit(**INNER)
def avoid(t, work, q_N, staying):
    """Steps away from self-collision, for the goal in `work`, or, if `staying`, for the directions that the robot has;
    `q_N` are the joint angles before and after [rad]. Returns whether none were needed, as all pairs keep their
    distance.
    """
    place(t, work, q_N)
    near = touches(t, work, True)
    if not some(near):
        return no(near)
    if staying:
        _aim_at_own(t, work)
    joints, live = len(q_N), choose(near, alike(work.lower_N[0], 1.0), 0.0)
    damping, cost, steps, stands = alike(live, DAMPING), alike(live, 0.0), 0, True
    for n in range(joints):
        work.trial_N[n] = q_N[n]
    while True:
        found, count = look(t, work, work.trial_N, _ROOT, REACH)
        if stands:
            cost = found
        else:
            better, moved, back = (live > 0) & (found < cost), alike(live, 0.0), no(found < cost)
            for n in range(joints):
                moved = max(moved, abs(work.trial_N[n] - q_N[n]))
                q_N[n] = choose(better, work.trial_N[n], q_N[n])
            live = choose((moved < TOLERANCE) | (back & (damping > STUCK)), 0.0, live)
            if not some(live > 0):
                break
            cost = choose(better, found, cost)
            damping = min(max(damping * choose(better, EASIER, HARDER), LEAST), MOST)
            if steps == STEPS:
                break
            if some(back & (live > 0)):  # some are where they were
                stands = True
                for n in range(joints):
                    work.trial_N[n] = q_N[n]
                continue
        live = choose(foreseeing_step(t, work, q_N, damping, count) > WORTH, live, 0.0)
        if not some(live > 0):
            break
        steps, stands = steps + 1, False
    return no(near)
