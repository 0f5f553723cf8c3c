"""The functions that Python calls; what is compiled of them is kept on disk, beside the source or in the user's cache.

numba keeps what it compiled of a function until the function's own file changes, but not when what it calls does. So
these functions hold a checksum of all sources, which is a part of the key.

Legend: B frames, of arrays to work with those that are worked on together; D directions, N joints, F numbers that
networks see, E numbers between layers, M of links, T turned human joints, X branches.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled import avoidance, collision, judging, networks, polishing, steps, tables
from mrhubo.fast.compiled import human as humans
from mrhubo.fast.compiled import robot as robots
from mrhubo.fast.compiled.reading import read_quickly
from mrhubo.fast.kept import checksum, drop_others


class Kernels(NamedTuple):
    """Compiled functions."""

    look: Callable[..., Any]
    follow: Callable[..., Any]
    avoid: Callable[..., Any]
    retarget: Callable[..., Any]
    polish: Callable[..., Any]


CHECK, DIRECT, ANSWER = 1, 2, 4
"""What `look` does, added up."""
AT_ONCE = 48
"""Frames that go through networks together: so many that weights are read once for all of them, and so few that
their numbers stay in the processor's nearer memory."""


@cache
def make_kernels() -> Kernels:
    """The functions, the same for all retargeters; each is compiled when it is first called, which takes some seconds,
    or read from the cache.
    """
    version = checksum()

    @njit(cache=True, **tables.COMPILED)
    def look(t, skew, what, local_BJ33, target_BD3, out_BN):
        """Whether poses hold rotations (CHECK), their directions (DIRECT), and the joint angles that the networks give
        (ANSWER). Returns twice the number of the first frame that holds no rotations, one more where all is finite, as
        soon as there is one; else -1.
        """
        _ = version
        nets = tables.whole(t, tables.COUNT_6, tables.STAGES)
        frames = len(local_BJ33)
        at_once = min(AT_ONCE, frames) if what & ANSWER else 1
        rooms = networks.make_rooms(t, at_once, nets)
        link_BM = np.empty((at_once, 6 * out_BN.shape[1]), np.float32)
        feature_BF = np.empty((at_once, tables.size(t, tables.CENTER_F)), np.float32)
        unit_I3 = np.empty((tables.size(t, tables.INPUT_I), 3))
        places_L33 = np.empty((tables.size(t, tables.JOINT_P) + 2, 3, 3))
        for first in range(0, frames, max(at_once, 1)):
            count = min(at_once, frames - first)
            for k in range(count):
                b = first + k
                flaw = humans.flaw(local_BJ33, b, skew) if what & CHECK else 0
                if flaw:
                    return 2 * b + flaw % 2
                if what & DIRECT:
                    humans.directions(t, local_BJ33, b, places_L33, target_BD3)
                if what & ANSWER:
                    networks.features(t, local_BJ33, target_BD3, b, unit_I3, feature_BF, k)
            if what & ANSWER:
                networks.joint_angles(t, feature_BF, link_BM, rooms, out_BN, first, count)
        return -1

    @njit(cache=True, **tables.COMPILED)
    def follow(t, target_BD3, pull_B, lower_BN, upper_BN, q_BN, cost_BC):
        """A stream's steps from `q_BN`, where the answers will stand."""
        _ = version
        work = robots.make_work(t)
        for b in range(len(q_BN)):
            for n in range(q_BN.shape[1]):
                work.lower_N[n], work.upper_N[n] = lower_BN[b, n], upper_BN[b, n]
            steps.follow(t, work, target_BD3, b, pull_B[b], q_BN[b])
            for c in range(cost_BC.shape[1]):
                cost_BC[b, c] = work.cost_C[c]

    @njit(cache=True, **tables.COMPILED)
    def avoid(t, target_BD3, q_BN, staying):
        """Steps away from self-collision from `q_BN`, where answers will stand; `staying` as in `Engine.avoid`."""
        _ = version
        work = robots.make_work(t)
        for b in range(len(q_BN)):
            steps.aim(t, work, target_BD3, b)
            avoidance.avoid(t, work, q_BN[b], staying)

    @njit(cache=True, **tables.COMPILED)
    def retarget(
        t, activation, polish, avoid, judge, target_BD3, q_BN, shake_BX, error_BM, phi_B, collision_B, trust_BX
    ):  # fmt: skip
        """Makes steps from `q_BN`, where the answers will stand, and if `avoid` away from self-collision; and says how
        good they are, if `judge`. Where no steps are made, `collision_B` tells before which frames may collide.
        """
        _ = version
        work = robots.make_work(t)
        frames, turned = len(target_BD3), tables.size(t, tables.PARENT_T)
        nets = tables.whole(t, tables.COUNT_6, tables.STAGES) + 2
        at_once = min(AT_ONCE, frames) if judge else 1
        rooms = networks.make_rooms(t, at_once, nets if judge else 0)
        one_BE = rooms[0]
        turn_T33, local_BT33 = np.empty((turned + 1, 3, 3)), np.empty((at_once, turned, 3, 3))
        between_333, free_B = np.empty((3, 3, 3)), np.empty(at_once, np.bool_)
        angle_D, error_T, excess_T = np.empty(target_BD3.shape[1]), np.empty(turned), np.empty(turned)
        joints, measured, branches = q_BN.shape[1], error_BM.shape[1], trust_BX.shape[1]
        q_N = np.empty(joints)
        for first in range(0, frames, max(at_once, 1)):
            count = min(at_once, frames - first)
            for k in range(count):
                b, free = first + k, False
                if polish or avoid:
                    for n in range(joints):
                        q_N[n] = q_BN[b, n]
                    if polish:
                        steps.polish(t, work, target_BD3, b, q_N, polish)
                    else:
                        steps.aim(t, work, target_BD3, b)
                    if avoid:
                        free = avoidance.avoid(t, work, q_N, False)
                    for n in range(joints):
                        q_BN[b, n] = q_N[n]
                    free_B[k] = free and tables.whole(t, tables.COUNT_6, tables.APART)
                elif judge:
                    free_B[k] = not collision_B[b]
                if judge:
                    judging.read_pose(t, target_BD3, b, turn_T33, between_333, local_BT33[k])
                    judging.prior_input(local_BT33[k], one_BE, k)
            if not judge:
                continue
            judging.reconstruct(t, activation, rooms, count)
            for k in range(count):
                b = first + k
                for n in range(joints):
                    q_N[n] = q_BN[b, n]
                robots.place(t, work, q_N)
                judging.robot_angles(t, work, target_BD3, b, angle_D)
                for m in range(measured):
                    error_BM[b, m] = math.degrees(angle_D[tables.whole(t, tables.MEASURED, m)])
                collision_B[b] = not free_B[k] and collision.touches(t, work, False)
                for j in range(turned):
                    error_T[j] = judging.joint_error(local_BT33[k], j, one_BE, k, between_333)
                    excess_T[j] = judging.excess(t, j, local_BT33[k])
                phi_B[b] = 0.0
                for x in range(branches):
                    miss, phi, over = judging.branch_signals(t, angle_D, error_T, excess_T, x)
                    moving = len(shake_BX) > 0
                    trust_BX[b, x] = judging.confidence(t, moving, miss, phi, over, shake_BX[b, x] if moving else 0.0)
                    phi_B[b] = max(phi_B[b], phi)

    @njit(cache=True, **tables.COMPILED)
    def polish(t, steps, avoid, target_BD3, q_BN, near_B):
        """As `retarget`, the steps of many frames alone, from `q_BN` and into it. If `avoid`, `near_B` tells then which
        frames may collide.
        """
        _ = version
        polishing.polish_all(t, target_BD3, q_BN, steps)
        if avoid:
            polishing.avoid_all(t, target_BD3, q_BN, near_B)
            if not tables.whole(t, tables.COUNT_6, tables.APART):
                near_B[:] = True

    drop_others(look.stats.cache_path)
    return Kernels(*map(read_quickly, (look, follow, avoid, retarget, polish)))
