"""Every term's Jacobian against differences of its residual, and its quadratic model against its residual."""

from __future__ import annotations

import copy
from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from mrhubo.reference.blocks import Blocks
from mrhubo.reference.jacobian import DirectionJacobian
from mrhubo.reference.terms import (
    DirectionJerk,
    DirectionTerm,
    PostureTerm,
    SelfCollisionTerm,
    Smoothness,
    State,
    Term,
)
from mrhubo.robot import BodyMap

ROBOTS = ["nao", "reachy"]
STEP = 2e-3


def state(body_map: BodyMap, q_BN: Tensor, target_BD3: Tensor) -> State:
    poses = body_map.robot.forward(q_BN)
    return State(q_BN, poses, target_BD3, *DirectionJacobian(body_map).at(poses))


def problem(body_map: BodyMap, term: Term, count: int = 24) -> tuple[Blocks, Tensor, Tensor]:
    """The blocks of a term alone, joint angles away from the limits, and the directions of other angles."""
    robot = body_map.robot
    directions: list[set[int]] = DirectionTerm(DirectionJacobian(body_map)).couplings()
    blocks = Blocks([*directions, *term.couplings()], len(robot.joint_names), len(directions))
    generator = torch.Generator().manual_seed(5)
    middle_N = (robot.lower_N + robot.upper_N) / 2
    q_BN = middle_N + 0.9 * (robot.sample(count, generator) - middle_N)
    return blocks, q_BN, body_map.robot_directions(robot.forward(robot.sample(count, generator)))


def differences(function: Callable[[Tensor], Tensor], q_BN: Tensor, step: float = STEP) -> Tensor:
    """Central differences of fourth order, the joint as last axis."""
    found = []
    for offset_N in step * torch.eye(q_BN.shape[1]):
        near = function(q_BN + offset_N) - function(q_BN - offset_N)
        far = function(q_BN + 2 * offset_N) - function(q_BN - 2 * offset_N)
        found.append((8 * near - far) / (12 * step))
    return torch.stack(found, dim=-1)


@pytest.mark.parametrize("name", ROBOTS)
def test_directions(name: str, body_maps: dict[str, BodyMap]) -> None:
    body_map = body_maps[name]
    term = DirectionTerm(DirectionJacobian(body_map))
    blocks, q_BN, target_BD3 = problem(body_map, term)
    residual_BD3, jacobian_BD3N, weight_BD = term.residual(state(body_map, q_BN, target_BD3))
    found = differences(lambda q: term.residual(state(body_map, q, target_BD3))[0], q_BN, 1e-2)
    torch.testing.assert_close(jacobian_BD3N, found, atol=3e-4, rtol=0)
    root_BD1 = weight_BD.sqrt()[..., None]
    check_model(term, blocks, state(body_map, q_BN, target_BD3), (residual_BD3 * root_BD1).flatten(1),
                (jacobian_BD3N * root_BD1[..., None]).flatten(1, 2))  # fmt: skip


def test_hands_weigh_half(body_maps: dict[str, BodyMap]) -> None:
    body_map = body_maps["reachy"]
    weights = DirectionTerm(DirectionJacobian(body_map)).weight_D.tolist()
    measured = [body_map.directions[i] for i in body_map.measured]  # bend axes weigh next to nothing
    for direction, weight in zip(measured, [weights[i] for i in body_map.measured], strict=True):
        assert weight == (0.5 if direction.part.region == "hand" else 1.0)


@pytest.mark.parametrize("name", ROBOTS)
def test_posture(name: str, body_maps: dict[str, BodyMap]) -> None:
    body_map = body_maps[name]
    term = PostureTerm(body_map.robot.lower_N, body_map.robot.upper_N)
    blocks, q_BN, target_BD3 = problem(body_map, term)
    residual_BN, jacobian_NN = term.residual(q_BN)
    found_BNN = differences(lambda q: term.residual(q)[0], q_BN, 0.05)
    torch.testing.assert_close(jacobian_NN.expand_as(found_BNN), found_BNN, atol=1e-6, rtol=1e-3)
    assert float(term.residual(body_map.robot.upper_N[None])[0].square().sum()) == pytest.approx(1e-4 * q_BN.shape[1])
    check_model(term, blocks, state(body_map, q_BN, target_BD3), residual_BN, jacobian_NN.expand_as(found_BNN))


