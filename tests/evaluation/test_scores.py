"""The protocol's measures on motions whose errors are known, and the command as a user runs it."""

from __future__ import annotations

import dataclasses
import functools
import math
from pathlib import Path

import pytest
import torch

from mrhubo.body import BodyPrior
from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.evaluate import main
from mrhubo.evaluation import (
    Clip,
    Evaluation,
    evaluate_clip,
    latency_us,
    mean_score,
    measures,
    motion_table,
    reshare_clips,
    table,
)
from mrhubo.motion import Motion
from mrhubo.reference import OptimizationRetargeter
from mrhubo.retargeter import Retargeter, build_network
from mrhubo.robot import BodyMap, build_body_map
from tests.chain import cut_motion
from tests.robot.more_robots import more_robot


@functools.cache
def body_map_of(root: Path, robot: str) -> tuple[BodyMap, list[str]]:
    config = load_config(root / "conf" / f"{robot}.yaml")
    return build_body_map(config.robot), config.robot.key_links


@pytest.fixture(scope="module")
def local_TJ33() -> torch.Tensor:
    """A smooth motion between poses of the prior."""
    prior = BodyPrior.open()
    z = torch.randn(4, prior.latent, generator=torch.Generator().manual_seed(0))
    path = torch.nn.functional.interpolate(z.T[None], 60, mode="linear", align_corners=True)[0].T
    return prior.decode_matrices(path).detach()


@pytest.mark.parametrize("name", ["nao", "reachy"])
def test_the_reference_itself_is_without_error(root: Path, name: str, local_TJ33: torch.Tensor) -> None:
    body_map, key_links = body_map_of(root, name)
    reference = OptimizationRetargeter(body_map).retarget(local_TJ33, 24.0)
    clip = Clip(Motion("a", local_TJ33, 24.0), reference.q_TN)
    found = evaluate_clip(clip, reference.q_TN, body_map, key_links)
    assert found.joint_rad == 0 and found.link_cm == 0 and found.frames == 60
    assert found.limb_deg == found.reference_limb_deg
    assert found.at_limit == pytest.approx(reference.at_limit_share)
    columns = [i for i, part in enumerate(body_map.measured_names) if "hand" not in part and "head" not in part]
    assert found.limb_deg == pytest.approx(float(reference.residual_deg_TD[:, columns].mean()), rel=1e-4)
    assert math.isnan(found.hand_deg) == math.isnan(found.head_deg) == (name == "nao")


def test_a_turned_elbow_shows_in_joints_links_and_limbs(root: Path, local_TJ33: torch.Tensor) -> None:
    body_map, key_links = body_map_of(root, "nao")
    reference = OptimizationRetargeter(body_map).retarget(local_TJ33, 24.0).q_TN
    clip = Clip(Motion("a", local_TJ33, 24.0), reference)
    turned = reference.clone()
    turned[:, body_map.robot.joint_names.index("LElbowRoll")] += 0.3
    good, bad = (evaluate_clip(clip, q, body_map, key_links) for q in (reference, turned))
    assert bad.joint_rad == pytest.approx(0.3 / 8, rel=1e-3)
    assert bad.link_cm > 0.3 and bad.limb_deg > good.limb_deg and bad.reference_limb_deg == good.limb_deg


def test_a_trembling_robot_has_a_higher_jerk(root: Path, local_TJ33: torch.Tensor) -> None:
    body_map, key_links = body_map_of(root, "nao")
    reference = OptimizationRetargeter(body_map).retarget(local_TJ33, 24.0).q_TN
    clip = Clip(Motion("a", local_TJ33, 24.0), reference)
    noise = 0.02 * torch.randn(reference.shape, generator=torch.Generator().manual_seed(0))
    still, moving, trembling = (
        evaluate_clip(clip, q, body_map, key_links).jerk_ratio
        for q in (reference[:1].expand_as(reference), reference, reference + noise)
    )
    assert still < 1e-3 < moving < trembling


def test_at_a_limit(root: Path) -> None:
    body_map, key_links = body_map_of(root, "nao")
    robot = body_map.robot
    q = ((robot.lower_N + robot.upper_N) / 2).repeat(5, 1)
    q[:, :2] = robot.upper_N[:2]
    pose = torch.eye(3).expand(5, 21, 3, 3)
    found = evaluate_clip(Clip(Motion("a", pose, 24.0), q), q, body_map, key_links)
    assert found.at_limit == pytest.approx(2 / 8)


