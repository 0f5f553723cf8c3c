from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from mrhubo import rotation
from mrhubo.errors import UserError
from mrhubo.motion import Motion
from mrhubo.reference import OptimizationRetargeter, direction_error


@pytest.fixture(scope="module")
def waving(make_pose: Callable[..., Tensor]) -> Callable[[float], Tensor]:
    """Function of the frame rate: four seconds of both arms lowered half-way; the elbows stretch, then bend in a plane at
    right angles to the first. While an elbow is straight, nothing tells the twist of the arm.
    """

    def make(frame_rate: float) -> Tensor:
        time_T = torch.arange(int(4 * frame_rate) + 1) / frame_rate
        bend_T = 1.2 * torch.cos(math.pi * time_T / 4)
        bend_T = torch.where(bend_T.abs() < 0.6, 0.0, (bend_T.abs() - 0.6) * 2)
        forward_T, down_T = bend_T * (time_T < 2), bend_T * (time_T >= 2)
        zero_T, lowered_T = torch.zeros_like(time_T), torch.full_like(time_T, 0.7)
        swing_T = 0.3 * torch.sin(time_T)
        return make_pose(
            left_shoulder=torch.stack((zero_T, swing_T, -lowered_T), 1),
            left_elbow=torch.stack((zero_T, -forward_T, -down_T), 1),
            right_shoulder=torch.stack((zero_T, -swing_T, lowered_T), 1),
            right_elbow=torch.stack((zero_T, forward_T, down_T), 1),
        )

    return make


@pytest.mark.parametrize("name", ["nao", "coman", "reachy"])
def test_straight_arm_does_not_flip(
    name: str, retargeters: dict[str, OptimizationRetargeter], waving: Callable[[float], Tensor]
) -> None:
    retargeter = retargeters[name]
    local_TJ33 = waving(24.0)
    result = retargeter.retarget(local_TJ33, 24.0)
    assert result.jumps == 0
    assert float(result.q_TN.diff(dim=0).abs().max()) < 0.5
    torch.testing.assert_close(result.residual_deg_TD, direction_error(retargeter.body_map, result.q_TN, local_TJ33))
    alone_TN, _ = retargeter.solve_frames(local_TJ33)
    if name != "reachy":  # whose elbow bends as a human's does, so that the upper arm's own turn tells the twist
        assert float((alone_TN.diff(dim=0).abs()).max()) > 0.5  # frame by frame, the twist does flip
    alone_TD = direction_error(retargeter.body_map, alone_TN, local_TJ33)
    assert float(result.residual_deg_TD.mean() - alone_TD.mean()) < 0.5  # smoothness costs next to no accuracy


def test_frame_rate_changes_little(
    retargeters: dict[str, OptimizationRetargeter], waving: Callable[[float], Tensor]
) -> None:
    slow = retargeters["nao"].retarget(waving(24.0), 24.0)
    fast = retargeters["nao"].retarget(waving(48.0), 48.0)
    assert float((fast.q_TN[::2] - slow.q_TN).abs().mean()) < 0.02
    assert fast.jumps == 0


def test_recorded_motion_stays_near_the_best_of_each_frame(
    retargeters: dict[str, OptimizationRetargeter], cmu_poses: dict[str, Tensor]
) -> None:
    local_TJ33 = cmu_poses["13_21"][:100]
    for name, most_jumps in (("nao", 0), ("reachy", 0)):
        retargeter = retargeters[name]
        result = retargeter.retarget(local_TJ33, 24.0)
        alone_TN, _ = retargeter.solve_frames(local_TJ33)
        assert float((result.q_TN - alone_TN).abs().mean()) < 0.03
        assert float(result.residual_deg_TD.mean()) < 2
        assert result.jumps <= most_jumps
        assert 0 <= result.at_limit_share < 0.2
        problem = retargeter.problem
        assert bool(((result.q_TN >= problem.lower_N) & (result.q_TN <= problem.upper_N)).all())


def test_same_seed_same_result(
    retargeters: dict[str, OptimizationRetargeter], random_pose: Callable[[int, int], Tensor]
) -> None:
    retargeter, local_TJ33 = retargeters["nao"], random_pose(12, 8)
    first = retargeter.retarget(local_TJ33, 30.0)
    again = OptimizationRetargeter(retargeter.body_map).retarget(local_TJ33, 30.0)
    assert torch.equal(first.q_TN, again.q_TN)
    other = OptimizationRetargeter(retargeter.body_map, seed=1).retarget(local_TJ33, 30.0)
    assert not torch.equal(first.q_TN, other.q_TN)


def test_one_frame_and_no_smoothness(
    retargeters: dict[str, OptimizationRetargeter], random_pose: Callable[[int, int], Tensor]
) -> None:
    local_TJ33 = random_pose(20, 9)
    alone_TN, _ = retargeters["nao"].solve_frames(local_TJ33)
    one = retargeters["nao"].retarget(local_TJ33[:1], 24.0)
    assert one.q_TN.shape == (1, 8) and one.residual_deg_TD.shape == (1, 4) and one.jumps == 0
    torch.testing.assert_close(one.q_TN, alone_TN[:1], atol=1e-3, rtol=0)
    rough = OptimizationRetargeter(retargeters["nao"].body_map, smoothness=0.0).retarget(local_TJ33, 24.0)
    torch.testing.assert_close(rough.q_TN, alone_TN, atol=1e-3, rtol=0)


