"""As `mrhubo.fast.plain.contact_steps`, for one frame, or for several side by side (`mrhubo.fast.compiled.lanes`)."""

from __future__ import annotations

import math

from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled import systems
from mrhubo.fast.compiled.collision import apart, distance_gradient, far, far_apart, place_capsules
from mrhubo.fast.compiled.cost import quadratic
from mrhubo.fast.compiled.human import dot
from mrhubo.fast.compiled.lanes import alike, choose, no, some
from mrhubo.fast.compiled.tables import BALL_Z, CLEAR_Y, FIRST_Z, INNER, ORDER_N, real, size, whole
from mrhubo.fast.plain.collision import SHORT
from mrhubo.fast.plain.contact_steps import LEVEL, LITTLE, NEAR, SEARCHES, TINY, TURNS
from mrhubo.fast.plain.steps import FLOOR

_AWAY = -1e6
"""What stands for a pair that is out of reach in one lane and not in another: it never comes near."""


@njit(**INNER)
def look(t, work, q_N, root, more):
    """The model of what has no bend at joint angles [rad], for the goal in `work`, into `next_gradient_N` and
    `next_hessian_NN`; and the pairs that are so much farther apart than their clearance [m] at most, into `short_Y` and
    `rows_YN`. `root`: of what a pair's lack is weighted by. Returns what a frame costs, and how many pairs there are.
    """
    joints, hessian_NN = len(q_N), work.next_hessian_NN
    for n in range(joints):
        for m in range(joints):
            hessian_NN[n, m] = 0.0
    quadratic(t, work, q_N, work.next_cost_C, work.next_gradient_N, hessian_NN)
    cost, count = alike(work.next_cost_C[0], 0.0), 0
    for c in range(len(work.next_cost_C)):
        cost += work.next_cost_C[c]
    for n in range(joints):
        for m in range(n):  # the lower half of a block's, in its order, is filled
            both = hessian_NN[n, m] + hessian_NN[m, n]
            hessian_NN[n, m] = both
            hessian_NN[m, n] = both
    place_capsules(t, work)
    for z in range(size(t, BALL_Z)):
        if far(t, work, z, more):
            continue
        for y in range(whole(t, FIRST_Z, z), whole(t, FIRST_Z, z + 1)):
            margin = real(t, CLEAR_Y, y) + more
            if far_apart(t, work, y, margin):
                continue
            distance, point, between = apart(t, work, y)
            near = distance < margin
            if some(near):
                short = choose(near, root * (real(t, CLEAR_Y, y) - distance), _AWAY)
                scale = choose(near, root / max(math.sqrt(dot(between, between)), SHORT), 0.0)
                distance_gradient(t, work, y, point, (between[0] * scale, between[1] * scale, between[2] * scale))
                work.short_Y[count] = short
                for n in range(joints):
                    work.rows_YN[count, n] = 0.0 - work.contact_N[n]
                cost += max(short, 0.0) * max(short, 0.0)
                count += 1
    return cost, count


@njit(**INNER)
def add_pairs(work, lack_Y, count, gradient_N, hessian_NN):
    """Adds the pairs in `rows_YN` that cost something, the roots of which are `lack_Y`, to a model."""
    for k in range(count):
        lack = max(lack_Y[k], 0.0)
        if not some(lack > 0):
            continue
        active = choose(lack > 0, alike(lack, 1.0), 0.0)
        for n in range(len(gradient_N)):
            own = work.rows_YN[k, n]
            if some(own != 0.0):
                gradient_N[n] += own * lack
                own = own * active
                for m in range(len(gradient_N)):
                    hessian_NN[n, m] += own * work.rows_YN[k, m]