@pytest.mark.parametrize("name", ROBOTS)
def test_self_collision(name: str, body_maps: dict[str, BodyMap]) -> None:
    body_map = body_maps[name]
    term = SelfCollisionTerm(body_map.collision, margin=0.03, weight=3.0)
    blocks, q_BN, target_BD3 = problem(body_map, term, 400)
    assert blocks.joints_NC.shape[1] == 1
    q_BN = q_BN[body_map.collision.near(q_BN, 0.02).row_X.unique()][:24]
    target_BD3 = target_BD3[: len(q_BN)]
    short_X, jacobian_XN, row_X = term.residual(state(body_map, q_BN, target_BD3))
    assert len(row_X) >= 24 and bool((short_X > 0).all())
    near = body_map.collision.near(q_BN, term.margin)

    def shortfall(q_BN: Tensor) -> Tensor:
        every = body_map.collision.near(q_BN, 1.0)
        table_BP = torch.full((len(q_BN), len(body_map.collision.pairs)), torch.nan)
        table_BP[every.row_X, every.pair_X] = term.margin - every.distance_X
        return table_BP[near.row_X, near.pair_X]

    torch.testing.assert_close(shortfall(q_BN), short_X)
    off_XN = (jacobian_XN - differences(shortfall, q_BN)).abs()
    assert float(off_XN.quantile(0.99)) < 2e-4  # a contact that changes side within the step has no one derivative
    assert float(jacobian_XN.abs().quantile(0.99)) > 0.01
    rows = [(jacobian_XN[row_X == row], short_X[row_X == row]) for row in range(len(q_BN))]
    model = term.add_to(None, state(body_map, q_BN, target_BD3), blocks)
    torch.testing.assert_close(model.cost_BC[:, 0], torch.stack([3 * r.square().sum() for _, r in rows]))
    torch.testing.assert_close(model.gradient_BN, torch.stack([3 * j.T @ r for j, r in rows]), atol=1e-6, rtol=1e-4)
    torch.testing.assert_close(model.hessian_BNN, torch.stack([3 * j.T @ j for j, _ in rows]), atol=1e-6, rtol=1e-4)
    twice = term.add_to(model, state(body_map, q_BN, target_BD3), blocks)
    torch.testing.assert_close(twice.cost_BC, 2 * model.cost_BC)
    torch.testing.assert_close(twice.hessian_BNN, 2 * model.hessian_BNN)


@pytest.mark.parametrize("frames", [2, 3, 4, 9])
def test_smoothness(frames: int) -> None:
    """Costs, gradient and Hessian of both terms at once; the blocks' costs are their joints'."""
    generator = torch.Generator().manual_seed(0)
    q_TN = torch.randn(frames, 3, generator=generator, dtype=torch.float64)
    joints_NC = torch.tensor([[1.0, 0], [0, 1], [0, 1]], dtype=torch.float64)
    jerk_YN = torch.rand(max(frames - 3, 0), 3, generator=generator, dtype=torch.float64)
    smoothness = Smoothness(0.3, jerk_YN)

    def cost(q_TN: Tensor) -> Tensor:
        jerk = (jerk_YN * q_TN.diff(n=3, dim=0).square()).sum() if frames > 3 else 0.0
        return 0.3 * q_TN.diff(dim=0).square().sum() + jerk

    torch.testing.assert_close(smoothness.costs(q_TN, joints_NC).sum(), cost(q_TN))
    one_TN = q_TN * torch.tensor([1.0, 0, 0])
    torch.testing.assert_close(smoothness.costs(q_TN, joints_NC)[:, 0].sum(), cost(one_TN))
    gradient_TN = torch.autograd.functional.jacobian(cost, q_TN)
    torch.testing.assert_close(2 * smoothness.gradient(q_TN), gradient_TN)  # pyright: ignore
    hessian_TNTN = torch.autograd.functional.hessian(cost, q_TN)
    bands = smoothness.hessian(q_TN)
    assert len(bands) == 1 + (3 if frames > 3 else 1)
    for lag, band_TN in enumerate(bands):
        for n in range(3):
            torch.testing.assert_close(2 * band_TN[:, n], hessian_TNTN[:, n, :, n].diagonal(-lag))  # pyright: ignore


