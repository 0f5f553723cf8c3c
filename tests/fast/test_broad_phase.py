"""Groups of capsules against balls: what is far by them is far pair by pair."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from mrhubo.fast.plain.broad_phase import make_groups, reaches
from mrhubo.fast.sections import Capsules

BODIES, EACH = 5, 4


def drawn(seed: int) -> Capsules:
    """Capsules of five bodies; of most that are of different bodies, a pair."""
    rng = np.random.default_rng(seed)
    body_S = rng.permutation(np.repeat(np.arange(BODIES), EACH))
    first, second = np.triu_indices(len(body_S), 1)
    kept = (body_S[first] != body_S[second]) & (rng.random(len(first)) < 0.8)
    return Capsules(
        body_S=body_S,
        pair_Y2=np.stack((first, second), axis=1)[kept],
        end_S23=rng.normal(size=(len(body_S), 2, 3)) * 0.1,
        radius_S=rng.uniform(0.01, 0.1, len(body_S)),
    )


def test_every_pair_is_in_one_group() -> None:
    capsules = drawn(0)
    groups = make_groups(capsules)
    assert sorted(groups.order_Y) == list(range(len(capsules.pair_Y2)))
    for z, capsule in enumerate(groups.capsule_Z):
        pairs = capsules.pair_Y2[groups.order_Y[groups.first_Z[z] : groups.first_Z[z + 1]]]
        others = pairs[pairs != capsule]
        assert len(others) == len(pairs) > 0
        assert set(capsules.body_S[others]) == {groups.body_G[groups.ball_Z[z]]}


def test_a_ball_just_holds_the_capsules_of_its_body() -> None:
    for seed in range(20):
        capsules = drawn(seed)
        groups = make_groups(capsules)
        for body, centre_3, radius in zip(groups.body_G, groups.centre_G3, groups.radius_G, strict=True):
            own = capsules.body_S == body
            farthest = np.linalg.norm(capsules.end_S23[own] - centre_3, axis=-1) + capsules.radius_S[own, None]
            assert farthest.max() <= radius + 1e-12
            assert radius <= farthest.max() + 1e-12


def test_a_group_that_is_far_has_no_pair_that_is_near() -> None:
    skipped = 0
    for seed in range(20):
        capsules, rng = drawn(seed), np.random.default_rng(seed + 100)
        groups, reach_S = make_groups(capsules), reaches(capsules)
        margin_Y = rng.uniform(0, 0.05, len(capsules.pair_Y2))
        turn_L = Rotation.random(BODIES, rng).as_matrix()
        place_L3 = rng.normal(size=(BODIES, 3)) * 0.4
        end_S23 = np.einsum("sij,skj->ski", turn_L[capsules.body_S], capsules.end_S23) + place_L3[capsules.body_S, None]
        centre_G3 = np.einsum("gij,gj->gi", turn_L[groups.body_G], groups.centre_G3) + place_L3[groups.body_G]
        needed_Z = reach_S[groups.capsule_Z] + groups.radius_G[groups.ball_Z] + groups.most(margin_Y)
        apart_Z = np.linalg.norm(end_S23.mean(axis=1)[groups.capsule_Z] - centre_G3[groups.ball_Z], axis=1)
        for z in np.flatnonzero(apart_Z >= needed_Z):
            for y in groups.order_Y[groups.first_Z[z] : groups.first_Z[z + 1]]:
                one, two = capsules.pair_Y2[y]
                share = np.linspace(0, 1, 41)[:, None]
                line_one, line_two = (end_S23[s, 0] + share * (end_S23[s, 1] - end_S23[s, 0]) for s in (one, two))
                nearest = np.linalg.norm(line_one[:, None] - line_two[None], axis=-1).min()
                assert nearest - capsules.radius_S[[one, two]].sum() >= margin_Y[y] - 1e-9
                skipped += 1
    assert skipped > 500


def test_a_robot_without_capsules_has_no_groups() -> None:
    nothing = Capsules(
        body_S=np.zeros(0, int), pair_Y2=np.zeros((0, 2), int), end_S23=np.zeros((0, 2, 3)), radius_S=np.zeros(0)
    )
    groups = make_groups(nothing)
    assert not len(groups.ball_Z) and list(groups.first_Z) == [0] and not len(groups.most(np.zeros(0)))
