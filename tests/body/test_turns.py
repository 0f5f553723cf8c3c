"""How some joints are turned, without the others."""

from __future__ import annotations

import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo import rotation
from mrhubo.body.skeleton import JOINT_NAMES, Skeleton
from mrhubo.body.turns import JointTurns


@settings(max_examples=60, deadline=None)
@given(joints=st.lists(st.integers(0, len(JOINT_NAMES) - 1), min_size=1, max_size=22), seed=st.integers(0, 1000))
def test_they_are_the_skeletons_seen_from_each_other(joints: list[int], seed: int) -> None:
    """Whichever joints are asked for, on one branch or on several, more than once, the pelvis too."""
    local = rotation.axis_angle_to_matrix(torch.randn(3, 21, 3, generator=torch.Generator().manual_seed(seed)))
    found, wanted = JointTurns(joints)(local), Skeleton().global_rotations(local)[:, joints]
    torch.testing.assert_close(found[:, :1].mT @ found, wanted[:, :1].mT @ wanted, atol=1e-5, rtol=0)
