"""While a person stands still, the centre of mass is over what is planted, and feet stay where they are."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.evaluation.whole_body import score_whole_body
from mrhubo.motion import Motion
from mrhubo.reference import OptimizationRetargeter
from mrhubo.reference.result import OptimizationResult
from mrhubo.reference.standing import Legs, read_steps
from mrhubo.reference.standing.balance import MARGIN, Balance, outside, stillness
from mrhubo.robot import BodyMap, build_body_map
from mrhubo.robot.centre_of_mass import CentreOfMass
from tests.reference.standing.steppers import kneel, lie, squat, walk
from tests.reference.walkers import ROOTS, walker


def base(result: OptimizationResult) -> tuple[Tensor, Tensor]:
    assert result.root_position is not None and result.root_quaternion_wxyz is not None
    return result.root_position, rotation.wxyz_to_matrix(result.root_quaternion_wxyz)


def off_support(body_map: BodyMap, result: OptimizationResult) -> Tensor:
    """How far the centre of mass is beyond the corners of both soles, sideways (T,) [m]."""
    poses, (place_T3, turn_T33) = body_map.robot.forward(result.q), base(result)
    centre_T3 = (turn_T33 @ CentreOfMass(body_map.robot)(poses)[..., None])[..., 0] + place_T3
    ball_TK2 = Legs(body_map).on_floor(poses, place_T3, turn_T33).ball_BK3[..., :2]
    return outside(centre_T3[:, :2], ball_TK2, torch.ones(ball_TK2.shape[:2], dtype=torch.bool)).norm(dim=1)


@pytest.mark.parametrize("root", ROOTS)
def test_who_stands_still_is_balanced_and_feet_stay(tmp_path: Path, root: str) -> None:
    """With a load in front of its chest, the robot leans back."""
    motion, found = squat(12, 5.0, sway=0.05), {}
    for balance in (0.0, 0.5, 1.0):
        retargeter = OptimizationRetargeter(walker(tmp_path, root, balance=balance, masses=True))
        result = retargeter(motion)
        score = score_whole_body(retargeter.body_map, motion, result.q, *base(result))
        assert score.slide_cm_s < 0.5 and score.sunk_max_cm < 0.05 and score.floating_max_cm < 1.0
        assert score.over_limit == 0 and score.outside == 0
        names = retargeter.body_map.robot.joint_names
        arms = result.q[:, ["shoulder" in name or "elbow" in name for name in names]]
        found[balance] = float(off_support(retargeter.body_map, result).max()), arms
    assert found[0.0][0] > 0.02 and found[1.0][0] < 0.004
    assert found[1.0][0] < found[0.5][0] < found[0.0][0]
    torch.testing.assert_close(found[1.0][1], found[0.0][1], atol=1e-5, rtol=0)


@pytest.mark.parametrize("motion", [lie(), kneel()], ids=["lies", "kneels"])
def test_who_is_not_held_by_the_feet_is_left_alone(tmp_path: Path, motion: Motion) -> None:
    """Whose centre of mass is beside them for good."""
    found = []
    for balance in (0.0, 1.0):
        result = OptimizationRetargeter(walker(tmp_path, balance=balance, masses=True))(motion)
        found.append((result.q, *base(result)))
    for one, other in zip(*found, strict=True):
        torch.testing.assert_close(one, other, atol=1e-4, rtol=0)


def test_who_walks_is_left_alone(tmp_path: Path) -> None:
    legs = Legs(walker(tmp_path))
    for motion, least, most in ((walk(90), 0.0, 0.0), (squat(20, 5.0, sway=0.05), 0.9, 1.0)):
        steps = read_steps(motion, motion.local_TJ33, legs)
        assert steps is not None
        assert stillness(steps).min() >= least and stillness(steps).max() <= most


@pytest.mark.parametrize("root", ROOTS)
def test_the_centre_of_mass_is_the_mean_of_all_links(tmp_path: Path, root: str) -> None:
    robot = walker(tmp_path, root, masses=True).robot
    poses = robot.forward(robot.sample(5, torch.Generator().manual_seed(0)))
    whole, found_B3 = 0.0, torch.zeros(5, 3)
    for link, (mass, *centre) in robot.description.masses.items():
        placed = torch.tensor(centre)
        if link in robot.links:
            row = robot.link_index(link)
            placed = poses.position_BL3[:, row] + poses.rotation_BL33[:, row] @ placed
        whole, found_B3 = whole + mass, found_B3 + mass * placed
    assert whole == 17 + 60
    torch.testing.assert_close(CentreOfMass(robot)(poses), found_B3 / whole, atol=1e-6, rtol=1e-5)


def test_no_point_of_the_shrunk_hull_is_nearer() -> None:
    generator = torch.Generator().manual_seed(0)
    corner_BC2 = torch.randn(300, 8, 2, generator=generator, dtype=torch.double)
    point_B2 = 1.5 * torch.randn(300, 2, generator=generator, dtype=torch.double)
    counts_BC = torch.rand(300, 8, generator=generator) > 0.5
    off_B2, some_B = outside(point_B2, corner_BC2, counts_BC), counts_BC.any(dim=1)
    out_B = off_B2.norm(dim=1) > 0
    assert bool((out_B & some_B).any()) and bool((~out_B & some_B).any()) and not bool((out_B & ~some_B).any())
    mean_B12 = counts_BC[:, None].double() / counts_BC.sum(-1)[:, None, None].clamp_min(1) @ corner_BC2
    shrunk_BC2 = mean_B12 + (1 - MARGIN) * (corner_BC2 - mean_B12)
    mix_BXC = (torch.rand(300, 400, 8, generator=generator, dtype=torch.double) ** 6 + 1e-6) * counts_BC[:, None]
    mix_BXC = mix_BXC / mix_BXC.sum(-1, keepdim=True).clamp_min(1e-12)
    distance_B = (mix_BXC @ shrunk_BC2 - point_B2[:, None]).norm(dim=-1).amin(dim=1)
    assert bool((distance_B >= off_B2.norm(dim=1) - 1e-9)[some_B].all())
    # The nearest point is one of the hull, and of a point inside, no line parts it from all corners.
    way_X2 = torch.stack((torch.linspace(0, 6.28, 200).cos(), torch.linspace(0, 6.28, 200).sin()), dim=1).double()
    ahead_BCX = (shrunk_BC2 - (point_B2 - off_B2)[:, None]) @ way_X2.T
    assert float(torch.where(counts_BC[..., None], ahead_BCX, -9.0).amax(dim=1)[some_B].min()) > -1e-3


def test_who_has_no_masses_or_feet_is_told(root: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"robot.balance: .* tells no masses"):
        Balance(Legs(walker(tmp_path)))
    config = load_config(root / "conf" / "nao.yaml", ["robot.balance=1"])
    with pytest.raises(UserError, match="robot.balance: 'nao' has no feet"):
        Legs(build_body_map(config.robot))
