"""Scores of clips, the split into validation and test, the cache of reference answers."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from mrhubo.callbacks import ClipMetrics
from mrhubo.config import Config, load_config
from mrhubo.errors import UserError
from mrhubo.evaluation import Clip, load_motions, mean_score, predict_clips, score_clip, solve_references
from mrhubo.motion import Motion
from mrhubo.retargeter import build_network
from mrhubo.robot import BodyMap, build_body_map
from mrhubo.rotation import sixd_to_matrix


@pytest.fixture
def motions(root: Path, tmp_path: Path) -> Path:
    shutil.copy(root / "data" / "motions" / "drinking.npz", tmp_path)
    shutil.copy(root / "data" / "motions" / "wave.npz", tmp_path / "wave_poses.npz")  # as AMASS names its files
    return tmp_path


def setting(root: Path, *overrides: str) -> tuple[Config, BodyMap]:
    config = load_config(root / "conf" / "nao.yaml", overrides)
    return config, build_body_map(config.robot)


def test_a_perfect_prediction_scores_zero_and_a_turned_joint_scores_its_angle(root: Path) -> None:
    config, body_map = setting(root)
    robot = body_map.robot
    q = robot.sample(40, torch.Generator().manual_seed(0))
    clip = Clip(Motion("a", torch.eye(3).expand(40, 21, 3, 3), 24.0), q)
    score = score_clip(clip, q + 2 * torch.pi, robot, config.robot.key_links)
    assert score.joint_rad == pytest.approx(0, abs=1e-5) and score.link_cm == pytest.approx(0, abs=1e-3)
    off = q.clone()
    off[:, robot.joint_names.index("LElbowRoll")] -= 0.4
    score = score_clip(clip, off, robot, config.robot.key_links)
    assert score.joint_rad == pytest.approx(0.4 / 8, rel=1e-4)
    # l_wrist and l_gripper lie 5.6 and 11.4 cm below the elbow: a chord of 2 r sin(0.2), two of eight links
    assert score.link_cm == pytest.approx((5.595 + 11.437) * 2 * 0.19867 / 8, rel=0.02)


def test_the_mean_counts_each_clip_once(root: Path) -> None:
    config, body_map = setting(root)
    robot = body_map.robot
    q = robot.sample(30, torch.Generator().manual_seed(0))
    clips = [Clip(Motion(n, torch.eye(3).expand(c, 21, 3, 3), 24.0), q[:c]) for n, c in (("a", 30), ("b", 10))]
    found = zip(clips, (q + 0.1, q[:10] + 0.3), strict=True)
    scores = [score_clip(clip, moved, robot, config.robot.key_links) for clip, moved in found]
    assert mean_score(scores).joint_rad == pytest.approx(0.2, rel=1e-4) and mean_score(scores).frames == 40
    assert mean_score(scores, over_frames=True).joint_rad == pytest.approx(0.15, rel=1e-4)


def test_predictions_come_back_clip_by_clip(root: Path) -> None:
    config, body_map = setting(root, "model.hidden=16")
    network = build_network(config, body_map)
    poses = torch.randn(25, 21, 6)
    turned = sixd_to_matrix(poses)
    clips = [Clip(Motion("a", turned[:7], 24.0), poses), Clip(Motion("b", turned[7:], 24.0), poses)]
    predicted = predict_clips(network, clips)
    assert [len(p) for p in predicted] == [7, 18] and network.training
    torch.testing.assert_close(torch.cat(predicted), network(poses).detach(), atol=1e-5, rtol=0)


def test_the_split(root: Path, motions: Path) -> None:
    config, _ = setting(root, f"evaluation.motions=[{motions}]")
    loaded = load_motions(config)
    assert [m.name for m in loaded.validation] == ["drinking"] and [m.name for m in loaded.test] == ["wave"]
    for names in ("[]", "[drinking, wave]", "[other]"):
        with pytest.raises(UserError, match="evaluation.validation"):
            load_motions(setting(root, f"evaluation.motions=[{motions}]", f"evaluation.validation={names}")[0])


def test_reference_answers_are_kept_and_damaged_ones_made_again(root: Path, motions: Path, tmp_path: Path) -> None:
    config, body_map = setting(root, f"evaluation.motions=[{motions}]")
    loaded, folder = load_motions(config), tmp_path / "reference"
    validation, test = solve_references(config, body_map, loaded, folder)
    robot = body_map.robot
    for clip in (*validation, *test):
        assert bool(((clip.reference_TN >= robot.lower_N) & (clip.reference_TN <= robot.upper_N)).all())
    files = {path: path.stat().st_mtime_ns for path in folder.iterdir()}
    solve_references(config, body_map, loaded, folder)
    assert files == {path: path.stat().st_mtime_ns for path in folder.iterdir()}
    victim = min(files)
    content = victim.read_bytes()
    victim.write_bytes(content[:-9])
    again, _ = solve_references(config, body_map, loaded, folder)
    assert victim.read_bytes() == content
    assert torch.equal(again[0].reference_TN, validation[0].reference_TN)


@pytest.mark.parametrize("bound", ["tanh", "clamp"])
def test_a_training_that_came_to_nan_ends(root: Path, bound: str) -> None:
    config, body_map = setting(root, "model.hidden=8", f"model.bound_output={bound}")
    network = build_network(config, body_map)
    clip = Clip(Motion("a", torch.eye(3).expand(9, 21, 3, 3), 24.0), torch.zeros(9, 8))
    metrics, logged = ClipMetrics([clip], body_map, config.robot.key_links), []
    module = SimpleNamespace(network=network, log_dict=logged.append)
    metrics.on_train_epoch_end(SimpleNamespace(global_step=500), module)  # pyright: ignore[reportArgumentType]
    assert set(logged[0]) == {"val/joint_rad", "val/link_cm", "val/angle_deg"} and 0 < logged[0]["val/angle_deg"] < 180
    for weights in network.parameters():
        weights.data.fill_(torch.nan)
    with pytest.raises(UserError, match="came to NaN by step 1,000; a lower trainer.lr helps"):
        metrics.on_train_epoch_end(SimpleNamespace(global_step=1000), module)  # pyright: ignore[reportArgumentType]
    assert len(logged) == 1
