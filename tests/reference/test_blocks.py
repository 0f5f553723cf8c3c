"""Blocks are what couplings connect."""

from __future__ import annotations

from collections.abc import Callable

import torch
from hypothesis import given
from hypothesis import strategies as st

from mrhubo.reference import OptimizationRetargeter
from mrhubo.reference.blocks import Blocks, connected
from mrhubo.reference.collision_free import CollisionFreeProblem

sets = st.lists(st.sets(st.integers(0, 7), max_size=4), max_size=8)


@given(sets)
def test_blocks_share_no_joint_and_hold_every_set(couplings: list[set[int]]) -> None:
    blocks = connected(couplings)
    joints = [joint for _, found in blocks for joint in found]
    assert len(joints) == len(set(joints)) and set(joints) == set().union(*couplings)
    for number, members in enumerate(couplings):
        holding = [(rows, found) for rows, found in blocks if number in rows]
        assert len(holding) == bool(members) and all(members <= found for _, found in holding)
    assert [min(rows) for rows, _ in blocks] == sorted(min(rows) for rows, _ in blocks)


def test_a_joint_that_turns_no_direction_is_a_block_of_its_own() -> None:
    blocks = Blocks([{0}, {2, 0}, {0}, {1}, {2}], joints=3, directions=2)
    assert blocks.block_N.tolist() == [0, 1, 0]
    assert blocks.directions_DC.tolist() == [[1, 0], [1, 0]]


def test_a_further_term_joins_blocks(
    retargeters: dict[str, OptimizationRetargeter], random_pose: Callable[[int, int], torch.Tensor]
) -> None:
    plain = retargeters["reachy"].problem
    free = CollisionFreeProblem(plain.body_map)
    assert plain.blocks.joints_NC.shape == (17, 3) and free.blocks.joints_NC.shape == (17, 1)
    target_BD3 = plain.body_map.human_directions(random_pose(5, 1))
    home_BN = plain.robot.home().expand(5, -1)
    torch.testing.assert_close(
        free.quadratic(home_BN, target_BD3).cost_BC[:, 0], plain.quadratic(home_BN, target_BD3).cost_BC.sum(1)
    )
