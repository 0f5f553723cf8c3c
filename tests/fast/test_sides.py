"""The other side of jumps in whole motions."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from mrhubo.fast.together.motion import FAR, _other_paths, sides

LIMIT, FRAMES = 3.0, 300


def test_each_block_has_sides_of_its_own() -> None:
    jumped_TC = np.zeros((10, 2), bool)
    jumped_TC[[3, 7], 0] = True
    side_T2C = sides(jumped_TC)
    np.testing.assert_array_equal(side_T2C[:, 0, 0], [0, 1, 2, 2, 2, 2, 2, 6, 6, 6])
    np.testing.assert_array_equal(side_T2C[:, 1, 0], [3, 3, 3, 7, 7, 7, 7, 7, 8, 9])
    np.testing.assert_array_equal(side_T2C[:, :, 1], np.arange(10)[:, None].repeat(2, axis=1))


def test_what_is_far_is_no_side() -> None:
    jumped_TC = np.zeros((3 * FAR, 1), bool)
    jumped_TC[FAR + 5] = True
    side_T2C, own_T = sides(jumped_TC)[..., 0], np.arange(3 * FAR)
    np.testing.assert_array_equal(side_T2C[:, 1] != own_T, (own_T >= 5) & (own_T < FAR + 5))
    np.testing.assert_array_equal(side_T2C[:, 0] != own_T, (own_T >= FAR + 5) & (own_T <= 2 * FAR + 4))


class OneJoint:
    """A joint of nearly a turn, that costs the square of the sine by which it points beside the target."""

    cost = SimpleNamespace(joints_NC=np.ones((1, 1)), block_N=np.zeros(1, int))

    def quadratic(self, q_TN: np.ndarray, target_T: np.ndarray) -> Any:
        return SimpleNamespace(cost_BC=2 - 2 * np.cos(q_TN - target_T[:, None]))

    def minimise(self, q_TN: np.ndarray, target_T: np.ndarray, *_: float) -> tuple[np.ndarray, np.ndarray]:
        turns_TN = np.round((q_TN - target_T[:, None]) / (2 * np.pi))
        found_TN = np.clip(target_T[:, None] + 2 * np.pi * turns_TN, -LIMIT, LIMIT)
        return found_TN, self.quadratic(found_TN, target_T).cost_BC


def test_a_joint_of_nearly_a_turn_stays_at_one_end() -> None:
    target_T = np.pi + 0.2 * np.sin(np.arange(FRAMES) / 20)  # behind, now more to the one side, now to the other
    path_TN = np.where(target_T < np.pi, LIMIT, -LIMIT)[:, None]
    assert (np.abs(np.diff(path_TN, axis=0)) > 5).sum() > 3
    for found_TN in (found := _other_paths(OneJoint(), path_TN, target_T, 0.5, 0)):  # type: ignore[arg-type]
        assert np.ptp(found_TN) < 0.3
    assert len(found) == 1  # the dearer path is the same


def test_where_jumps_are_worth_it_there_is_a_path_without_them_too() -> None:
    """What the joint loses on its way to the other end no path knows of: the slower one decides."""
    target_T = np.pi + 0.8 * np.sin(np.arange(FRAMES) / 47)
    path_TN = np.where(target_T < np.pi, LIMIT, -LIMIT)[:, None]
    assert (np.abs(np.diff(path_TN, axis=0)) > 5).sum() == 2
    cheap_TN, dear_TN = _other_paths(OneJoint(), path_TN, target_T, 0.5, 0)  # type: ignore[arg-type]
    assert np.ptp(cheap_TN) > 5 and np.ptp(dear_TN) < 1
