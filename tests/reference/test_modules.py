"""What holds tensors is a module: `.to` moves every one of them, wherever it is kept."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import torch
import yourdfpy
from torch import Tensor, nn

from mrhubo.config import load_config
from mrhubo.reference import DirectionJacobian, OptimizationRetargeter, Polish
from mrhubo.reference.collision_free import CollisionFreeProblem
from mrhubo.reference.retarget import StartPool
from mrhubo.reference.solve import DirectionProblem
from mrhubo.robot import Keypoints, build_body_map
from mrhubo.robot.bending import BendAxis
from mrhubo.robot.keypoints import Axis, Limb

_AS_READ = (Keypoints, Axis, BendAxis, Limb, yourdfpy.URDF)
"""Descriptions of a file: they stay as they were read."""


def make(root: Path, config: str) -> dict[str, nn.Module]:
    body_map = build_body_map(load_config(root / "conf" / f"{config}.yaml").robot)
    retargeter = OptimizationRetargeter(body_map)
    assert not bool(retargeter._free_problem.collision.collides(body_map.robot.home()[None]))
    return {
        "robot": body_map.robot,
        "directions": body_map.shared,
        "auto scale": body_map.auto,
        "scale": body_map.scale,
        "collision": body_map.collision,
        "body map": body_map,
        "jacobian": DirectionJacobian(body_map),
        "problem": DirectionProblem(body_map),
        "polish": Polish(DirectionProblem(body_map)),
        "collision-free problem": CollisionFreeProblem(body_map),
        "starts": StartPool(retargeter.problem, 3, 0),
        "retargeter": retargeter,
    }


def tensors(value: Any, where: str, seen: set[int]) -> Iterator[tuple[str, Tensor]]:
    """Every tensor that can be reached from an object, with the way to it."""
    if id(value) in seen or isinstance(value, (str, bytes, int, float, type(None), *_AS_READ)):
        return
    seen.add(id(value))
    if isinstance(value, Tensor):
        yield where, value
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from tensors(item, f"{where}[{key!r}]", seen)
    elif isinstance(value, (list, tuple, set, frozenset)):
        for index, item in enumerate(value):
            yield from tensors(item, f"{where}[{index}]", seen)
    elif type(value).__module__.split(".")[0] in ("mrhubo", "torch", "pytorch_kinematics") and hasattr(
        value, "__dict__"
    ):
        yield from tensors(vars(value), where, seen)


NAMES = ["robot", "directions", "auto scale", "scale", "collision", "body map", "jacobian", "problem",
         "collision-free problem", "starts", "retargeter"]  # fmt: skip


@pytest.fixture(scope="module", params=["reachy", "paper/nao"])
def modules(request: pytest.FixtureRequest, root: Path) -> dict[str, nn.Module]:
    return make(root, request.param)


@pytest.mark.filterwarnings("ignore:robot.manual.shift")
@pytest.mark.parametrize("name", NAMES)
def test_no_tensor_is_left_behind(modules: dict[str, nn.Module], name: str) -> None:
    module = modules[name]
    before = dict(tensors(module, name, set()))
    assert len(before) >= 2 and not list(module.parameters()) and not module.state_dict()
    assert module.to(torch.float64) is module
    assert [w for w, t in tensors(module, name, set()) if t.is_floating_point() and t.dtype != torch.float64] == []
    module.to(torch.float32)
    assert [w for w, t in tensors(module, name, set()) if t.dtype == torch.float64] == []
    after = dict(tensors(module, name, set()))
    for where in before.keys() & after.keys():
        assert torch.equal(before[where], after[where]), where


@pytest.mark.filterwarnings("ignore:robot.manual.shift")
def test_everything_goes_to_another_device(root: Path) -> None:
    for name, module in make(root, "paper/nao").items():
        module.to("meta")
        assert [w for w, t in tensors(module, name, set()) if t.device.type != "meta"] == []


def test_answers_in_double_precision_are_those_in_single(root: Path) -> None:
    body_map = build_body_map(load_config(root / "conf" / "nao.yaml").robot)
    problem = CollisionFreeProblem(body_map)
    q_BN = body_map.robot.sample(200, torch.Generator().manual_seed(0))
    target_BD3 = body_map.robot_directions(body_map.robot.forward(q_BN.flip(0)))
    poses, single = body_map.robot.forward(q_BN), problem.quadratic(q_BN, target_BD3)
    targets = body_map.targets(poses)
    problem.double()
    double = problem.quadratic(q_BN.double(), target_BD3.double())
    for one, two in itertools.chain(
        zip(vars(single).values(), vars(double).values(), strict=True),
        [(targets, body_map.targets(body_map.robot.forward(q_BN.double())))],
    ):
        assert two.dtype == torch.float64
        torch.testing.assert_close(one.double(), two, atol=1e-2, rtol=2e-3)
