"""The universal network in a retargeter: with a confidence, in motions and streams, and in a package."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

import mrhubo
from mrhubo.body import BodyPrior
from mrhubo.config import load_config
from mrhubo.describing.run import open_robot
from mrhubo.errors import UserError
from mrhubo.motion import read_motion, trim
from mrhubo.reference import OptimizationRetargeter, angle_between
from mrhubo.retargeter import Retargeter, build_network
from mrhubo.robot import build_body_map
from tests.poses import prior_poses

pytestmark = pytest.mark.usefixtures("one_thread")


@pytest.fixture(scope="module")
def reachy() -> Retargeter:
    return mrhubo.for_robot("reachy")


def test_a_motion_is_near_the_optimum_smooth_and_trusted(reachy: Retargeter, root: Path) -> None:
    motion = trim(read_motion(root / "data" / "motions" / "wave.npz"), 1.0, 4.0)
    result, body_map = reachy(motion), reachy.body_map
    robot = body_map.robot
    q_TN = torch.as_tensor(result.q)
    assert bool(((q_TN >= robot.lower_N) & (q_TN <= robot.upper_N)).all())
    assert bool((q_TN.diff(dim=0).abs() * motion.frame_rate <= robot.velocity_N * 1.001 + 1e-6).all())
    assert float(torch.as_tensor(result.confidence).mean()) > 0.9
    optimum_TN, _ = OptimizationRetargeter(body_map).solve_frames(motion.local_TJ33[::10])
    target_TD3, columns = body_map.human_directions(motion.local_TJ33[::10]), body_map.measured

    def error(q_TN: torch.Tensor) -> float:
        robot_TD3 = body_map.robot_directions(robot.forward(q_TN))
        return float(torch.rad2deg(angle_between(robot_TD3[:, columns], target_TD3[:, columns])).mean())

    assert error(q_TN[::10]) < error(optimum_TN) + 0.3
    assert "universal network" in result.robot_motion.robot.made_by


def test_a_stream_follows(reachy: Retargeter, root: Path) -> None:
    motion = read_motion(root / "data" / "motions" / "wave.npz")
    stream = mrhubo.Stream(reachy, rate=motion.frame_rate)
    first = [stream(frame_J33).q for frame_J33 in motion.local_TJ33[:4]]
    assert all(bool(torch.isfinite(torch.as_tensor(q)).all()) for q in first)


@pytest.mark.usefixtures("few_poses")
def test_legs_of_a_urdf_move_when_they_are_asked_for(root: Path) -> None:
    file = root / "data" / "robots" / "nao" / "nao.urdf"
    arms, whole = mrhubo.for_robot(file), mrhubo.for_robot(file, whole_body=True)
    by_command = open_robot(str(file), whole_body=True)
    assert whole.joint_names == by_command.joint_names and set(arms.joint_names) < set(whole.joint_names)
    prior = BodyPrior.open()
    local_TJ33 = prior.decode_matrices(0.7 * torch.randn(30, prior.latent, generator=torch.Generator().manual_seed(3)))
    body_map = whole.body_map
    q_TN, target_TD3 = torch.as_tensor(whole(local_TJ33).q), body_map.human_directions(local_TJ33)
    off_TD = angle_between(body_map.robot_directions(body_map.robot.forward(q_TN)), target_TD3)
    thighs = [i for i, d in enumerate(body_map.directions) if d.part.region == "leg"]
    assert len(thighs) == 4 and float(torch.rad2deg(off_TD[:, thighs]).mean()) < 10


def test_only_models_are_asked_for_their_whole_body(reachy: Retargeter) -> None:
    for robot in ("nao", reachy.body_map.robot):
        with pytest.raises(UserError, match="says itself what of a body it has"):
            mrhubo.for_robot(robot, whole_body=True)


def test_a_spoilt_pose_is_not_trusted(reachy: Retargeter) -> None:
    prior = BodyPrior.open()
    whole = prior.decode_matrices(0.7 * torch.randn(40, prior.latent, generator=torch.Generator().manual_seed(0)))
    spoilt = torch.linalg.qr(torch.randn(40, 21, 3, 3, generator=torch.Generator().manual_seed(1))).Q
    spoilt = spoilt * torch.linalg.det(spoilt)[..., None, None]
    good, bad = (float(torch.as_tensor(reachy.retarget(pose).confidence).mean()) for pose in (whole, spoilt))
    assert good > 0.7 and bad < 0.2


def test_nothing_is_saved_without_a_config(reachy: Retargeter, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"model\.start=universal makes a package"):
        reachy.save(tmp_path / "package", {})


def test_a_package_gives_back_a_tuned_network(root: Path, tmp_path: Path) -> None:
    config = load_config(root / "conf" / "nao.yaml", ["model.start=universal"])
    body_map = build_body_map(config.robot)
    made = Retargeter(build_network(config, body_map), body_map, BodyPrior.open(), config, phi_threshold=0.01)
    with torch.no_grad():
        for weights in made.network.parameters():
            weights += 0.01 * torch.randn(weights.shape, generator=torch.Generator().manual_seed(0))
    opened = Retargeter.load(made.save(tmp_path / "package", {"run_id": "abc"}))
    pose = prior_poses(20, 1)
    torch.testing.assert_close(opened.predict(pose), made.predict(pose))
    for name, weights in made.network.state_dict().items():
        assert torch.equal(opened.network.state_dict()[name], weights), name
