"""As `mrhubo.fast.plain.avoidance`, for one frame."""

from __future__ import annotations

import math

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled.collision import apart, distance_gradient, far, place_capsules, touches
from mrhubo.fast.compiled.cost import quadratic
from mrhubo.fast.compiled.human import dot
from mrhubo.fast.compiled.robot import place
from mrhubo.fast.compiled.steps import solve
from mrhubo.fast.compiled.tables import BALL_Z, CLEAR_Y, FIRST_Z, INNER, real, size, whole
from mrhubo.fast.plain.avoidance import STEPS, WEIGHT
from mrhubo.fast.plain.collision import SHORT
from mrhubo.fast.plain.steps import DAMPING, EASIER, HARDER, LEAST, MOST, STUCK, TOLERANCE


@njit(**INNER)
def add_contacts(t, work, gradient_N, hessian_NN):
    """Adds the pairs that are nearer than their clearance, where the robot is placed, to a model; what they cost."""
    place_capsules(t, work)
    cost = 0.0
    for z in range(size(t, BALL_Z)):
        if far(t, work, z):
            continue
        for y in range(whole(t, FIRST_Z, z), whole(t, FIRST_Z, z + 1)):
            margin = real(t, CLEAR_Y, y)
            distance, point, between = apart(t, work, y, margin)
            if distance < margin:
                cost += _add_contact(t, work, y, margin - distance, point, between, gradient_N, hessian_NN)
    return cost


@njit(**INNER)
def _add_contact(t, work, y, short, point, between, gradient_N, hessian_NN):
    """Adds one pair, which lacks so much [m] of its clearance; what it costs."""
    joints, contact_N = len(gradient_N), work.contact_N
    scale = 1 / max(math.sqrt(dot(between, between)), SHORT)
    distance_gradient(t, work, y, point, (between[0] * scale, between[1] * scale, between[2] * scale))
    for n in range(joints):
        if contact_N[n] != 0.0:
            gradient_N[n] -= WEIGHT * short * contact_N[n]
            for m in range(joints):
                hessian_NN[n, m] += WEIGHT * contact_N[n] * contact_N[m]
    return WEIGHT * short * short


@njit(**INNER)
def whole_model(t, work, q_N, cost_C, gradient_N, hessian_NN):
    """The cost of all blocks and of contacts at joint angles [rad], for the goal in `work`, and its model."""
    hessian_NN[:] = 0.0  # what joints of two blocks share is of contacts alone
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
    if not touches(t, work, True):
        return True
    joints, cost, damping = len(q_N), np.inf, DAMPING
    for n in range(joints):
        work.trial_N[n] = q_N[n]
    for number in range(STEPS + 1):  # the first looks at where it begins
        found = whole_model(t, work, work.trial_N, work.next_cost_C, work.next_gradient_N, work.next_hessian_NN)
        better, moved = number == 0 or found < cost, 0.0
        for n in range(joints):
            moved = max(moved, abs(work.trial_N[n] - q_N[n]))
        going = number == 0 or not (moved < TOLERANCE or (not better and damping > STUCK))
        if better:
            cost = found
            for n in range(joints):
                q_N[n], work.gradient_N[n] = work.trial_N[n], work.next_gradient_N[n]
                for m in range(joints):
                    work.hessian_NN[n, m] = work.next_hessian_NN[n, m]
        if number:
            damping = min(max(damping * (EASIER if better else HARDER), LEAST), MOST)
        if not going or number == STEPS:
            break
        solve(t, work, q_N, 0, joints, damping, 0.0)
        for n in range(joints):
            work.trial_N[n] = min(max(q_N[n] + work.step_N[n], work.lower_N[n]), work.upper_N[n])
    return False
