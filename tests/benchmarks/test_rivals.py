"""The rivals of the benchmarks find the pose of a robot whose own directions they are asked for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from closed_form import ClosedForm, NoClosedForm
from mink_loop import MinkLoop

from mrhubo.config import load_config
from mrhubo.reference import angle_between
from mrhubo.robot import BodyMap, build_body_map


def body_map_of(root: Path, name: str) -> BodyMap:
    return build_body_map(load_config(root / "conf" / f"{name}.yaml").robot)


def own_directions(body_map: BodyMap, count: int) -> torch.Tensor:
    """The robot's directions (count, D, 3) on a way from home, where a loop starts: far from it, it may get stuck."""
    robot = body_map.robot
    far_N = robot.sample(1, torch.Generator().manual_seed(3))[0]
    with torch.no_grad():
        q_BN = torch.lerp(robot.home(), far_N, torch.linspace(0, 1, count)[:, None])
        return body_map.robot_directions(robot.forward(q_BN))


def errors_deg(body_map: BodyMap, q_BN: np.ndarray, direction_BD3: torch.Tensor, region: str) -> np.ndarray:
    columns = [i for i, d in enumerate(body_map.directions) if d.part.region == region]
    with torch.no_grad():
        found_BD3 = body_map.robot_directions(body_map.robot.forward(torch.from_numpy(q_BN).float()))
    return torch.rad2deg(angle_between(found_BD3, direction_BD3))[:, columns].numpy()


@pytest.mark.parametrize(("name", "within_deg"), [("reachy", 0.1), ("coman", 7.0)])
def test_the_closed_form_finds_what_the_robot_can_do(root: Path, name: str, within_deg: float) -> None:
    """COMAN's elbow lies 6.7 degrees off the axis that turns the upper arm about itself, which it takes for its line."""
    body_map = body_map_of(root, name)
    robot, form = body_map.robot, ClosedForm(body_map)
    with torch.no_grad():
        q_BN = robot.sample(500, torch.Generator().manual_seed(0))
        direction_BD3 = body_map.robot_directions(robot.forward(q_BN))
    asked = direction_BD3.numpy()
    found_BN = form.of_directions(asked)
    assert (found_BN >= robot.lower_N.numpy() - 1e-6).all() and (found_BN <= robot.upper_N.numpy() + 1e-6).all()
    for region in ("arm", "hand"):
        errors = errors_deg(body_map, found_BN, direction_BD3, region)
        assert np.quantile(errors.max(axis=1), 0.95) < within_deg, region
    np.testing.assert_allclose(form.of_directions(asked[7]), found_BN[7], atol=1e-9)


def test_the_closed_form_keeps_to_limits_and_stays_finite(root: Path) -> None:
    body_map = body_map_of(root, "coman")
    robot, form = body_map.robot, ClosedForm(body_map)
    generator = np.random.default_rng(0)
    asked = generator.standard_normal((200, len(body_map.direction_names), 3))
    asked /= np.linalg.norm(asked, axis=-1, keepdims=True)
    asked[0] = [0, -1, 0]  # straight arms that hang, and hands that are no hands
    found_BN = form.of_directions(asked)
    assert np.isfinite(found_BN).all()
    assert (found_BN >= robot.lower_N.numpy() - 1e-6).all() and (found_BN <= robot.upper_N.numpy() + 1e-6).all()


def test_arms_of_other_joints_have_no_closed_form(root: Path) -> None:
    with pytest.raises(NoClosedForm, match="no arm has a hand"):
        ClosedForm(body_map_of(root, "nao"))


@pytest.mark.parametrize(("name", "dense"), [("nao", True), ("reachy", True), ("coman", False)])
def test_mink_follows_the_robots_own_motion(root: Path, name: str, dense: bool) -> None:
    for needed in ("mink", "mujoco", "daqp"):
        pytest.importorskip(needed, reason="a rival; no part of the project needs it")
    body_map = body_map_of(root, name)
    direction_BD3 = own_directions(body_map, 60)
    loop = MinkLoop(body_map, 10, dense)
    q_BN = np.stack([loop.of_directions(asked) for asked in direction_BD3.numpy()])
    hands = errors_deg(body_map, q_BN, direction_BD3, "hand")
    assert hands.size == 0 or np.median(hands) < 3
    if dense:
        assert np.median(errors_deg(body_map, q_BN, direction_BD3, "arm")) < 3
