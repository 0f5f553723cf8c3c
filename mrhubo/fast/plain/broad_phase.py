"""Which pairs of capsules need a closer look, told by few and cheap distances.

Pairs are in groups, each of one capsule and some of another body. Around these there is a ball, so a group whose
capsule is far from the ball needs no look at its pairs: for a hand of a dozen capsules, one distance in place of a
dozen.

Legend: S capsules, Y pairs of them, G balls, Z groups of pairs, L bodies.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.fast.plain.human import norm
from mrhubo.fast.sections import Capsules


@dataclass(frozen=True)
class Groups:
    """The groups of one robot."""

    order_Y: np.ndarray
    """The pairs, group by group."""
    first_Z: np.ndarray
    """Where each group begins in that order, and last where all end (Z + 1,)."""
    capsule_Z: np.ndarray
    """The capsule that a group's pairs share,"""
    ball_Z: np.ndarray
    """and the ball around the others."""
    body_G: np.ndarray
    """The body that carries each ball,"""
    centre_G3: np.ndarray
    """its centre in that body's frame [m],"""
    radius_G: np.ndarray
    """and its radius [m]."""

    def most(self, value_Y: np.ndarray) -> np.ndarray:
        """The largest value of each group (Z,)."""
        return np.maximum.reduceat(value_Y[self.order_Y], self.first_Z[:-1]) if len(self.ball_Z) else np.zeros(0)


def reaches(capsules: Capsules) -> np.ndarray:
    """Radii (S,) of the spheres around capsules [m]."""
    return norm(capsules.end_S23[:, 1] - capsules.end_S23[:, 0]) / 2 + capsules.radius_S


def make_groups(capsules: Capsules) -> Groups:
    """The groups of a robot's pairs. Of two bodies, the ball is around that whose capsules fill the smaller one, as a
    large ball tells little.
    """
    body_S, pair_Y2 = capsules.body_S, capsules.pair_Y2
    balls = [_ball(capsules, np.flatnonzero(body_S == body)) for body in range(int(body_S.max(initial=-1)) + 1)]
    radius_L = np.array([radius for _, radius in balls])
    body_Y2 = body_S[pair_Y2]
    inner_Y = (radius_L[body_Y2[:, 1]] < radius_L[body_Y2[:, 0]]).astype(int)
    row_Y = np.arange(len(pair_Y2))
    ball_Y, capsule_Y = body_Y2[row_Y, inner_Y], pair_Y2[row_Y, 1 - inner_Y]
    order_Y = np.lexsort((capsule_Y, ball_Y))
    ball_Y, capsule_Y = ball_Y[order_Y], capsule_Y[order_Y]
    begins_Y = np.ones(len(row_Y), bool)
    begins_Y[1:] = (np.diff(ball_Y) != 0) | (np.diff(capsule_Y) != 0)
    first_Z = np.flatnonzero(begins_Y)
    body_G, ball_Z = np.unique(ball_Y[first_Z], return_inverse=True)
    return Groups(
        order_Y,
        np.append(first_Z, len(row_Y)),
        capsule_Y[first_Z],
        ball_Z,
        body_G,
        np.array([balls[body][0] for body in body_G]).reshape(-1, 3),
        radius_L[body_G],
    )


def _ball(capsules: Capsules, own_S: np.ndarray) -> tuple[np.ndarray, float]:
    """A ball around some capsules: its centre (3,) is that of the box around them."""
    if not len(own_S):
        return np.zeros(3), 0.0
    end_S23, radius_S11 = capsules.end_S23[own_S], capsules.radius_S[own_S, None, None]
    low_3, high_3 = (end_S23 - radius_S11).min(axis=(0, 1)), (end_S23 + radius_S11).max(axis=(0, 1))
    centre_3 = (low_3 + high_3) / 2
    return centre_3, float((norm(end_S23 - centre_3) + radius_S11[..., 0]).max())
