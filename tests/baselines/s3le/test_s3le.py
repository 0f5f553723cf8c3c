"""The baseline: its look-up among feasible poses, its losses, a small training, and the command as a user runs it."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import mlflow
import numpy as np
import pytest
import torch

from mrhubo.baseline import main
from mrhubo.baselines.s3le import experiment
from mrhubo.baselines.s3le.model import S3LE, normality_gap
from mrhubo.baselines.s3le.search import NEIGHBOURS, WIDTHS
from mrhubo.baselines.s3le.training import make_data, train_s3le
from mrhubo.body import BodyPrior
from mrhubo.config import BaselineConfig, S3LEConfig, load_config
from mrhubo.errors import UserError
from mrhubo.robot import BodyMap, SelfCollision, build_body_map
from mrhubo.rotation import matrix_to_axis_angle
from mrhubo.runtime.database import database_uri
from tests.chain import cut_motion

pytestmark = pytest.mark.usefixtures("light_records")

SMALL = S3LEConfig(glue=400, random_poses=3000, self_made=500, latent=8, hidden=64, steps=120, batch_size=128)


@pytest.fixture(scope="module")
def body_map(root: Path) -> BodyMap:
    return build_body_map(load_config(root / "conf" / "nao.yaml").robot)


@pytest.fixture(scope="module")
def poses() -> torch.Tensor:
    """Human poses (600, 21, 3, 3)."""
    prior = BodyPrior.open()
    return prior.decode_matrices(torch.randn(600, prior.latent, generator=torch.Generator().manual_seed(0))).detach()


@pytest.fixture(scope="module")
def trained(body_map: BodyMap, poses: torch.Tensor) -> S3LE:
    return train_s3le(body_map, make_data(body_map, poses[:400], SMALL), SMALL)


def test_answers_are_feasible_and_near_the_reference(body_map: BodyMap, poses: torch.Tensor, trained: S3LE) -> None:
    robot, collision = body_map.robot, SelfCollision(body_map.robot)
    unseen_BD3 = body_map.human_directions(poses[400:])[:, body_map.measured]
    for neighbours in (1, 10):
        q_BN = trained.answer(trained.human_codes(unseen_BD3), neighbours, 0.5, collision)
        assert bool(((q_BN >= robot.lower_N) & (q_BN <= robot.upper_N)).all())
        assert not bool(collision.collides(q_BN).any())
    robot_BD3 = body_map.robot_directions(robot.forward(q_BN))[:, body_map.measured]
    miss = (robot_BD3 - unseen_BD3).norm(dim=-1).mean()
    random_BD3 = body_map.robot_directions(robot.forward(robot.sample(200, torch.Generator().manual_seed(3))))
    random_BD3 = random_BD3[:, body_map.measured]
    assert float(miss) < 0.5 * float((random_BD3 - unseen_BD3).norm(dim=-1).mean())


def test_a_projection_has_the_code_of_what_it_is_the_projection_of(body_map: BodyMap, trained: S3LE) -> None:
    robot, collision = body_map.robot, SelfCollision(body_map.robot)
    unit_BN = 2 * torch.rand(300, 8, generator=torch.Generator().manual_seed(5)) - 1
    beyond_BN = trained.middle_N + 1.2 * trained.half_N * unit_BN
    projected_BN = trained.answer(trained.robot_codes(beyond_BN), 10, 0.5, collision)
    codes, projected, others = (
        trained.human_codes(body_map.robot_directions(robot.forward(q_BN))[:, body_map.measured])
        for q_BN in (beyond_BN, projected_BN, beyond_BN.roll(1, 0))
    )
    assert float((codes - projected).norm(dim=1).mean()) < 0.5 * float((codes - others).norm(dim=1).mean())


def test_the_same_seed_gives_the_same_answers(body_map: BodyMap, poses: torch.Tensor) -> None:
    short = dataclasses.replace(SMALL, steps=20, glue=100, random_poses=500, self_made=100)
    one, other = (train_s3le(body_map, make_data(body_map, poses[:100], short), short) for _ in range(2))
    assert torch.equal(one.codes_FZ, other.codes_FZ)


def test_the_nearest_is_found_and_a_colliding_mean_is_not_taken(body_map: BodyMap) -> None:
    robot, collision = body_map.robot, SelfCollision(body_map.robot)
    model = S3LE(len(body_map.measured), robot.lower_N, robot.upper_N, 16, 4)
    q_BN = robot.sample(4000, torch.Generator().manual_seed(0))
    free_BN = q_BN[~collision.collides(q_BN)]
    model.set_feasible(free_BN)
    codes = model.robot_codes(free_BN[:50])
    torch.testing.assert_close(model.answer(codes, 1, 0.5, collision), free_BN[:50])
    answers = model.answer(codes, 200, 10.0, collision)  # far-away neighbours: many means collide
    distance = torch.cdist(codes, model.codes_FZ)
    nearest = distance.topk(200, largest=False)
    weight = torch.softmax(-0.5 * (nearest.values / (10.0 * nearest.values[:, -1:])).square(), dim=1)
    mean = (weight[..., None] * free_BN[nearest.indices]).sum(1)
    touching = collision.collides(mean)
    torch.testing.assert_close(answers[~touching], mean[~touching])
    torch.testing.assert_close(answers[touching], free_BN[:50][touching])


def test_the_gap_tells_normal_codes_from_others() -> None:
    generator = torch.Generator().manual_seed(0)
    normal, other = torch.randn(512, 8, generator=generator), torch.randn(512, 8, generator=generator)
    assert abs(float(normality_gap(other, normal))) < 0.02
    for wrong in (0.3 * other, other + 1, 3 * other):
        assert float(normality_gap(wrong, normal)) > 0.1


def test_the_command_measures_searches_and_resumes(
    root: Path, tmp_path: Path, poses: torch.Tensor, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    motions = tmp_path / "motions"
    for name in ("drinking", "wave"):
        cut_motion(name, motions, (1, 2), every=4)
    axis_angle = matrix_to_axis_angle(poses).flatten(1)
    whole = torch.cat((torch.zeros(len(poses), 3), axis_angle), dim=1).numpy()
    np.savez(tmp_path / "poses.npz", poses=whole, clip_starts=np.array([0, 600]), clip_ids=np.array(["a"]))
    given = ["--config", str(root / "conf" / "nao.yaml"), "--quiet", f"tracking.dir={tmp_path / 'mlruns'}"]
    given += [
        f"pairs.dir={tmp_path / 'pairs'}",
        f"evaluation.motions=[{motions}]",
        f"s3le.poses={tmp_path / 'poses.npz'}",
    ]
    given += ["s3le.steps=20", "s3le.glue=200", "s3le.random_poses=500", "s3le.self_made=200", "s3le.hidden=32"]
    main(given)
    output = capsys.readouterr().out
    assert "\nwave " in output and "mean over clips" in output
    trained: list[int] = []

    def train(*given: Any) -> S3LE:
        if len(trained) == 1:
            trained.append(0)
            raise KeyboardInterrupt
        trained.append(1)
        return train_s3le(*given)

    monkeypatch.setattr(experiment, "train_s3le", train)
    with pytest.raises(KeyboardInterrupt):  # in the second trial
        main([*given, "--trials", "2"])
    main([*given, "--trials", "2"])
    assert trained == [1, 0, 1], "the first trial is not trained again"
    first = capsys.readouterr().out
    rows = [line for line in first.splitlines() if line.startswith("| ") and "trial" not in line]
    assert len(rows) == 2 and "s3le.neighbours" in first and "| s3le.width |" in first
    main([*given, "--trials", "2"])
    assert trained == [1, 0, 1] and capsys.readouterr().out == first
    best = load_config(Path(first.split("--config ")[1].split()[0]), schema=BaselineConfig)
    assert best.s3le.neighbours in NEIGHBOURS and best.s3le.width in WIDTHS and best.s3le.steps == 20
    client = mlflow.MlflowClient(tracking_uri=database_uri(tmp_path / "mlruns"))
    runs = client.search_runs([experiment_.experiment_id for experiment_ in client.search_experiments()])
    (parent,) = [run for run in runs if "sweep" in run.data.tags]
    trials = [run for run in runs if run.data.tags.get("mlflow.parentRunId") == parent.info.run_id]
    assert sorted(run.info.status for run in trials) == ["FINISHED", "FINISHED", "KILLED"]
    values = [run.data.metrics["val/best_link_cm"] for run in trials if run.info.status == "FINISHED"]
    assert parent.data.metrics["val/best_link_cm"] == pytest.approx(min(values), abs=1e-3)
    with pytest.raises(UserError, match="--trials must be"):
        main([*given, "--trials", "0"])
    with pytest.raises(UserError, match="the baseline learns from human motion capture"):
        main([*given, f"s3le.poses={tmp_path / 'none.npz'}"])
