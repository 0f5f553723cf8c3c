"""The Jacobian of soles' places is that of finite differences, wherever the robot hangs."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch
from torch import Tensor

from mrhubo.reference.jacobian import DirectionJacobian
from mrhubo.reference.solve import DirectionProblem
from mrhubo.reference.standing import Legs
from mrhubo.reference.terms.soles import SoleTerm
from mrhubo.reference.terms.term import State
from tests.reference.walkers import ROOTS, walker


@pytest.mark.parametrize("root", ROOTS)
def test_the_jacobian_equals_differences(tmp_path: Path, root: str) -> None:
    legs = Legs(walker(tmp_path, root))
    term, robot = SoleTerm(legs).double(), legs.body_map.robot.double()
    kinematics = DirectionJacobian(legs.body_map).double()
    legs.double()
    q_BN = robot.sample(8, torch.Generator().manual_seed(1)).double()
    targets_BX3 = torch.zeros(8, len(legs.body_map.directions) + 8, 3, dtype=torch.float64)

    def places(q_BN: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        poses = robot.forward(q_BN)
        return term.residual(State(q_BN, poses, targets_BX3, *kinematics.at(poses)))

    found_BP3N, step = places(q_BN)[1], 1e-5
    for n, offset_N in enumerate(step * torch.eye(q_BN.shape[1]).double()):
        slope_BP3 = (places(q_BN + offset_N)[0] - places(q_BN - offset_N)[0]) / (2 * step)
        torch.testing.assert_close(found_BP3N[..., n], slope_BP3, atol=1e-6, rtol=0)


def test_the_model_is_that_of_its_cost(tmp_path: Path) -> None:
    """Gradients are slopes of the cost, with heights that count besides; without them it costs less."""
    legs = Legs(walker(tmp_path))
    problem = DirectionProblem(legs.body_map, [SoleTerm(legs)]).double()
    legs.double()
    draw = torch.Generator().manual_seed(2)
    q_BN = legs.body_map.robot.double().sample(4, draw).double()
    rows_BX3 = torch.rand(4, len(legs.body_map.directions) + 12, 3, generator=draw, dtype=torch.float64)
    found, step = problem.quadratic(q_BN, rows_BX3), 1e-5
    for n, offset_N in enumerate(step * torch.eye(q_BN.shape[1]).double()):
        slope_B = (problem.cost(q_BN + offset_N, rows_BX3) - problem.cost(q_BN - offset_N, rows_BX3)).sum(1) / (
            2 * step
        )
        torch.testing.assert_close(2 * found.gradient_BN[:, n], slope_B, atol=1e-6, rtol=1e-5)
    lower_B = found.cost_BC.sum(1) - problem.cost(q_BN, rows_BX3[:, :-4]).sum(1)
    assert bool((lower_B > 0).all())


def test_it_couples_each_leg_alone(tmp_path: Path) -> None:
    legs = Legs(walker(tmp_path))
    names = legs.body_map.robot.joint_names
    sets = [{names[n] for n in joints} for joints in SoleTerm(legs).couplings()]
    assert sets == [{f"{s}_{n}" for n in ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle")} for s in "llrr"]
