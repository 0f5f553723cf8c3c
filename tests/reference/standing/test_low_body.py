"""Hands, knees and the trunk of who kneels, crawls or lies are not under the floor; who stands on feet is as before."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo import rotation
from mrhubo.evaluation.whole_body import WholeBodyScore, lowest_of_body, score_whole_body
from mrhubo.motion import Motion
from mrhubo.reference import OptimizationRetargeter
from mrhubo.reference.result import OptimizationResult
from mrhubo.reference.standing import Legs, LowBody
from mrhubo.robot import Robot
from tests.reference.standing.steppers import crawl, kneel, lie, lie_prone, moved, squat, stand_on_hands
from tests.reference.walkers import ROOTS, walker

FLOOR = {
    "kneels": kneel(12),
    "crawls": crawl(12),
    "on the hands": stand_on_hands(12),
    "prone": lie_prone(12),
    "side": lie(12),
}


@pytest.fixture(scope="module", params=[*ROOTS, "nao"])
def retargeter(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, root: Path
) -> OptimizationRetargeter:
    if request.param == "nao":
        return OptimizationRetargeter(Robot.from_config(root / "conf" / "nao-whole-body.yaml"))
    return OptimizationRetargeter(walker(tmp_path_factory.mktemp("thick"), request.param, thick=True))


def measured(retargeter: OptimizationRetargeter, motion: Motion, result: OptimizationResult) -> WholeBodyScore:
    assert result.root_position is not None and result.root_quaternion_wxyz is not None
    turn_T33 = rotation.wxyz_to_matrix(result.root_quaternion_wxyz)
    return score_whole_body(retargeter.body_map, motion, result.q, result.root_position, turn_T33)


@pytest.mark.parametrize("name", FLOOR)
def test_nothing_is_under_the_floor(
    retargeter: OptimizationRetargeter, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    motion = FLOOR[name]
    result = retargeter(motion, avoid_collisions=name == "side")
    score = measured(retargeter, motion, result)
    assert score.body_sunk_max_cm < 0.01 and score.sunk_max_cm < 0.01
    assert score.over_limit == 0 and score.outside == 0 and score.jumps == 0
    monkeypatch.setattr(LowBody, "near", lambda *_: False)
    before = retargeter(motion)
    monkeypatch.undo()
    assert measured(retargeter, motion, before).slide_cm_s == pytest.approx(score.slide_cm_s, abs=0.5, nan_ok=True)
    if retargeter.body_map.robot.name != "nao":
        assert measured(retargeter, motion, before).body_sunk_max_cm > 1


def test_hands_that_carry_lift_and_others_bend(retargeter: OptimizationRetargeter) -> None:
    """Arms of who stands on them stay as straight as the person's; of who is on all fours too, they give way, and knees
    stay on the floor.
    """
    names = retargeter.body_map.measured_names
    arms = [names.index(f"{side}_wrist") for side in ("left", "right")]
    off = {
        name: float(retargeter(FLOOR[name]).direction_error_deg[:, arms].mean()) for name in ("crawls", "on the hands")
    }
    if retargeter.body_map.robot.name != "nao":  # whose head is on the floor as well
        assert off["on the hands"] + 2 < off["crawls"]
    legs, result = Legs(retargeter.body_map), retargeter(FLOOR["crawls"])
    assert result.root_position is not None and result.root_quaternion_wxyz is not None
    turn_T33 = rotation.wxyz_to_matrix(result.root_quaternion_wxyz)
    low_T = lowest_of_body(legs, retargeter.body_map.robot.forward(result.q), result.root_position, turn_T33)
    assert np.abs(low_T).max() < 0.02


def test_it_is_the_same_elsewhere(retargeter: OptimizationRetargeter) -> None:
    """The floor is level: turned about the vertical and moved, joint angles are the same."""
    first, second = (retargeter(m) for m in (FLOOR["crawls"], moved(FLOOR["crawls"], 1.0, (2.0, 0.0, -3.0))))
    torch.testing.assert_close(first.q, second.q, atol=2e-3, rtol=0)


def test_who_stands_on_feet_is_as_before(retargeter: OptimizationRetargeter, monkeypatch: pytest.MonkeyPatch) -> None:
    found = retargeter(squat(24))
    monkeypatch.setattr(LowBody, "near", lambda *_: False)
    before = retargeter(squat(24))
    assert torch.equal(found.q, before.q)
    assert found.root_position is not None and before.root_position is not None
    assert torch.equal(found.root_position, before.root_position)
    monkeypatch.undo()
    assert measured(retargeter, squat(24), found).body_sunk == 0
