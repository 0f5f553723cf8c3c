from __future__ import annotations

import math
from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from mrhubo.errors import UserError
from mrhubo.reference import DirectionProblem, count_jumps, direction_error, joint_error, link_error
from mrhubo.reference.metrics import angle_between
from mrhubo.robot import BodyMap


def test_zero_for_equal_motions(body_maps: dict[str, BodyMap]) -> None:
    robot = body_maps["reachy"].robot
    q_TN = robot.sample(7, torch.Generator().manual_seed(0))
    assert joint_error(q_TN, q_TN).tolist() == [0.0] * 7
    assert link_error(robot, q_TN, q_TN, ["head", "l_gripper_thumb"]).tolist() == [0.0] * 7


def test_joint_error_is_a_mean_modulo_a_turn() -> None:
    q_TN = torch.tensor([[3.1, 0.0], [0.5, -1.0]])
    reference_TN = torch.tensor([[-3.1, 0.0], [0.1, -1.0 + 4 * math.pi]])
    expected = torch.tensor([(2 * math.pi - 6.2) / 2, 0.2])
    torch.testing.assert_close(joint_error(q_TN, reference_TN), expected, atol=1e-5, rtol=0)
    torch.testing.assert_close(joint_error(reference_TN, q_TN), expected, atol=1e-5, rtol=0)


def test_link_error_is_the_chord_in_centimetres(body_maps: dict[str, BodyMap]) -> None:
    """Reachy's straight arm is 0.28 + 0.25 m to the wrist; the shoulder's pitch swings it about the shoulder."""
    robot = body_maps["reachy"].robot
    q_TN = robot.home().repeat(2, 1)
    moved_TN = q_TN.clone()
    moved_TN[1, robot.joint_names.index("l_shoulder_pitch")] -= 0.6
    error_T = link_error(robot, moved_TN, q_TN, ["l_wrist2hand", "r_wrist2hand"])
    torch.testing.assert_close(error_T, torch.tensor([0.0, 100 * 2 * 0.53 * math.sin(0.3) / 2]), atol=1e-3, rtol=0)


def test_link_error_names_the_nearest_link(body_maps: dict[str, BodyMap]) -> None:
    robot = body_maps["nao"].robot
    q_TN = robot.home()[None]
    with pytest.raises(UserError, match="nearest: 'LElbow'"):
        link_error(robot, q_TN, q_TN, ["LElbo"])
    with pytest.raises(UserError, match="empty"):
        link_error(robot, q_TN, q_TN, [])


def test_direction_error_of_the_arm_at_rest(body_maps: dict[str, BodyMap]) -> None:
    """Reachy at zero hangs its arms, a human at rest spreads them: 90 degrees; the head agrees but for 10 degrees' rounding."""
    body_map = body_maps["reachy"]
    rest_TJ33 = torch.eye(3).expand(1, 21, 3, 3)
    error_TD = direction_error(body_map, torch.zeros(1, 17), rest_TJ33)
    found = dict(zip(body_map.measured_names, error_TD[0].tolist(), strict=True))
    for name in ("left_elbow", "left_wrist", "right_elbow", "right_wrist", "left_hand_fingers"):
        assert found[name] == pytest.approx(90, abs=1e-3)
    assert found["head_forward"] < 1


def test_direction_error_ignores_what_is_below_the_chest(
    body_maps: dict[str, BodyMap], random_pose: Callable[[int, int], Tensor]
) -> None:
    body_map = body_maps["coman"]
    local_TJ33 = random_pose(5, 1)
    bowed_TJ33 = local_TJ33.clone()
    bowed_TJ33[:, 2] = random_pose(5, 2)[:, 15]  # spine1 turns the chest and all above it alike
    q_TN = body_map.robot.sample(5, torch.Generator().manual_seed(0))
    torch.testing.assert_close(
        direction_error(body_map, q_TN, local_TJ33), direction_error(body_map, q_TN, bowed_TJ33), atol=1e-3, rtol=0
    )


@pytest.mark.parametrize("angle", [0.0, 1e-6, 1e-3, 1.0, math.pi - 1e-6, math.pi])
def test_small_angles_are_exact(angle: float) -> None:
    a, b = torch.tensor([1.0, 0.0, 0.0]), torch.tensor([math.cos(angle), math.sin(angle), 0.0])
    assert float(angle_between(a, b)) == pytest.approx(angle, abs=3e-7)


def test_jumps_are_steps_that_the_human_does_not_make(body_maps: dict[str, BodyMap]) -> None:
    problem = DirectionProblem(body_maps["nao"])
    q_TN = torch.zeros(4, 8)
    q_TN[2:, 0] = 0.6
    still_TD3 = torch.tensor([1.0, 0, 0]).expand(4, len(problem.body_map.directions), 3)
    left, right = (problem.body_map.direction_names.index(f"{side}_wrist") for side in ("left", "right"))
    assert count_jumps(problem, q_TN, still_TD3, 24.0) == 1
    assert count_jumps(problem, q_TN, still_TD3, 12.0) == 0  # the same step, at half the speed
    turning_TD3 = still_TD3.clone()
    turning_TD3[2:, left] = torch.tensor([math.cos(0.3), math.sin(0.3), 0.0])
    assert count_jumps(problem, q_TN, turning_TD3, 24.0) == 0
    turning_TD3 = still_TD3.clone()
    turning_TD3[2:, right] = torch.tensor([math.cos(0.3), math.sin(0.3), 0.0])  # but that is the other arm
    assert count_jumps(problem, q_TN, turning_TD3, 24.0) == 1
