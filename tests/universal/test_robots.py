"""The same robot, however its file is written, moves in the same way; and it moves as the reference says."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrhubo.motion import read_motion
from mrhubo.reference import OptimizationRetargeter, angle_between
from mrhubo.robot import BodyMap, Robot
from mrhubo.robot.generator.variants import variant
from mrhubo.universal.robots import UniversalRetargeter
from mrhubo.universal.weights import open_network
from tests.chain import ROOT
from tests.invariance.rewrite import KINDS, draw_change, rewrite, undo

CLOSE = 1e-3
pytestmark = pytest.mark.usefixtures("one_thread")


def frames() -> torch.Tensor:
    motions = [read_motion(ROOT / "data" / "motions" / f"{name}.npz") for name in ("wave", "boxing", "stretch")]
    return torch.cat([motion.local_TJ33[::25] for motion in motions])


def answer(config: Path | str) -> torch.Tensor:
    body_map = BodyMap.of(Robot.from_config(config))
    return UniversalRetargeter(body_map, open_network())(body_map.human_directions(frames()))


EXPECTED = {name: answer(name) for name in ("nao", "reachy")}


@settings(max_examples=4, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(robot=st.sampled_from(("nao", "reachy")), seed=st.integers(0, 1000))
def test_renamed_reordered_negated_and_turned(robot: str, seed: int, tmp_path: Path) -> None:
    config = ROOT / "conf" / f"{robot}.yaml"
    change = draw_change(config, seed, *KINDS)
    found = answer(rewrite(config, change, tmp_path / f"{robot}-{seed}"))
    joints = list(Robot.from_config(robot).joint_names)
    torch.testing.assert_close(undo(change, joints, found), EXPECTED[robot], atol=CLOSE, rtol=0)


def test_scaled(tmp_path: Path) -> None:
    text, _ = variant(ROOT / "data/robots/nao/nao.urdf", seed=0, scale=3.0)
    (tmp_path / "nao.urdf").write_text(text)
    config = (ROOT / "conf" / "nao.yaml").read_text().replace("../data/robots/nao/nao.urdf", "nao.urdf")
    (tmp_path / "big.yaml").write_text(config)
    torch.testing.assert_close(answer(tmp_path / "big.yaml"), EXPECTED["nao"], atol=CLOSE, rtol=0)


@pytest.mark.parametrize("robot", ["nao", "reachy"])
def test_near_the_optimum(robot: str) -> None:
    body_map = BodyMap.of(Robot.from_config(robot))
    optimum_TN, _ = OptimizationRetargeter(body_map).solve_frames(frames())
    target_TD3 = body_map.human_directions(frames())
    columns = [i for i, d in enumerate(body_map.directions) if d.part.region == "arm"]

    def error_T(q_TN: torch.Tensor) -> torch.Tensor:
        robot_TD3 = body_map.robot_directions(body_map.robot.forward(q_TN))
        return torch.rad2deg(angle_between(robot_TD3[:, columns], target_TD3[:, columns])).mean(1)

    q_TN = EXPECTED[robot]
    assert bool(((q_TN >= body_map.robot.lower_N) & (q_TN <= body_map.robot.upper_N)).all())
    assert float((error_T(q_TN) - error_T(optimum_TN)).mean()) < 0.3
