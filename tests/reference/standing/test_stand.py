"""A robot's feet stand on the floor, flat and still, while the person's do; wherever that is, and whichever way it faces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.errors import InputWarning, UserError
from mrhubo.evaluation.whole_body import score_whole_body
from mrhubo.motion import Motion, read_motion
from mrhubo.reference import OptimizationRetargeter
from mrhubo.reference.result import OptimizationResult
from mrhubo.reference.standing import Legs
from mrhubo.robot import BodyMap, Robot
from tests.reference.standing.steppers import bow, jump, lie, lunge, moved, squat
from tests.reference.walkers import ROOTS, walker


@pytest.fixture(scope="module", params=ROOTS)
def retargeter(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> OptimizationRetargeter:
    return OptimizationRetargeter(walker(tmp_path_factory.mktemp("walker"), request.param))


def base(result: OptimizationResult) -> tuple[Tensor, Tensor]:
    assert result.root_position is not None and result.root_quaternion_wxyz is not None
    return result.root_position, rotation.wxyz_to_matrix(result.root_quaternion_wxyz)


def soles(retargeter: OptimizationRetargeter, result: OptimizationResult) -> tuple[np.ndarray, np.ndarray]:
    """Points (T, P, 3) and lowest heights (T, P) [m], z up."""
    legs = Legs(retargeter.body_map)
    found = legs.on_floor(retargeter.body_map.robot.forward(result.q), *base(result))
    return found.point_BP3.double().numpy(), legs.lowest(found.ball_BK3[..., 2].double().numpy())


def test_planted_feet_keep_still_and_flat(retargeter: OptimizationRetargeter) -> None:
    motion = squat()
    result = retargeter(motion)
    score = score_whole_body(retargeter.body_map, motion, result.q, *base(result))
    assert score.slide_cm_s < 0.5 and score.sliding < 0.05
    assert score.sunk_max_cm < 0.05 and score.floating_max_cm < 1.0
    assert score.parts_deg["knee"] < 4 and score.parts_deg["ankle"] < 4 and score.heading_deg < 0.01
    assert score.over_limit == 0 and score.outside == 0
    point_TP3, _ = soles(retargeter, result)
    assert np.ptp(point_TP3[..., :2], axis=0).max() < 0.01


@pytest.mark.parametrize(("waist", "most_deg"), [(False, 0.1), (True, 1.5)])
def test_the_root_may_do_what_the_waist_cannot(tmp_path: Path, waist: bool, most_deg: float) -> None:
    """The chest is then turned in the world as the person's, and feet stand as they do otherwise; arms see nothing of it."""
    found = {}
    for follows in ("pelvis", "between", "chest"):
        retargeter, motion = OptimizationRetargeter(walker(tmp_path, waist=waist, follows=follows)), bow(16, 8.0)
        result = retargeter(motion)
        score = score_whole_body(retargeter.body_map, motion, result.q, *base(result))
        assert score.slide_cm_s < 0.5 and score.sunk_max_cm < 0.05 and score.floating_max_cm < 1.5
        assert score.parts_deg["knee"] < 8 and score.parts_deg["ankle"] < 8
        names = retargeter.body_map.robot.joint_names
        found[follows] = score.chest_deg, result.q[:, ["shoulder" in name or "elbow" in name for name in names]]
    assert found["chest"][0] < most_deg and found["pelvis"][0] > 15
    assert found["between"][0] == pytest.approx(found["pelvis"][0] / 2, abs=1.0)
    torch.testing.assert_close(found["chest"][1], found["pelvis"][1], atol=1e-5, rtol=0)


def test_who_lies_on_a_side_does_not_stand_on_that_foot(retargeter: OptimizationRetargeter) -> None:
    """Its heel and toe rest on the floor, and its sole faces elsewhere."""
    motion = lie()
    result = retargeter(motion)
    score = score_whole_body(retargeter.body_map, motion, result.q, *base(result))
    assert result.contact is not None and result.contact.tolist() == [[False, True]] * len(motion)
    assert max(score.parts_deg[part] for part in ("knee", "ankle", "foot")) < 2 and score.sunk_max_cm < 0.05


