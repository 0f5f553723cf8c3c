"""Each measure sees what it is there to see: a robot that stands, and the same one spoilt in one way."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
import torch

from mrhubo import rotation
from mrhubo.evaluation.whole_body import WholeBodyScore, score_whole_body
from mrhubo.reference import OptimizationRetargeter
from tests.reference.standing.steppers import squat
from tests.reference.walkers import walker

FRAMES = 48


class _Measured:
    """A robot that squats, and its measures with something changed."""

    def __init__(self, folder: Path) -> None:
        self.body_map, self.motion = walker(folder), squat(FRAMES)
        found = OptimizationRetargeter(self.body_map)(self.motion)
        assert found.root_position is not None and found.root_quaternion_wxyz is not None
        turn_T33 = rotation.wxyz_to_matrix(found.root_quaternion_wxyz)
        self.answer = (found.q, found.root_position, turn_T33)

    def score(self, q=None, shift=None, turn=None) -> WholeBodyScore:  # noqa: ANN001 (tensors)
        q_TN, place_T3, turn_T33 = self.answer
        q_TN = q_TN if q is None else q_TN + q
        place_T3 = place_T3 if shift is None else place_T3 + shift
        return score_whole_body(
            self.body_map, self.motion, q_TN, place_T3, turn_T33 if turn is None else turn @ turn_T33
        )


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> _Measured:
    return _Measured(tmp_path_factory.mktemp("walker"))


def test_a_base_that_drifts_slides_and_leaves_the_path(measured: _Measured) -> None:
    drift_T3 = torch.linspace(0, 0.2, FRAMES)[:, None] * torch.tensor([1.0, 0.0, 0.0])
    plain, spoilt = measured.score(), measured.score(shift=drift_T3)
    speed = 20 * 24 / (FRAMES - 1)
    assert spoilt.slide_cm_s == pytest.approx(speed, abs=0.7) and spoilt.sliding == 1.0
    assert spoilt.path_cm_m - plain.path_cm_m == pytest.approx(10, abs=2)
    assert spoilt.human_slide_cm_s == plain.human_slide_cm_s < 0.5
    assert spoilt.parts_deg == plain.parts_deg


@pytest.mark.parametrize(("up", "sunk", "floating"), [(-0.03, 1.0, 0.0), (0.05, 0.0, 1.0), (-0.005, 0.0, 0.0)])
def test_soles_off_the_floor(measured: _Measured, up: float, sunk: float, floating: float) -> None:
    score = measured.score(shift=torch.tensor([0.0, 0.0, up]))
    assert (score.sunk, score.floating) == (sunk, floating)
    assert score.sunk_max_cm == pytest.approx(max(0.0, -100 * up), abs=0.1)
    assert score.floating_max_cm == pytest.approx(max(0.0, 100 * up), abs=1.0) or up < 0
    assert (
        score.height_cm == pytest.approx(measured.score().height_cm + 100 * up, abs=0.3)
        if up > 0
        else score.height_cm < 0.3
    )


def test_a_robot_that_looks_aside(measured: _Measured) -> None:
    turn_33 = rotation.axis_angle_to_matrix(torch.tensor([0.0, 0.0, 0.3]))
    assert measured.score(turn=turn_33).heading_deg == pytest.approx(17.2, abs=0.1)
    assert measured.score().heading_deg < 0.01


def test_joints_that_are_too_fast_or_out_of_range(measured: _Measured) -> None:
    assert measured.score().speed_max <= 1 and measured.score().outside == 0
    shake_TN = torch.zeros(FRAMES, len(measured.body_map.robot.joint_names))
    shake_TN[10, 3] = 1.0
    score = measured.score(q=shake_TN)
    assert score.speed_max > 1.5 and score.over_limit == pytest.approx(2 / (FRAMES - 1))
    assert measured.score(q=torch.full((1,), 10.0)).outside > 7


def test_a_leg_that_points_elsewhere(measured: _Measured) -> None:
    names, plain = measured.body_map.robot.joint_names, measured.score()
    bent_N = torch.zeros(len(names))
    bent_N[names.index("l_hip_pitch")] = 0.2
    spoilt = measured.score(q=bent_N)
    assert spoilt.parts_deg["knee"] > plain.parts_deg["knee"] + 3
    assert spoilt.parts_deg["elbow"] == pytest.approx(plain.parts_deg["elbow"], abs=1e-4)
    assert set(spoilt.parts_deg) == {"trunk", "elbow", "wrist", "knee", "ankle", "foot"}
    assert all(value == value for value in dataclasses.astuple(spoilt) if isinstance(value, float))
