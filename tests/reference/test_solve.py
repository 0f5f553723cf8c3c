from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import pytest
import torch
from scipy.optimize import least_squares
from torch import Tensor

from mrhubo import rotation
from mrhubo.body.skeleton import mirror_pose
from mrhubo.reference import DirectionProblem, OptimizationRetargeter
from mrhubo.reference.metrics import angle_between


def test_blocks_are_arms_and_neck(retargeters: dict[str, OptimizationRetargeter]) -> None:
    for name, count in (("nao", 2), ("coman", 2), ("reachy", 3)):
        problem = retargeters[name].problem
        assert problem.blocks.joints_NC.shape[1] == problem.blocks.directions_DC.shape[1] == count
        assert problem.blocks.joints_NC.sum(1).tolist() == [1.0] * problem.blocks.joints_NC.shape[0]
        for joint, block in zip(problem.robot.joint_names, problem.blocks.block_N.tolist(), strict=True):
            assert block == {"l": 0, "r": 1, "n": 2}[joint[0].lower()]


def test_quadratic_is_the_cost_and_its_derivative(retargeters: dict[str, OptimizationRetargeter]) -> None:
    problem = retargeters["reachy"].problem
    generator = torch.Generator().manual_seed(0)
    q_BN, goal_BN = problem.robot.sample(8, generator), problem.robot.sample(8, generator)
    target_BD3 = problem.body_map.robot_directions(problem.robot.forward(goal_BN))

    def cost(q: Tensor) -> Tensor:
        miss_BD = (problem.body_map.robot_directions(problem.robot.forward(q)) - target_BD3).square().sum(-1)
        return (miss_BD * problem.directions.weight_D).sum(1) + 1e-4 * (
            (q - problem.posture.mid_N) / problem.posture.half_N
        ).square().sum(1)

    q_BN.requires_grad_()
    model = problem.quadratic(q_BN.detach(), target_BD3)
    torch.testing.assert_close(model.cost_BC.sum(1), cost(q_BN).detach())
    (gradient_BN,) = torch.autograd.grad(cost(q_BN).sum(), q_BN)
    torch.testing.assert_close(2 * model.gradient_BN, gradient_BN, atol=1e-4, rtol=1e-4)


@pytest.mark.parametrize("name", ["nao", "coman", "reachy"])
def test_own_configurations_are_recovered(name: str, retargeters: dict[str, OptimizationRetargeter]) -> None:
    retargeter = retargeters[name]
    robot, body_map = retargeter.problem.robot, retargeter.body_map
    q_BN = robot.sample(300, torch.Generator().manual_seed(4))
    target_BD3 = body_map.robot_directions(robot.forward(q_BN))
    found_BN, _ = retargeter._polish(*retargeter._candidates(target_BD3), target_BD3)
    miss_BD = angle_between(body_map.robot_directions(robot.forward(found_BN)), target_BD3)[:, body_map.measured]
    assert float((torch.rad2deg(miss_BD).amax(1) < 0.5).float().mean()) > 0.99
    assert bool(((found_BN >= robot.lower_N) & (found_BN <= robot.upper_N)).all())
    if name == "nao":  # its four joints per arm are determined wherever the elbow is bent
        bent_B = (q_BN[:, [robot.joint_names.index(j) for j in ("LElbowRoll", "RElbowRoll")]].abs() > 0.3).all(dim=1)
        assert float((found_BN - q_BN)[bent_B].abs().max()) < 0.01


@pytest.mark.parametrize("name", ["nao", "coman", "reachy"])
def test_limits_hold_for_poses_out_of_reach(
    name: str, retargeters: dict[str, OptimizationRetargeter], random_pose: Callable[[int, int], Tensor]
) -> None:
    problem = retargeters[name].problem
    q_BN, cost_B = retargeters[name].solve_frames(random_pose(100, 5))
    assert bool(((q_BN >= problem.lower_N) & (q_BN <= problem.upper_N)).all())
    assert bool(((q_BN == problem.lower_N) | (q_BN == problem.upper_N)).any())  # else the test shows nothing
    assert bool(cost_B.isfinite().all())


