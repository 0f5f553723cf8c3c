"""What points left, up and forward does so in every frame."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mrhubo.frames import BASE_AXES, HUMAN_AXES, base_to_human, human_axes, human_to_world


@pytest.mark.parametrize("name", ["left", "up", "forward"])
def test_each_direction_keeps_its_meaning(name: str) -> None:
    human, base = np.eye(3)[HUMAN_AXES.index(name)], np.eye(3)[BASE_AXES.index(name)]
    assert base_to_human(base).tolist() == human.tolist()
    assert human_to_world(human).tolist() == base.tolist()
    assert base_to_human(torch.from_numpy(base)).tolist() == human.tolist()


def test_the_axes_are_those_of_smpl_and_rep_103() -> None:
    assert base_to_human(np.array([1.0, 2.0, 3.0])).tolist() == [2, 3, 1], "human = (y, z, x) of the base"
    points_P3 = np.random.default_rng(0).normal(size=(7, 3))
    np.testing.assert_array_equal(base_to_human(human_to_world(points_P3)), points_P3)


def test_frames_are_right_handed() -> None:
    for turned in (base_to_human(np.eye(3)), human_to_world(np.eye(3))):
        assert np.linalg.det(turned) == pytest.approx(1)


def test_human_axes_are_a_rotation_with_the_given_columns() -> None:
    forward, up = torch.tensor([0.6, 0.0, 0.8]), torch.tensor([-0.8, 0.0, 0.6])
    axes_33 = human_axes(torch.stack((forward, up)))
    torch.testing.assert_close(axes_33 @ axes_33.T, torch.eye(3))
    assert float(torch.linalg.det(axes_33)) == pytest.approx(1)
    torch.testing.assert_close(axes_33 @ torch.eye(3)[HUMAN_AXES.index("forward")], forward)
    torch.testing.assert_close(axes_33 @ torch.eye(3)[HUMAN_AXES.index("up")], up)