def test_who_stands_on_the_hands_throughout_is_not_under_the_floor(retargeter: OptimizationRetargeter) -> None:
    motion = squat(12)
    over_33 = torch.diag(torch.tensor([1.0, -1.0, -1.0])).repeat(12, 1, 1)
    motion = motion.changed(root_rotation_T33=over_33, root_position_T3=torch.tensor([[0.0, 1.2, 0.0]]).repeat(12, 1))
    result = retargeter(motion)
    assert result.contact is not None and not result.contact.any()
    legs = Legs(retargeter.body_map)
    root_T3 = legs.root(retargeter.body_map.robot.forward(result.q), *base(result))
    assert root_T3[:, 2].min() > 0.2
    score = score_whole_body(retargeter.body_map, motion, result.q, *base(result))
    assert max(score.parts_deg[part] for part in ("knee", "ankle", "foot")) < 4


def test_a_root_that_jumps_leaves_the_robot_where_it_stands(retargeter: OptimizationRetargeter) -> None:
    motion = squat()
    assert motion.root_position_T3 is not None
    place_T3 = motion.root_position_T3.clone()
    place_T3[20:] += torch.tensor([3.0, 0.5, 0.0])
    with pytest.warns(InputWarning, match=r"person: the root jumps by 3.06 m to frame 20, counted from 0"):
        result = retargeter(motion.changed(root_position_T3=place_T3))
    torch.testing.assert_close(result.root_position, retargeter(motion).root_position, atol=0.03, rtol=0)
    with pytest.warns(InputWarning, match=r"jumps 47 times.* are its numbers metres"):
        retargeter(motion.changed(root_position_T3=100 * motion.root_position_T3 + 10 * torch.arange(48)[:, None]))


def test_who_cannot_stand_flat_on_both_feet_stands_on_both(retargeter: OptimizationRetargeter) -> None:
    """The ankle of the hind leg ends where the person's does not: its toe is to lift the robot off neither foot."""
    motion = lunge()
    result = retargeter(motion)
    score = score_whole_body(retargeter.body_map, motion, result.q, *base(result))
    assert score.sunk_max_cm < 0.05 and score.floating_max_cm < 0.5
    _, low_TP = soles(retargeter, result)
    assert low_TP[:, [2, 3]].max() > 0.01  # it is not flat


def test_soles_touch_the_floor_from_heel_strike_to_toe_off(root: Path, external_dir: Path) -> None:
    """NAO's swinging toes would be under the floor, and what lifts them must not lift the foot that stands."""
    nao = OptimizationRetargeter(BodyMap.of(Robot.from_config(root / "conf" / "nao-whole-body.yaml")))
    motion = read_motion(external_dir / "cmu" / "whole_body" / "16_17.npz")
    result = nao(motion)
    score = score_whole_body(nao.body_map, motion, result.q, *base(result))
    assert score.sunk_max_cm < 0.05 and score.floating_max_cm < 0.75
    assert score.slide_cm_s < 2 and score.over_limit == 0


def test_the_world_may_be_turned_and_its_floor_be_anywhere(retargeter: OptimizationRetargeter) -> None:
    """From a cold start, whichever way the person looks."""
    motion, scale = squat(24), Legs(retargeter.body_map).scale
    plain = retargeter(motion)
    for turn in (-2 * np.pi * np.random.default_rng(0).random(2)).tolist():
        other = retargeter(moved(motion, turn, (3.0, -1.2, 7.0)))
        torch.testing.assert_close(other.q, plain.q, atol=2e-3, rtol=0)
        turn_33 = rotation.axis_angle_to_matrix(torch.tensor([0.0, 0.0, turn]))
        (place_T3, turn_T33), (other_T3, other_T33) = base(plain), base(other)
        expected_T3 = place_T3 @ turn_33.T + scale * torch.tensor([7.0, 3.0, 0.0])
        torch.testing.assert_close(other_T3, expected_T3, atol=5e-3, rtol=0)
        torch.testing.assert_close(other_T33, turn_33 @ turn_T33, atol=1e-4, rtol=0)