def test_a_motion_and_the_frames_optima_in_one_go(
    retargeters: dict[str, OptimizationRetargeter], random_pose: Callable[[int, int], Tensor]
) -> None:
    local_TJ33 = random_pose(8, 9)
    motion_TN, optima_TN = retargeters["nao"].motion_and_optima(local_TJ33, 24.0)
    assert torch.equal(motion_TN, retargeters["nao"].retarget(local_TJ33, 24.0).q_TN)
    assert torch.equal(optima_TN, retargeters["nao"].solve_frames(local_TJ33)[0])
    assert not torch.equal(motion_TN, optima_TN)


def test_bad_input_is_named(retargeters: dict[str, OptimizationRetargeter]) -> None:
    retargeter = retargeters["nao"]
    good_TJ33 = torch.eye(3).repeat(6, 21, 1, 1)
    for bad, message in ((math.nan, "frame 4, .*NaN"), (math.inf, "frame 4, .*infinite")):
        local_TJ33 = good_TJ33.clone()
        local_TJ33[4, 3, 2, 0] = bad
        with pytest.raises(UserError, match=message):
            retargeter.retarget(local_TJ33, 24.0)
    local_TJ33 = good_TJ33.clone()
    local_TJ33[[2, 5], 15] = 0.0
    with pytest.raises(UserError, match=r"frame 2 \(and 1 more\), .*no rotation"):
        retargeter.solve_frames(local_TJ33)
    for shape in ((6, 21, 6), (6, 21, 3), (21, 3, 3), (6, 22, 3, 3), (0, 21, 3, 3)):
        with pytest.raises(UserError, match=r"shape \(frames, 21, 3, 3\)"):
            retargeter.retarget(torch.zeros(shape), 24.0)
    for rate in (0.0, -1.0, math.nan):
        with pytest.raises(UserError, match="frame rate"):
            retargeter.retarget(good_TJ33, rate)
    with pytest.raises(UserError, match="smoothness"):
        OptimizationRetargeter(retargeter.body_map, smoothness=-1.0)
    with pytest.raises(UserError, match="starts"):
        OptimizationRetargeter(retargeter.body_map, starts=1)


def test_it_is_called_like_a_retargeter(
    retargeters: dict[str, OptimizationRetargeter], random_pose: Callable[[int, int], Tensor], tmp_path: Path
) -> None:
    retargeter, local_TJ33 = retargeters["nao"], random_pose(6, 3)
    wanted = retargeter.retarget(local_TJ33, 30.0)
    motion = Motion("made", local_TJ33, 30.0)
    axis_angle_T63 = rotation.matrix_to_axis_angle(motion.local_TJ33).flatten(1).numpy()
    forms = (local_TJ33, rotation.matrix_to_sixd(local_TJ33), axis_angle_T63)
    for result in (retargeter(motion), *(retargeter(form, frame_rate=30.0) for form in forms)):
        torch.testing.assert_close(result.q, wanted.q_TN, atol=1e-3, rtol=0)
        torch.testing.assert_close(result.direction_error_deg, wanted.residual_deg_TD, atol=1e-2, rtol=0)
        assert result.joint_names == retargeter.body_map.robot.joint_names and result.frame_rate == 30.0
        assert torch.equal(result.collision, retargeter.body_map.collision.collides(result.q))
    result.save(tmp_path / "motion.npz")
    with np.load(tmp_path / "motion.npz") as file:
        np.testing.assert_array_equal(file["q"], result.q)
        assert float(file["frame_rate"]) == 30.0 and file["direction_error_deg"].shape == (6, 4)


def test_leading_axes_are_motions_or_frames_of_their_own(
    retargeters: dict[str, OptimizationRetargeter], random_pose: Callable[[int, int], Tensor]
) -> None:
    retargeter, local_TJ33 = retargeters["nao"], random_pose(6, 4)
    two = retargeter(local_TJ33.unflatten(0, (2, 3)), 30.0)
    assert two.q.shape == (2, 3, 8) and two.collision.shape == (2, 3)
    for found, part_TJ33 in zip(two.q, local_TJ33.split(3), strict=True):
        assert torch.equal(found, retargeter.retarget(part_TJ33, 30.0).q_TN)
    alone = retargeter(local_TJ33)
    assert torch.equal(alone.q, retargeter.solve_frames(local_TJ33)[0]) and alone.frame_rate is None
    one = retargeter(local_TJ33[0])
    assert one.q.shape == (8,) and one.direction_error_deg.shape == (4,)
    assert retargeter(local_TJ33[:0], 30.0).q.shape == (0, 8)
    with pytest.raises(UserError, match="frame rate"):
        retargeter(local_TJ33, -1.0)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")
def test_cuda_gives_the_same(retargeters: dict[str, OptimizationRetargeter], waving: Callable[[float], Tensor]) -> None:
    local_TJ33 = waving(24.0)
    here = retargeters["nao"].retarget(local_TJ33, 24.0)
    there = retargeters["nao"].to("cuda").retarget(local_TJ33.cuda(), 24.0)
    retargeters["nao"].to("cpu")
    assert there.q_TN.is_cuda
    torch.testing.assert_close(there.q_TN.cpu(), here.q_TN, atol=5e-3, rtol=0)
