"""Legs, feet, a pelvis and a waist are rows of the table of body parts and nothing more: a robot that has them is solved.

The robot hangs at its pelvis, or at its chest: then the waist's joint is above the legs. Its waist is one joint, or it
has none: then pelvis and chest are held against each other.
"""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.body.skeleton import JOINT_NAMES, KEYPOINT_NAMES, POSED_JOINT_NAMES
from mrhubo.errors import UserError
from mrhubo.reference import DirectionJacobian, OptimizationRetargeter
from mrhubo.robot import BodyMap, Limb, align_pose, read_keypoints
from tests.poses import prior_poses
from tests.reference.walkers import ROOTS, entries, walker

FORWARD = (0.0, 0.0, 1.0)


@pytest.fixture(
    scope="module", params=[(root, waist) for root in ROOTS for waist in (True, False)], ids=lambda p: f"{p[0]}-{p[1]}"
)
def body_map(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> BodyMap:
    root, waist = request.param
    return walker(tmp_path_factory.mktemp("walker"), root, waist)


def robot_directions(body_map: BodyMap, q_BN: Tensor) -> Tensor:
    return body_map.robot_directions(body_map.robot.forward(q_BN))


def human_poses(count: int) -> Tensor:
    return prior_poses(count, 0)


def columns(body_map: BodyMap, *regions: str) -> list[int]:
    return [i for i, direction in enumerate(body_map.directions) if direction.part.region in regions]


def test_home_stands(body_map: BodyMap) -> None:
    home = dict(zip(body_map.direction_names, robot_directions(body_map, body_map.robot.home()[None])[0], strict=True))
    for side in ("left", "right"):
        for name in ("knee", "ankle"):
            assert float(home[f"{side}_{name}"] @ torch.tensor([0.0, -1.0, 0.0])) > 0.99
        torch.testing.assert_close(home[f"{side}_foot_forward"], torch.tensor(FORWARD), atol=0.06, rtol=0)


def test_legs_are_seen_from_the_pelvis_and_arms_from_the_chest(body_map: BodyMap) -> None:
    local_BJ33 = human_poses(20)
    bowed_BJ33 = local_BJ33.clone()
    spine = [POSED_JOINT_NAMES.index(f"spine{number}") for number in (1, 2, 3)]
    bowed_BJ33[:, spine] = human_poses(40)[20:][:, spine]
    before, after = (body_map.human_directions(pose) for pose in (local_BJ33, bowed_BJ33))
    limbs = columns(body_map, "arm", "leg", "foot")
    torch.testing.assert_close(after[:, limbs], before[:, limbs], atol=1e-5, rtol=0)
    if "waist" not in body_map.robot.joint_names:
        return
    trunk = columns(body_map, "trunk")
    assert float((after - before)[:, trunk].abs().max()) > 0.1
    q_BN = body_map.robot.sample(20, torch.Generator().manual_seed(0))
    turned_BN = q_BN.clone()
    turned_BN[:, body_map.robot.joint_names.index("waist")] *= -1
    before, after = (robot_directions(body_map, q) for q in (q_BN, turned_BN))
    torch.testing.assert_close(after[:, limbs], before[:, limbs], atol=1e-5, rtol=0)
    assert float((after - before)[:, trunk].abs().max()) > 0.1


def test_the_jacobian_equals_differences(body_map: BodyMap) -> None:
    q_BN, step = body_map.robot.sample(32, torch.Generator().manual_seed(1)), 0.01
    found_BD3, jacobian_BD3N = DirectionJacobian(body_map)(q_BN)
    torch.testing.assert_close(found_BD3, robot_directions(body_map, q_BN))
    for n, offset_N in enumerate(step * torch.eye(q_BN.shape[1])):
        near = robot_directions(body_map, q_BN + offset_N) - robot_directions(body_map, q_BN - offset_N)
        far = robot_directions(body_map, q_BN + 2 * offset_N) - robot_directions(body_map, q_BN - 2 * offset_N)
        torch.testing.assert_close(jacobian_BD3N[..., n], (8 * near - far) / (12 * step), atol=3e-4, rtol=0)


def test_the_reference_recovers_the_robots_own_poses(body_map: BodyMap) -> None:
    retargeter = OptimizationRetargeter(body_map)
    blocks = retargeter.problem.blocks.joints_NC
    assert blocks.shape[1] == 4 + ("waist" in body_map.robot.joint_names), "two arms, two legs, and the waist"
    q_BN = body_map.robot.sample(100, torch.Generator().manual_seed(4))
    target_BD3 = robot_directions(body_map, q_BN)
    start_BSN = retargeter._pool.near(target_BD3)
    found, cost = retargeter.problem.minimise(start_BSN.flatten(0, 1), target_BD3.repeat_interleave(12, 0))
    best_BC = cost.unflatten(0, (100, 12)).amin(1)
    assert float((best_BC < 0.01).float().mean()) > 0.98
    robot = body_map.robot
    assert bool(((found >= robot.lower_N) & (found <= robot.upper_N)).all())


def test_a_human_who_squats_and_turns_is_followed(body_map: BodyMap) -> None:
    turn = torch.zeros(24, len(POSED_JOINT_NAMES), 3)
    bend = 0.9 * torch.sin(torch.linspace(0, torch.pi, 24))
    for side in ("left", "right"):
        turn[:, POSED_JOINT_NAMES.index(f"{side}_hip"), 0] = -bend
        turn[:, POSED_JOINT_NAMES.index(f"{side}_knee"), 0] = 2 * bend
        turn[:, POSED_JOINT_NAMES.index(f"{side}_ankle"), 0] = -bend
    turn[:, POSED_JOINT_NAMES.index("spine2"), 1] = 0.5 * bend
    local_TJ33 = rotation.axis_angle_to_matrix(turn)
    result = OptimizationRetargeter(body_map).retarget(local_TJ33, 24.0)
    assert result.jumps == 0
    robot = body_map.robot
    assert bool(((result.q_TN >= robot.lower_N) & (result.q_TN <= robot.upper_N)).all())
    assert bool((24 * result.q_TN.diff(dim=0).abs() <= robot.velocity_N).all())
    legs = [body_map.measured.index(i) for i in columns(body_map, "leg", "foot", "trunk")]
    assert float(result.residual_deg_TD[:, legs].mean()) < 3
    knee_T = result.q_TN[:, body_map.robot.joint_names.index("l_knee")]
    assert float(knee_T[12]) == pytest.approx(1.8, abs=0.15)
    if "waist" in body_map.robot.joint_names:
        waist_T = result.q_TN[:, body_map.robot.joint_names.index("waist")]
        assert float(waist_T[12]) == pytest.approx(0.45, abs=0.05)


def test_keypoints_have_the_directions_and_a_humans_lengths(body_map: BodyMap) -> None:
    found_BD3 = robot_directions(body_map, body_map.robot.sample(30, torch.Generator().manual_seed(0)))
    rest = dict(zip(KEYPOINT_NAMES, body_map.skeleton.rest_K3, strict=True))
    at = dict(zip(body_map.keypoint_names, body_map.human_keypoints(found_BD3).unbind(1), strict=True))
    assert len(at) == len(body_map.keypoint_names), "no keypoint is both pinned and moved"
    seen = dict(zip(body_map.direction_names, found_BD3.unbind(1), strict=True))
    for direction in body_map.directions:
        if isinstance(direction, Limb):
            start = at.get(direction.part.start, rest[direction.part.start].expand(30, 3))
            bone_B3 = at[direction.part.end] - start
            length = (rest[direction.part.end] - rest[direction.part.start]).norm()
            torch.testing.assert_close(bone_B3.norm(dim=-1), length.expand(30), atol=1e-5, rtol=0)
            if direction.part.seen_from == "pelvis":
                torch.testing.assert_close(bone_B3 / length, seen[direction.name], atol=1e-5, rtol=0)
    if "waist" in body_map.robot.joint_names:
        across_B3 = torch.nn.functional.normalize(at["left_shoulder"] - at["right_shoulder"], dim=-1)
        left_B3 = torch.linalg.cross(seen["chest_up"], seen["chest_forward"])
        torch.testing.assert_close(across_B3, left_B3, atol=1e-5, rtol=0)
        chest_B33 = torch.stack((left_B3, seen["chest_up"], seen["chest_forward"]), dim=-1)
        for direction in body_map.directions:
            if isinstance(direction, Limb) and direction.part.seen_from == "chest":
                bone_B3 = torch.nn.functional.normalize(at[direction.part.end] - at[direction.part.start], dim=-1)
                expected_B3 = (chest_B33 @ seen[direction.name][..., None])[..., 0]
                torch.testing.assert_close(bone_B3, expected_B3, atol=1e-5, rtol=0)


def test_a_human_is_turned_until_he_points_there(body_map: BodyMap) -> None:
    local_BJ33, wanted_BD3 = human_poses(30), robot_directions(
        body_map, body_map.robot.sample(30, torch.Generator().manual_seed(2))
    )  # fmt: skip
    aligned = align_pose(body_map, local_BJ33, wanted_BD3)
    found_BD3 = body_map.human_directions(aligned)
    shown = body_map.measured
    torch.testing.assert_close(found_BD3[:, shown], wanted_BD3[:, shown], atol=2e-4, rtol=0)


def test_a_foots_heading_gives_way_to_its_leg(body_map: BodyMap) -> None:
    """Hip, knee and one ankle joint cannot turn a foot out: the sole stays flat, and the shin where it was."""
    turn = torch.zeros(1, len(POSED_JOINT_NAMES), 3)
    turn[:, POSED_JOINT_NAMES.index("left_knee"), 0] = 1.0
    turn[:, POSED_JOINT_NAMES.index("left_ankle"), 1] = 0.6
    result = OptimizationRetargeter(body_map).retarget(rotation.axis_angle_to_matrix(turn), 24.0)
    off = dict(zip(body_map.measured_names, result.residual_deg_TD[0].tolist(), strict=True))
    assert off["left_foot_forward"] > 15 and max(off["left_knee"], off["left_ankle"]) < 5


def test_input_joints_are_those_of_the_rows(body_map: BodyMap) -> None:
    legs = {f"{side}_{joint}" for side in ("left", "right") for joint in ("hip", "knee", "ankle")}
    assert legs <= set(body_map.input_joints()) <= set(JOINT_NAMES)
    assert set(body_map.input_joints(columns(body_map, "leg"))) == {name for name in legs if "ankle" not in name}


def test_a_foot_needs_its_shin_and_a_leg_its_pelvis() -> None:
    some = entries()
    with pytest.raises(UserError, match="robot.keypoints.left_foot: needs 'left_ankle' too"):
        read_keypoints({name: entry for name, entry in some.items() if name != "left_ankle"})
    with pytest.raises(UserError, match="'pelvis' is missing; name the link that carries 'left_hip'"):
        read_keypoints({name: entry for name, entry in some.items() if name != "pelvis"})
    with pytest.raises(UserError, match="body part 'left_hop' does not exist; nearest: 'left_hip'"):
        read_keypoints({name: some["left_hip"] for name in ("chest", "left_hop")})