def test_collisions_are_counted_by_frame(root: Path) -> None:
    body_map, key_links = body_map_of(root, "nao")
    robot, shapes = body_map.robot, body_map.collision
    q = robot.sample(400, torch.Generator().manual_seed(0))
    touching, free = q[shapes.collides(q)][:3], q[~shapes.collides(q)][:9]
    clip = Clip(Motion("a", torch.eye(3).expand(12, 21, 3, 3), 24.0), q[:12])
    found = evaluate_clip(clip, torch.cat((free, touching)), body_map, key_links)
    assert found.collision == pytest.approx(3 / 12)
    assert found.reference_collision == pytest.approx(float(shapes.collides(q[:12]).float().mean()))


def test_means_count_clips_or_frames() -> None:
    nan = float("nan")
    clips = [Evaluation(n, f, v, v, v, v, v, nan, v, v, v, v) for n, f, v in (("a", 30, 1.0), ("b", 10, 3.0))]
    over_clips, over_frames = mean_score(clips), mean_score(clips, over_frames=True)
    assert over_clips.link_cm == 2 and over_frames.link_cm == 1.5 and over_clips.frames == over_frames.frames == 40
    assert "head_deg" not in measures(over_clips) and measures(over_clips)["at_limit"] == 2
    text = table([*clips, over_clips, over_frames])
    assert "head" not in text and len({len(line) for line in text.splitlines()}) == 1
    ways = {way: [*clips, over_clips, over_frames] for way in ("networks", "whole clips, re-shared")}
    lines = motion_table(ways).splitlines()
    assert [line.split("  ")[0] for line in lines] == ["mean over clips", *ways] and len({*map(len, lines)}) == 1
    assert "over optimum" not in lines[0] and "2.00" in lines[1]  # nobody knows the optimum


def test_excess_speed_and_jumps(root: Path, local_TJ33: torch.Tensor) -> None:
    """A robot that stands at each frame's optimum has no excess; one joint that turns once at a known speed shows."""
    body_map, key_links = body_map_of(root, "nao")
    optimum, _ = OptimizationRetargeter(body_map).solve_frames(local_TJ33[:1])
    still_TJ33, optimum = local_TJ33[:1].expand(12, -1, -1, -1), optimum.expand(12, -1).clone()
    joint = body_map.robot.joint_names.index("LElbowYaw")
    speed = float(body_map.robot.velocity_N[joint])
    clip = Clip(Motion("a", still_TJ33, 24.0), optimum, optimum)
    quiet = evaluate_clip(clip, optimum, body_map, key_links)
    assert quiet.excess_deg == quiet.excess_max_deg == quiet.speed_max == quiet.over_limit == quiet.jumps == 0
    for share, over, jumps in ((0.9, 0, 0), (1.1, 1, 0), (2.0, 1, 1)):
        q_TN = optimum.clone()
        q_TN[6:, joint] -= share * speed / 24 * torch.sign(q_TN[0, joint])
        found = evaluate_clip(clip, q_TN, body_map, key_links)
        assert found.speed_max == pytest.approx(share * speed, rel=1e-4)
        assert found.over_limit == pytest.approx(over / 11) and found.jumps == jumps
        assert 0 < found.excess_deg < found.excess_max_deg
    assert math.isnan(evaluate_clip(Clip(clip.motion, optimum), optimum, body_map, key_links).excess_deg)


def test_reshared_clips_ask_for_the_same(root: Path, local_TJ33: torch.Tensor) -> None:
    body_map, _ = body_map_of(root, "nao")
    clips = [Clip(Motion("a", local_TJ33[first:], 24.0), torch.zeros(1, 8)) for first in (0, 20)]
    found, again = reshare_clips(clips), reshare_clips(clips)
    for before, after, same in zip(clips, found, again, strict=True):
        assert (
            torch.equal(after.motion.local_TJ33, same.motion.local_TJ33) and after.reference_TN is before.reference_TN
        )
        limbs = [body_map.human_directions(clip.motion.local_TJ33)[:, body_map.measured] for clip in (before, after)]
        torch.testing.assert_close(*limbs, atol=1e-4, rtol=0)
        assert float((after.motion.local_TJ33 - before.motion.local_TJ33).abs().max()) > 0.05


def test_latency_is_a_time_a_frame() -> None:
    poses = torch.zeros(3, 21, 3, 3)
    seen = []
    assert latency_us(lambda pose: seen.append(len(pose)) or pose, poses, 7, seconds=0.01) > 0
    assert set(seen) == {7}


