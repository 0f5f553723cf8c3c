"""As `mrhubo.fast.plain.avoidance`, for one frame, or for several side by side (`mrhubo.fast.compiled.lanes`)."""

from __future__ import annotations

import math

from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.collision import apart, distance_gradient, far, far_apart, place_capsules, touches
from mrhubo.fast.compiled.contact_steps import foreseeing_step, look
from mrhubo.fast.compiled.cost import quadratic
from mrhubo.fast.compiled.human import dot
from mrhubo.fast.compiled.lanes import alike, choose, no, some
from mrhubo.fast.compiled.robot import place
from mrhubo.fast.compiled.tables import BALL_Z, CLEAR_Y, FIRST_Z, INNER, real, size, whole
from mrhubo.fast.plain.avoidance import STEPS, WEIGHT, WORTH
from mrhubo.fast.plain.collision import SHORT
from mrhubo.fast.plain.steps import DAMPING, EASIER, HARDER, LEAST, MOST, STUCK, TOLERANCE

_ROOT = math.sqrt(WEIGHT)


@njit(**INNER)
def add_contacts(t, work, gradient_N, hessian_NN):
    """Adds the pairs that are nearer than their clearance, where the robot is placed, to a model; what they cost."""
    place_capsules(t, work)
    cost = alike(work.lower_N[0], 0.0)
    for z in range(size(t, BALL_Z)):
        if far(t, work, z, 0.0):
            continue
        for y in range(whole(t, FIRST_Z, z), whole(t, FIRST_Z, z + 1)):
            margin = real(t, CLEAR_Y, y)
            if far_apart(t, work, y, margin):
                continue
            distance, point, between = apart(t, work, y)
            if some(distance < margin):
                cost += _add_contact(t, work, y, margin - distance, point, between, gradient_N, hessian_NN)
    return cost


@njit(**INNER)
def _add_contact(t, work, y, short, point, between, gradient_N, hessian_NN):
    """Adds one pair, which lacks so much [m] of its clearance where that is positive; what it costs."""
    joints, contact_N = len(gradient_N), work.contact_N
    scale = choose(short > 0, 1 / max(math.sqrt(dot(between, between)), SHORT), 0.0)
    distance_gradient(t, work, y, point, (between[0] * scale, between[1] * scale, between[2] * scale))
    for n in range(joints):
        if some(contact_N[n] != 0.0):
            gradient_N[n] -= WEIGHT * short * contact_N[n]
            for m in range(joints):
                hessian_NN[n, m] += WEIGHT * contact_N[n] * contact_N[m]
    short = max(short, 0.0)
    return WEIGHT * short * short


@njit(**INNER)
def whole_model(t, work, q_N, cost_C, gradient_N, hessian_NN):
    """The cost of all blocks and of contacts at joint angles [rad], for the goal in `work`, and its model."""
    for n in range(len(q_N)):
        for m in range(len(q_N)):
            hessian_NN[n, m] = 0.0  # what joints of two blocks share is of contacts alone
    quadratic(t, work, q_N, cost_C, gradient_N, hessian_NN)
    cost = add_contacts(t, work, gradient_N, hessian_NN)
    for c in range(len(cost_C)):
        cost += cost_C[c]
    return cost


@njit(**INNER)
def avoid(t, work, q_N):
    """Steps away from self-collision, for the goal in `work`; `q_N` are the joint angles before and after [rad].
    Returns whether none were needed, as all pairs keep their distance.
    """
    place(t, work, q_N)
    near = touches(t, work, True)
    if not some(near):
        return no(near)
    joints, live = len(q_N), choose(near, alike(work.lower_N[0], 1.0), 0.0)
    damping = alike(live, DAMPING)
    cost, count = look(t, work, q_N, _ROOT)
    for _ in range(STEPS):
        live = choose(foreseeing_step(t, work, q_N, damping, count) > WORTH, live, 0.0)
        if not some(live > 0):
            break
        found, count = look(t, work, work.trial_N, _ROOT)
        better, moved, back = (live > 0) & (found < cost), alike(live, 0.0), no(found < cost)
        for n in range(joints):
            moved = max(moved, abs(work.trial_N[n] - q_N[n]))
            q_N[n] = choose(better, work.trial_N[n], q_N[n])
        live = choose((moved < TOLERANCE) | (back & (damping > STUCK)), 0.0, live)
        if not some(live > 0):
            break
        cost = choose(better, found, cost)
        damping = min(max(damping * choose(better, EASIER, HARDER), LEAST), MOST)
        if some(back & (live > 0)):  # some are where they were
            _, count = look(t, work, q_N, _ROOT)
    return no(near)