def test_a_pelvis_that_was_lost_for_a_frame_turns_no_base(retargeter: OptimizationRetargeter) -> None:
    """Limbs stay where they are in the world, as where a marker of the pelvis alone is lost."""
    motion = squat()
    assert motion.root_rotation_T33 is not None
    turn_33 = rotation.axis_angle_to_matrix(torch.tensor([0.3, 0.1, 0.4]))
    root_T33, local_TJ33 = motion.root_rotation_T33.clone(), motion.local_TJ33.clone()
    root_T33[20] = root_T33[20] @ turn_33
    local_TJ33[20, :3] = turn_33.T @ local_TJ33[20, :3]
    plain, lost = retargeter(motion), retargeter(motion.changed(root_rotation_T33=root_T33, local_TJ33=local_TJ33))
    (place_T3, turn_T33), (other_T3, other_T33) = base(plain), base(lost)
    assert torch.rad2deg(rotation.geodesic_distance(other_T33, turn_T33)).max() < 1
    torch.testing.assert_close(other_T3, place_T3, atol=0.01, rtol=0)
    torch.testing.assert_close(lost.q, plain.q, atol=0.05, rtol=0)


def test_a_jump_is_as_high_as_the_persons_and_lands_on_the_floor(retargeter: OptimizationRetargeter) -> None:
    result = retargeter(jump())
    _, low_TP = soles(retargeter, result)
    assert low_TP.min() > -1e-3
    assert low_TP[24].min() == pytest.approx(0.15 * Legs(retargeter.body_map).scale, abs=0.05)
    assert low_TP[[0, 1, -2, -1]].max() < 0.01


def test_arms_are_what_they_are_without_a_root(retargeter: OptimizationRetargeter) -> None:
    motion = squat()
    names = retargeter.body_map.robot.joint_names
    arms = [n for n, name in enumerate(names) if "shoulder" in name or "elbow" in name]
    without = retargeter(motion.changed(root_position_T3=None, root_rotation_T33=None))
    assert without.root_position is None and without.root_quaternion_wxyz is None
    assert torch.equal(retargeter(motion).q[:, arms], without.q[:, arms])
    assert torch.equal(retargeter(motion.local_TJ33, 24.0).q, without.q)


@pytest.mark.parametrize("frames", [1, 2])
def test_a_frame_or_two_stand(retargeter: OptimizationRetargeter, frames: int) -> None:
    whole = squat().arrays
    motion = squat().changed(local_TJ33=whole.local_TJ33[:frames], root_rotation_T33=whole.root_rotation_T33[:frames],
                             root_position_T3=whole.root_position_T3[:frames])  # fmt: skip
    _, low_TP = soles(retargeter, retargeter(motion))
    assert abs(low_TP).max() < 5e-3


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"root_position_T3": torch.full((48, 3), torch.nan)}, "human pose 0 holds a root of NaN"),
        ({"root_position_T3": torch.full((48, 3), 1e9)}, "farther than 100 km"),
        ({"root_position_T3": torch.zeros(47, 3)}, r"its root must be a rotation \(48, 3, 3\) and a place \(48, 3\)"),
        ({"root_rotation_T33": 2 * torch.eye(3).repeat(48, 1, 1)}, "no rotation"),
    ],
)
def test_a_root_that_is_none_is_refused(
    retargeter: OptimizationRetargeter, changes: dict[str, Tensor], message: str
) -> None:
    with pytest.raises(UserError, match=message):
        retargeter(squat().changed(**changes))


def test_long_motions_are_worked_on_in_windows(
    retargeter: OptimizationRetargeter, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mrhubo.reference.standing.giving_way.WINDOW", 30)
    monkeypatch.setattr("mrhubo.reference.standing.giving_way.AHEAD", 12)
    motion = squat()
    result = retargeter(motion)
    score = score_whole_body(retargeter.body_map, motion, result.q, *base(result))
    assert score.slide_cm_s < 0.5 and score.speed_max <= 1


def test_who_has_no_feet_has_no_root(root: Path) -> None:
    assert OptimizationRetargeter(Robot.from_config(root / "conf" / "nao.yaml"))(squat(frames=4)).root_position is None


def test_a_measure_of_nothing_is_refused(tmp_path: Path) -> None:
    body_map = walker(tmp_path)
    motion: Motion = squat(frames=4).changed(root_position_T3=None)
    with pytest.raises(UserError, match="a whole body is measured by its root and feet"):
        score_whole_body(
            body_map, motion, body_map.robot.home().repeat(4, 1), torch.zeros(4, 3), torch.eye(3).repeat(4, 1, 1)
        )