def test_the_command_measures_a_package_and_refuses_another_robots(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = load_config(root / "conf" / "nao.yaml", ["model.hidden=16"])
    body_map = build_body_map(config.robot)
    made = Retargeter(build_network(config, body_map), body_map, BodyPrior.open(), config, phi_threshold=0.01)
    package = made.save(tmp_path / "package", {})
    for name in ("drinking", "wave"):
        cut_motion(name, tmp_path, (1, 2), every=4)
    given = ["--retargeter", str(package), "--quiet", f"pairs.dir={tmp_path}", f"evaluation.motions=[{tmp_path}]"]
    plain = ""
    for flags, clip in (([], "wave"), (["--validation", "--polish", "0"], "drinking")):
        main(["--config", str(root / "conf" / "nao.yaml"), *given, *flags])
        output = capsys.readouterr().out
        plain = output if clip == "wave" else plain
        assert f"\n{clip} " in output and "mean over frames" in output and "us for one frame" in output
    for way in ("networks", "frame by frame", "whole clips", "stream", "whole clips, re-shared", "reference"):
        assert any(line.startswith(f"{way}  ") for line in plain.splitlines())
    assert max(map(len, plain.splitlines())) <= 150
    main(["--config", str(root / "conf" / "nao.yaml"), *given, "--polish", "2"])
    polished = capsys.readouterr().out
    assert "whole clips" not in polished

    def limbs(table: str) -> float:
        return float(next(line for line in table.splitlines() if line.startswith("wave")).split()[4])

    assert limbs(polished) < 0.7 * limbs(plain)
    with pytest.raises(UserError, match="--polish must be"):
        main(["--config", str(root / "conf" / "nao.yaml"), *given, "--polish", "x"])
    with pytest.raises(UserError, match="another robot or other joints"):
        main(["--config", str(root / "conf" / "coman.yaml"), *given])
    with pytest.raises(UserError, match="another robot or other joints"):
        main(["--config", str(root / "conf" / "nao.yaml"), *given, "robot.joints=[LShoulderPitch, LShoulderRoll]"])
    with pytest.raises(UserError, match="--retargeter --predictions --optimiser is required"):
        main(["--config", str(root / "conf" / "nao.yaml")])
    with pytest.raises(UserError, match="is no package of a retargeter"):
        main(["--config", str(root / "conf" / "nao.yaml"), "--retargeter", str(tmp_path)])


def test_joints_at_a_limit_are_named(root: Path) -> None:
    body_map, key_links = body_map_of(root, "nao")
    robot = body_map.robot
    q = ((robot.lower_N + robot.upper_N) / 2).repeat(4, 1)
    q[:3, 1], q[:1, 2] = robot.upper_N[1], robot.lower_N[2]
    clip = Clip(Motion("a", torch.eye(3).expand(4, 21, 3, 3), 24.0), q)
    found = evaluate_clip(clip, q, body_map, key_links)
    assert dict(found.joints_at_limit) == {
        n: [0, 0.75, 0.25][i] if i < 3 else 0 for i, n in enumerate(robot.joint_names)
    }
    both = [found, dataclasses.replace(found, frames=12, joints_at_limit=tuple((n, 0.0) for n in robot.joint_names))]
    means = [mean_score(both), mean_score(both, over_frames=True)]
    assert [mean.most_at_limit for mean in means] == pytest.approx([0.375, 0.1875])
    assert (
        table([*both, *means]).splitlines()[-1]
        == "at a limit, share of the frames: LShoulderRoll 18.8%, LElbowYaw 6.2%"
    )
    assert measures(means[0])["at_limit/LShoulderRoll"] == pytest.approx(0.375)


@pytest.mark.filterwarnings("ignore::mrhubo.errors.InputWarning")
def test_a_point_beside_a_joint_shows_in_the_geometric_error_alone(local_TJ33: torch.Tensor) -> None:
    found = []
    for link in ("left_shoulder_roll_link", "left_shoulder_pitch_link"):
        body_map = build_body_map(more_robot("g1", keypoints={"left_shoulder": link}))
        q = OptimizationRetargeter(body_map).retarget(local_TJ33[:20], 24.0).q_TN
        found.append(evaluate_clip(Clip(Motion("a", local_TJ33[:20], 24.0), q), q, body_map, ["left_wrist_yaw_link"]))
    right, beside = found
    assert max(right.limb_deg, beside.limb_deg) < 1
    # The upper arm is one limb of four, and 40 mm of its 20 cm are 11 degrees.
    assert 1.5 < beside.geometric_limb_deg - right.geometric_limb_deg < 5