def test_smoothness_of_some_frames_is_that_of_all_away_from_their_ends() -> None:
    generator = torch.Generator().manual_seed(0)
    q_TN, jerk_YN = torch.randn(14, 2, generator=generator), torch.rand(11, 2, generator=generator)
    whole, frame_X = Smoothness(0.3, jerk_YN), torch.arange(3, 12)
    inner = slice(whole.reach, -whole.reach)
    gradient_XN = whole.at(frame_X).gradient(q_TN[frame_X])
    torch.testing.assert_close(gradient_XN[inner], whole.gradient(q_TN)[frame_X][inner])
    assert len(gradient_XN[inner]) == 3


def test_the_jerk_of_directions(body_maps: dict[str, BodyMap]) -> None:
    """Cost, gradient and Gauss-Newton model are those of its residual by automatic differentiation."""
    body_map, frames = copy.deepcopy(body_maps["reachy"]).double(), 6
    kinematics, robot, generator = (
        DirectionJacobian(body_map).double(),
        body_map.robot,
        torch.Generator().manual_seed(4),
    )
    q_TN = robot.home().double() + 0.2 * torch.randn(frames, len(robot.joint_names), generator=generator).double()
    count = len(body_map.directions)
    term = DirectionJerk(torch.rand(3, count).double(), torch.randn(3, count, 3).double())

    def residual(q_TN: Tensor) -> Tensor:
        third_YD3 = body_map.robot_directions(robot.forward(q_TN)).diff(n=3, dim=0)
        return ((third_YD3 - term.goal_YD3) * term.weight_YD.sqrt()[..., None]).flatten()

    direction_TD3, jacobian_TD3N = kinematics(q_TN)
    assert float(term.costs(direction_TD3, torch.ones(count, 1).double()).sum()) == pytest.approx(
        float(residual(q_TN).square().sum())
    )
    rows_RTN = torch.autograd.functional.jacobian(residual, q_TN)
    assert isinstance(rows_RTN, Tensor)
    gradient_TN = torch.einsum("rtn,r->tn", rows_RTN, residual(q_TN))
    torch.testing.assert_close(term.gradient(direction_TD3, jacobian_TD3N), gradient_TN, atol=1e-5, rtol=1e-4)
    for lag, entries_XNN in enumerate(term.hessian(jacobian_TD3N, torch.arange(count))):
        later_RXN, now_RXN = rows_RTN[:, lag:], rows_RTN[:, : frames - lag]
        found_XNN = torch.einsum("rxm,rxn->xmn", later_RXN, now_RXN)
        torch.testing.assert_close(entries_XNN, found_XNN, atol=1e-5, rtol=1e-4)
    some = term.at(torch.arange(1, 6))
    assert torch.equal(some.weight_YD, term.weight_YD[1:]) and torch.equal(some.goal_YD3, term.goal_YD3[1:])


def check_model(term: Term, blocks: Blocks, at: State, residual_BR: Tensor, jacobian_BRN: Tensor) -> None:
    """The quadratic model is that of the sum of squares; added to another it is the sum of both."""
    model = term.add_to(None, at, blocks)
    torch.testing.assert_close(model.cost_BC.sum(1), residual_BR.square().sum(1))
    gradient_BN = (jacobian_BRN.mT @ residual_BR[..., None])[..., 0]
    torch.testing.assert_close(model.gradient_BN, gradient_BN, atol=1e-6, rtol=1e-4)
    torch.testing.assert_close(model.hessian_BNN, jacobian_BRN.mT @ jacobian_BRN, atol=1e-6, rtol=1e-4)
    twice = term.add_to(model, at, blocks)
    for one, two in zip(vars(model).values(), vars(twice).values(), strict=True):
        torch.testing.assert_close(two, one + one)