def scipy_cost(problem: DirectionProblem, target_D3: Tensor, start_N: np.ndarray) -> float:
    """Cost at the minimum that SciPy's trust-region solver for bounded least squares finds from a start."""
    root_D1, ridge_N = problem.directions.weight_D.sqrt()[:, None], problem.posture.ridge_N.sqrt()
    lower, upper = problem.lower_N.double().numpy(), problem.upper_N.double().numpy()

    @functools.cache  # SciPy asks for the slope where it has just asked for the miss
    def both(q: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
        q_1N = torch.tensor([q], dtype=torch.float32)
        direction_1D3, jacobian_1D3N = problem.kinematics.forward(q_1N)
        miss = torch.cat(
            (((direction_1D3[0] - target_D3) * root_D1).flatten(), (q_1N[0] - problem.posture.mid_N) * ridge_N)
        )
        slope = torch.cat(((jacobian_1D3N[0] * root_D1[..., None]).flatten(0, 1), torch.diag(ridge_N)))
        return miss.double().numpy(), slope.double().numpy()

    inside = np.clip(start_N, lower + 1e-6, upper - 1e-6)
    result = least_squares(
        lambda q: both(tuple(q))[0],
        inside,
        lambda q: both(tuple(q))[1],  # pyright: ignore
        (lower, upper),
        max_nfev=30,
    )
    return float(2 * result.cost)


@pytest.mark.parametrize(("name", "frames", "most"), [("nao", 24, 1), ("coman", 10, 2), ("reachy", 8, 3)])
def test_never_worse_than_scipy(
    name: str, frames: int, most: int, retargeters: dict[str, OptimizationRetargeter], cmu_poses: dict[str, Tensor]
) -> None:
    """SciPy starts in the middle, then also at a random pose, then also where we ended."""
    retargeter = retargeters[name]
    problem, generator = retargeter.problem, torch.Generator().manual_seed(6)
    every_TJ33 = torch.cat(list(cmu_poses.values()))
    local_BJ33 = every_TJ33[torch.randint(len(every_TJ33), (frames,), generator=generator)]
    q_BN, cost_B = retargeter.solve_frames(local_BJ33)
    target_BD3 = retargeter.body_map.human_directions(local_BJ33)
    for q_N, cost, target_D3 in zip(q_BN, cost_B.tolist(), target_BD3, strict=True):
        starts = [problem.posture.mid_N, *problem.robot.sample(1, generator), q_N][:most]
        assert cost <= 1.01 * min(scipy_cost(problem, target_D3, start.double().numpy()) for start in starts) + 1e-6


def test_mirrored_human_gives_mirrored_robot(
    retargeters: dict[str, OptimizationRetargeter], random_pose: Callable[[int, int], Tensor]
) -> None:
    """NAO is its own mirror image: left and right change places, rolls and yaws change sign."""
    retargeter = retargeters["nao"]
    names = retargeter.problem.robot.joint_names
    swapped = [names.index({"L": "R", "R": "L"}[n[0]] + n[1:]) for n in names]
    sign_N = torch.tensor([1.0 if "Pitch" in n else -1.0 for n in names])
    local_BJ33 = random_pose(200, 7)
    q_BN, cost_B = retargeter.solve_frames(local_BJ33)
    mirrored_BJ33 = rotation.stack_columns(mirror_pose(rotation.matrix_to_sixd(local_BJ33)))
    mirrored_BN, mirrored_cost_B = retargeter.solve_frames(mirrored_BJ33)
    assert float((cost_B / mirrored_cost_B - 1).abs().median()) < 1e-3
    assert float(((cost_B / mirrored_cost_B).log().abs() < 0.01).float().mean()) > 0.99
    same_B = ((mirrored_BN[:, swapped] * sign_N) - q_BN).abs().amax(1) < 0.02
    assert float(same_B.float().mean()) > 0.97  # the rest: two solutions of one cost
