"""The functions that Python calls; what is compiled of them is kept on disk, beside the source or in the user's cache.

numba keeps what it compiled of a function until the function's own file changes, but not when what it calls does. So
these functions hold a checksum of all sources, which is a part of the key.

Legend: B frames, D directions, N joints, F numbers that networks see, T turned human joints, X branches.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import njit  # pyright: ignore[reportMissingImports]

from mrhubo.fast.compiled import avoidance, collision, judging, networks, steps, tables
from mrhubo.fast.compiled import human as humans
from mrhubo.fast.compiled import robot as robots
from mrhubo.fast.kept import checksum


class Kernels(NamedTuple):
    """Compiled functions."""

    wrong: Callable[..., Any]
    activate: Callable[..., Any]
    directions: Callable[..., Any]
    networks: Callable[..., Any]
    follow: Callable[..., Any]
    avoid: Callable[..., Any]
    retarget: Callable[..., Any]


STEPS, ALL, WITHOUT_PRIOR = range(3)
"""What `retarget` does: steps alone; steps and judging; judging alone, with the prior's answer given."""


@cache
def make_kernels() -> Kernels:
    """The functions, the same for all retargeters; each is compiled when it is first called, which takes some seconds,
    or read from the cache.
    """
    version = checksum()

    @njit(cache=True, **tables.EXACT)
    def wrong(local_BJ33, skew):
        """Twice the number of the first frame that holds no rotations, one more where all is finite; else -1."""
        _ = version
        for b in range(len(local_BJ33)):
            found = -1
            for j in range(local_BJ33.shape[1]):
                for x in range(3):
                    for y in range(3):
                        if not math.isfinite(local_BJ33[b, j, x, y]):
                            return 2 * b
                if humans.oblique(local_BJ33, b, j) > skew:
                    found = 2 * b + 1
            if found >= 0:
                return found
        return -1

    @njit(cache=True, **tables.COMPILED)
    def activate(kind, x_X, out_X):
        """An activation of all numbers."""
        _ = version
        networks.activate(kind, x_X, out_X, len(x_X))

    @njit(cache=True, **tables.COMPILED)
    def directions(t, local_BJ33, out_BD3):
        """Directions of poses."""
        _ = version
        places_L33 = np.empty((tables.size(t, tables.JOINT_P) + 2, 3, 3))
        for b in range(len(local_BJ33)):
            humans.directions(t, local_BJ33, b, places_L33, out_BD3)

    @njit(cache=True, **tables.COMPILED)
    def network(t, local_BJ33, target_BD3, out_BN):
        """Joint angles that the networks give."""
        _ = version
        widest = networks.widest(t)
        one_E, two_E, three_E = np.empty(widest, np.float32), np.empty(widest, np.float32), np.empty(widest, np.float32)
        link_M = np.empty(6 * out_BN.shape[1], np.float32)
        feature_F = np.empty(tables.size(t, tables.CENTER_F), np.float32)
        unit_I3 = np.empty((tables.size(t, tables.INPUT_I), 3))
        for b in range(len(target_BD3)):
            networks.features(t, local_BJ33, target_BD3, b, unit_I3, feature_F)
            networks.joint_angles(t, feature_F, link_M, one_E, two_E, three_E, out_BN, b)

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
    def avoid(t, target_BD3, q_BN):
        """Steps away from self-collision from `q_BN`, where the answers will stand."""
        _ = version
        work = robots.make_work(t)
        for b in range(len(q_BN)):
            steps.aim(t, work, target_BD3, b)
            avoidance.avoid(t, work, q_BN[b])

    @njit(cache=True, **tables.COMPILED)
    def retarget(
        t, activation, polish, avoid, what, target_BD3, q_BN, six_BF, shake_BX, error_BM, phi_B, collision_B, trust_BX
    ):  # fmt: skip
        """Makes steps from `q_BN`, where the answers will stand, and if `avoid` away from self-collision; and says how
        good they are. `six_BF`: the numbers of poses as the robot reads them (STEPS), or of their reconstructions
        (WITHOUT_PRIOR).
        """
        _ = version
        work = robots.make_work(t)
        turned, widest = tables.size(t, tables.PARENT_T), networks.widest(t)
        one_E, two_E, three_E = np.empty(widest, np.float32), np.empty(widest, np.float32), np.empty(widest, np.float32)
        turn_T33, local_T33 = np.empty((turned + 1, 3, 3)), np.empty((turned, 3, 3))
        between_333 = np.empty((3, 3, 3))
        angle_D, error_T, excess_T = np.empty(target_BD3.shape[1]), np.empty(turned), np.empty(turned)
        joints, measured, branches = q_BN.shape[1], error_BM.shape[1], trust_BX.shape[1]
        q_N = np.empty(joints)
        for b in range(len(target_BD3)):
            for n in range(joints):
                q_N[n] = q_BN[b, n]
            if polish and what != WITHOUT_PRIOR:
                steps.polish(t, work, target_BD3, b, q_N, polish)
                if avoid:
                    avoidance.avoid(t, work, q_N)
                for n in range(joints):
                    q_BN[b, n] = q_N[n]
                    q_N[n] = q_BN[b, n]
            judging.read_pose(t, target_BD3, b, turn_T33, between_333, local_T33)
            if what == STEPS:
                judging.prior_input(local_T33, one_E)
                for f in range(six_BF.shape[1]):
                    six_BF[b, f] = one_E[f]
                continue
            robots.place(t, work, q_N)
            judging.robot_angles(t, work, target_BD3, b, angle_D)
            for m in range(measured):
                error_BM[b, m] = math.degrees(angle_D[tables.whole(t, tables.MEASURED, m)])
            collision_B[b] = collision.touches(t, work, False)
            if what == ALL:
                judging.prior_input(local_T33, one_E)
                judging.reconstruct(t, activation, one_E, two_E, three_E)
            else:
                for f in range(six_BF.shape[1]):
                    one_E[f] = six_BF[b, f]
            for j in range(turned):
                error_T[j] = judging.joint_error(local_T33, j, one_E, between_333)
                excess_T[j] = judging.excess(t, j, local_T33)
            phi_B[b] = 0.0
            for x in range(branches):
                miss, phi, over = judging.branch_signals(t, angle_D, error_T, excess_T, x)
                moving = len(shake_BX) > 0
                trust_BX[b, x] = judging.confidence(t, moving, miss, phi, over, shake_BX[b, x] if moving else 0.0)
                phi_B[b] = max(phi_B[b], phi)

    return Kernels(wrong, activate, directions, network, follow, avoid, retarget)
