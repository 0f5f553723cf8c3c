"""Outputs stay inside the limits whatever comes in; features see what they should."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from mrhubo.config import TrainerConfig
from mrhubo.fitting.module import RetargetModule
from mrhubo.retargeter import RetargetNetwork
from mrhubo.retargeter.features import RotationFeatures
from mrhubo.retargeter.networks import Branch, Branched, ResidualMLP, mlp

LOWER, UPPER = torch.tensor([-2.08567, 0.0349066, -3.0]), torch.tensor([2.08567, 1.54462, -2.9])
ARM = ("left_shoulder", "left_elbow", "left_wrist")


WHOLE = [Branch((0, 1, 2), (0, 1, 2), 32)]


def network(branches: list[Branch] = WHOLE, **settings: object) -> RetargetNetwork:
    torch.manual_seed(0)
    return RetargetNetwork(RotationFeatures(ARM), LOWER, UPPER, branches, **settings)  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", ["tanh", "clamp"])
@pytest.mark.parametrize("stages", [1, 2])
@settings(max_examples=40, deadline=None)
@given(scale=st.floats(0, 1e30), seed=st.integers(0, 1000), poison=st.sampled_from([0.0, float("nan"), float("inf")]))
def test_limits_are_never_exceeded(kind: str, stages: int, scale: float, seed: int, poison: float) -> None:
    net = network(bound_output=kind, stages=stages)
    pose = scale * torch.randn(5, 21, 6, generator=torch.Generator().manual_seed(seed))
    pose[0, 3] += poison
    pose[1, 17] += poison
    with torch.no_grad():
        q = net(pose)
        for raw in (torch.full((1, 3), 1e30), torch.full((1, 3), -1e30), torch.full((1, 3), float("nan"))):
            q = torch.cat((q, net.limited(raw)))
    assert bool(((q >= LOWER) & (q <= UPPER)).all())


def test_a_residual_network_of_one_hidden_layer_is_a_plain_one() -> None:
    plain, residual = mlp(5, 16, 1, 3), ResidualMLP(5, 16, 1, 3)
    residual.load_state_dict(dict(zip(residual.state_dict(), plain.state_dict().values(), strict=True)))
    x = torch.randn(7, 5)
    torch.testing.assert_close(residual(x), plain(x))


def test_a_residual_network_adds_its_layers() -> None:
    net = ResidualMLP(5, 16, 3, 3)
    assert sum(p.numel() for p in net.parameters()) == sum(p.numel() for p in mlp(5, 16, 3, 3).parameters())
    x = torch.randn(7, 5)
    gelu = torch.nn.functional.gelu
    hidden = net.first(x)
    for block in net.blocks:
        hidden = hidden + gelu(hidden) @ block.weight.T + block.bias  # type: ignore[operator]
    torch.testing.assert_close(net(x), net.last(gelu(hidden)))


@pytest.mark.parametrize("stages", [1, 2])
def test_a_branch_sees_its_own_human_joints_alone(stages: int) -> None:
    branches = [Branch((1, 2), (2, 0), 32), Branch((0,), (1,), 8)]
    net = network(branches, stages=stages, bound_output="clamp")
    features = torch.randn(1, net.features.size, requires_grad=True)
    angles = net.post(net.links(features) if stages == 2 else features)
    for branch in branches:
        for joint in branch.joints:
            (slope,) = torch.autograd.grad(angles[0, joint], features, retain_graph=True)
            assert [bool(part.abs().sum() > 0) for part in slope.view(3, 6)] == [i in branch.inputs for i in range(3)]


def test_branches_lie_where_their_columns_say() -> None:
    branched = Branched([[2], [0, 1]], [[1], [2, 0]], [mlp(1, 4, 1, 1), mlp(2, 4, 1, 2)])
    x = torch.randn(5, 3)
    first, second = (part(columns) for part, columns in zip(branched.parts, (x[:, [2]], x[:, [0, 1]]), strict=True))
    torch.testing.assert_close(branched(x), torch.stack((second[:, 1], first[:, 0], second[:, 0]), dim=1))


@pytest.mark.parametrize("kind", ["tanh", "clamp"])
def test_both_ends_of_the_range_can_be_reached(kind: str) -> None:
    limited = network(bound_output=kind).limited
    torch.testing.assert_close(limited(torch.full((1, 3), 20.0))[0], UPPER)
    torch.testing.assert_close(limited(torch.full((1, 3), -20.0))[0], LOWER)


@pytest.mark.parametrize(("loss", "power"), [("l1", 1), ("mse", 2)])
def test_losses_are_the_papers(loss: str, power: int) -> None:
    net = network()
    module = RetargetModule(net, TrainerConfig(loss=loss), detach_student=True)
    features, links, q = torch.randn(8, 18), torch.randn(8, 3, 6), torch.rand(8, 3)
    losses = module.losses(features, links, q)
    assert net.pre is not None
    predicted = net.pre(features)

    def angles(given: torch.Tensor) -> torch.Tensor:
        return (UPPER + LOWER) / 2 + (UPPER - LOWER) / 2 * torch.tanh(net.post(given))

    pre = ((links.flatten(1) - predicted).abs() ** power).mean()
    post = sum(((q - angles(given)).abs() ** power).mean() for given in (links.flatten(1), predicted))
    torch.testing.assert_close(losses["loss_pre"], pre)
    torch.testing.assert_close(losses["loss_post"], post)
    torch.testing.assert_close(losses["loss"], pre + post)


@pytest.mark.parametrize("detach", [True, False])
def test_the_students_gradient_stops_at_the_links_unless_asked(detach: bool) -> None:
    net = network()
    module = RetargetModule(net, TrainerConfig(), detach_student=detach)
    module.losses(torch.randn(8, 18), torch.randn(8, 3, 6), torch.rand(8, 3))["loss_post"].backward()
    assert net.pre is not None
    reached = any(p.grad is not None and bool(p.grad.abs().sum() > 0) for p in net.pre.parameters())
    assert reached is not detach


def test_one_stage_has_one_loss_and_no_links() -> None:
    net = network(stages=1)
    assert set(
        RetargetModule(net, TrainerConfig()).losses(torch.randn(8, 18), torch.randn(8, 3, 6), torch.rand(8, 3))
    ) == {"loss"}
    with pytest.raises(RuntimeError):
        net.links(torch.randn(8, 18))