@njit(**INNER)
def foreseeing_step(t, work, q_N, damping, count):
    """The step from `q_N` into `trial_N`, by what `look` found there; returns how much less the model costs."""
    joints, at_N, turn_N = len(q_N), work.trial_N, work.step_N
    won, going = alike(damping, 0.0), alike(damping, 1.0)
    for n in range(joints):
        at_N[n] = q_N[n]
        work.slope_N[n] = work.next_gradient_N[n]
        work.extra_N[n] = damping * (work.next_hessian_NN[n, n] + FLOOR)
    for k in range(count):
        work.lack_Y[k] = work.short_Y[k]
        won += max(work.short_Y[k], 0.0) * max(work.short_Y[k], 0.0)
    for _ in range(TURNS):
        _turn(t, work, at_N, count)
        changed = _keep_within(work, at_N)
        begin, bend, down = alike(damping, 0.0), alike(damping, 0.0), alike(damping, 0.0)
        for n in range(joints):
            bent = work.extra_N[n] * turn_N[n]
            for m in range(joints):
                bent += work.next_hessian_NN[n, m] * turn_N[m]
            work.bent_N[n] = bent
            bend += bent * turn_N[n]
            begin += work.slope_N[n] * turn_N[n]
            down -= work.gradient_N[n] * turn_N[n]
        for k in range(count):
            along = alike(damping, 0.0)
            for n in range(joints):
                along += work.rows_YN[k, n] * turn_N[n]
            work.along_Y[k] = along
        going = choose(down > LITTLE, going, 0.0)
        share = choose(going > 0, _share(work, begin, bend, LEVEL * down, count), 0.0)
        for n in range(joints):
            at, lower, upper = at_N[n] + share * turn_N[n], work.lower_N[n], work.upper_N[n]
            at_N[n] = choose(at < lower + NEAR, lower, choose(at > upper - NEAR, upper, at))
            work.slope_N[n] += share * work.bent_N[n]
        changed = choose(share < 1, 1.0, changed)
        for k in range(count):
            before = work.lack_Y[k]
            after = before + share * work.along_Y[k]
            changed += choose((before > 0) & no(after > 0), 1.0, 0.0) + choose((after > 0) & no(before > 0), 1.0, 0.0)
            work.lack_Y[k] = after
        going = choose(changed > 0, going, 0.0)
        if not some(going > 0):
            break
    for k in range(count):
        won -= max(work.lack_Y[k], 0.0) * max(work.lack_Y[k], 0.0)
    for n in range(joints):
        won -= (work.slope_N[n] + work.next_gradient_N[n]) * (at_N[n] - q_N[n])
    return won


@njit(**INNER)
def _turn(t, work, at_N, count):
    """Newton's turn into `step_N`, and the slope where it begins into `gradient_N`."""
    joints, system_NN = len(at_N), work.hessian_NN
    for n in range(joints):
        work.gradient_N[n] = work.slope_N[n]
        for m in range(joints):
            system_NN[n, m] = work.next_hessian_NN[n, m]
        system_NN[n, n] += work.extra_N[n]
    add_pairs(work, work.lack_Y, count, work.gradient_N, system_NN)
    systems.begin(t, work, at_N, 0, joints)
    systems.solve(t, work, 0, joints, 0.0, 0.0)
    for x in range(joints):
        work.step_N[whole(t, ORDER_N, x)] = work.right_N[x]


@njit(**INNER)
def _keep_within(work, at_N):
    """Cuts a turn at the limits: each joint's, or all joints' together, what leads further downhill. Returns 1 where it
    was cut, or a limit held a joint, else 0.
    """
    least, changed = alike(at_N[0], 1.0), alike(at_N[0], 0.0)
    cut_slope, short_slope = alike(at_N[0], 0.0), alike(at_N[0], 0.0)
    for n in range(len(at_N)):
        turn = work.step_N[n]
        most = choose(turn > 0, work.upper_N[n], work.lower_N[n]) - at_N[n]
        over = abs(turn) > abs(most)
        cut = choose(over, most, turn)
        work.bent_N[n] = cut
        turn = choose(cut != 0.0, turn, 0.0)
        work.step_N[n] = turn
        cut_slope += work.gradient_N[n] * cut
        short_slope += work.gradient_N[n] * turn
        least = min(least, choose(over & (most != 0.0), most / choose(over, turn, 1.0), 1.0))
        changed = choose(over | (work.free_N[n] < 1), 1.0, changed)
    steeper = cut_slope < least * short_slope
    for n in range(len(at_N)):
        work.step_N[n] = choose(steeper, work.bent_N[n], least * work.step_N[n])
    return changed


@njit(**INNER)
def _share(work, begin, bend, level, count):
    low, high, share = alike(begin, 0.0), alike(begin, 1.0), alike(begin, 1.0)
    for _ in range(SEARCHES):
        slope, steep = begin + bend * share, bend
        for k in range(count):
            along = work.along_Y[k]
            there = max(work.lack_Y[k] + along * share, 0.0)
            slope += along * there
            steep += choose(there > 0, along * along, 0.0)
        far = abs(slope) > level
        if not some(far & ((slope > 0) | (share < 1))):
            break
        low, high = choose(slope > 0, low, share), choose(slope > 0, share, high)
        guess = share - slope / max(steep, TINY)
        middle = choose(low < 1, (low + high) * 0.5, 1.0)
        guess = choose((guess > low) & (guess < high), guess, middle)
        share = choose(far, guess, share)
    return share
