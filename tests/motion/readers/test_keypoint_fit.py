"""Bodies fit the sets that they are laid out in, and rotations of joints fit none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrhubo.body.joints import JOINT_NAMES, REST_K3
from mrhubo.fast.rotations import matrix_to_axis_angle
from mrhubo.motion import read_folder
from mrhubo.motion.readers.keypoint_fit import NONSENSE, fitting_sets, misfit

REST = dict(zip(JOINT_NAMES, np.tile(REST_K3[:22].astype(np.float64), (5, 1, 1)).transpose(1, 0, 2), strict=True))


def test_our_own_body_fits() -> None:
    assert misfit(REST) < NONSENSE / 2


@pytest.mark.parametrize(
    "moved",
    [
        {"spine2": [0.3, 0.1, 0.0]},  # a bent spine, as no back is
        {"pelvis": [0.0, -0.6, 0.0]},
        {"left_hip": [0.02, -0.1, 0.0], "right_hip": [-0.02, -0.1, 0.0]},
        {"spine3": REST["spine2"][0].tolist()},
    ],
)
def test_trunks_that_nobody_has_are_none(moved: dict[str, list[float]]) -> None:
    points = REST | {name: np.tile(place, (5, 1)) for name, place in moved.items()}
    assert np.isinf(misfit(points))


def test_rotations_of_motions_are_no_points(external_dir: Path) -> None:
    """Neither whole ones nor short parts, in which numbers of who hardly moves keep their distances, as bones do."""
    taken = 0
    for motion in read_folder(external_dir / "cmu" / "whole_body"):
        arrays = motion.arrays
        assert arrays.root_rotation_T33 is not None
        turn_TJ33 = np.concatenate([arrays.root_rotation_T33[:, None], arrays.local_TJ33], axis=1)
        axis_TJ3 = matrix_to_axis_angle(turn_TJ33.astype(np.float64))
        for part in (axis_TJ3, axis_TJ3[:30], axis_TJ3[len(axis_TJ3) // 2 :][:5]):
            fits = fitting_sets(part)
            taken += bool(fits) and fits[0][0] < NONSENSE
    assert not taken
