"""The paper's tables: what has to be trained, what the tables say, and the command as a user runs it."""

from __future__ import annotations

from pathlib import Path

import mlflow
import numpy as np
import pytest

from mrhubo.config import BaselineConfig
from mrhubo.errors import UserError
from mrhubo.fitting.record import read_predictions
from mrhubo.paper import trainings
from mrhubo.paper.tables import METHODS, PAPER, Part, chart, parts, tables
from mrhubo.reproduce import main
from mrhubo.runtime.database import database_uri
from mrhubo.runtime.progress import Reporter
from tests.chain import cut_motion

pytestmark = pytest.mark.usefixtures("light_records", "light_pairs")

SMALL = [
    "pairs.count=400", "pairs.shard_size=200", "pairs.amortiser_steps=10", "pairs.fine_steps=3", "model.hidden=16",
    "trainer.max_steps=20", "trainer.batch_size=64",
]  # fmt: skip


def test_every_robot_method_and_seed_is_a_part() -> None:
    work = parts(["nao", "coman"], 2, ["model.hidden=9", "s3le.steps=7"])
    assert len(work) == 2 * (2 * len(METHODS) + 1) and len({(p.robot, p.method, p.seed) for p in work}) == len(work)
    assert [p.seed for p in work] == sorted(p.seed for p in work)
    for part in work:
        assert part.config.robot.name == part.robot and part.config.model.hidden == 9
        assert part.config.pairs.reverse_share == (0.5 if part.method in ("our default", "S3LE") else 0)
        assert isinstance(part.config, BaselineConfig) == (part.method == "S3LE")
        if isinstance(part.config, BaselineConfig):
            assert part.config.s3le.steps == 7 and part.config.s3le.seed == part.seed
        else:
            assert part.config.trainer.seed == part.seed
    assert [p.method for p in work if p.robot == "nao" and p.config.pairs.filter == "none"] == ["without filter"] * 2
    assert {p.method for p in work if p.config.model.stages == 1} == {"one stage"}
    assert len(parts(["coman"], 1, [], list(METHODS))) == len(METHODS)
    assert [p.method for p in parts(["nao", "coman"], 1, [], ["one stage", "S3LE"])] == [*["one stage"] * 2, "S3LE"]
    paper = parts(["nao"], 1, [], paper=True)
    assert [p.method for p in paper] == ["proposed", "without filter", "one stage"]
    assert {p.config.robot.scale for p in paper} == {"manual"} and {p.config.trainer.loss for p in paper} == {"mse"}
    with pytest.raises(UserError, match="'naoo' .*nao"):
        parts(["naoo"], 1, [])
    with pytest.raises(UserError, match="--methods: method 'propose' does not exist; nearest: 'proposed'"):
        parts(["nao"], 1, [], ["propose"])
    with pytest.raises(UserError, match="nothing to train: no S3LE on nao"):
        parts(["nao"], 1, [], ["S3LE"])
    with pytest.raises(UserError, match="nothing to train: no our default on nao with the paper's settings"):
        parts(["nao"], 1, [], ["our default"], paper=True)


def measures(joint: float, link: float) -> dict[str, float]:
    return {"joint_rad": joint, "link_cm": link, "limb_deg": 3.0, "at_limit": 0.015, "retarget/limb_deg": 2.5}


def test_the_tables_hold_both_figures() -> None:
    results = {
        ("nao", "proposed"): [measures(0.1, 1.0), measures(0.2, 2.0)],
        ("coman", "our default"): [
            {**measures(0.05, 0.5), "retarget/joint_rad": 0.04, "clip/jumps": 2.0, "reshared/clip/over_limit": 0.25}
        ],
        ("coman", "S3LE"): [measures(0.15, 3.5)],
    }
    text = tables(results)
    first, second, more, after, *motion = text.split("\n\n")[1::2]
    titles = [part for part in text.split("\n\n")[::2] if part.startswith("Motion")]
    assert titles[-1] == "Motion, the test clips re-shared: with steps of optimisation, whole clips"
    assert "| 25.0 " in motion[-1] and any("| 2.0 " in block for block in motion) and "S3LE" not in "".join(motion)
    assert "| nao   | 0.150 ± 0.071 (0.389) |" in first and "| coman |                       | 0.050       |" in first
    assert "| nao   | 1.50 ± 0.71 (3.887) |" in second
    assert "without filter" not in first
    assert more.splitlines()[2].split("|")[1:3] == [" nao   ", " proposed    "] and "1.5 ± 0.0" in more
    assert "| coman | our default | 0.040       |" in after and "| 2.5 " in after  # alone: the others lack it
    assert "nao" not in after and "S3LE" not in after
    for block in (first, second, more, after):
        assert len({len(line) for line in block.splitlines()}) == 1
    picture = chart(results)
    assert picture.width > 800 and len(picture.convert("RGB").getcolors(1 << 24)) > 10


def test_the_papers_figures_are_those_of_its_tables() -> None:
    """Copied by hand from the paper; proposed is the best of its own three everywhere."""
    for figures in PAPER.values():
        best = figures["proposed"]
        assert all(best[i] <= figures[m][i] for m in ("without filter", "one stage") for i in (0, 1))


def test_the_command_trains_once_and_finds_what_is_done(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    methods = ("one stage", "our default")
    motions = tmp_path / "motions"
    for name in ("drinking", "wave"):
        cut_motion(name, motions, (1, 2), every=4)
    given = ["--robots", "nao", "--methods", ", ".join(methods), "--seeds", "1", "--quiet", *SMALL]
    given += [f"pairs.dir={tmp_path / 'pairs'}"]
    given += [f"tracking.dir={tmp_path / 'mlruns'}", f"evaluation.motions=[{motions}]", "trainer.accelerator=cpu"]
    main(given)
    first = capsys.readouterr().out
    assert "Table I: joint error" in first and "(0.506)" in first and "Beyond the paper" in first
    assert "proposed" not in first
    client = mlflow.MlflowClient(tracking_uri=database_uri(tmp_path / "mlruns"))
    (experiment,) = [e for e in client.search_experiments() if e.name == "mrhubo"]
    runs = client.search_runs([experiment.experiment_id])
    (parent,) = [run for run in runs if "mlflow.parentRunId" not in run.data.tags]
    children = [run for run in runs if run is not parent]
    assert len(children) == len(methods) and {run.info.status for run in runs} == {"FINISHED"}
    assert {run.data.tags["mlflow.parentRunId"] for run in children} == {parent.info.run_id}
    artifacts = {file.path for file in client.list_artifacts(parent.info.run_id)}
    assert artifacts == {"tables.md", "errors.png", "key_poses_nao.png"}
    for run in children:
        (answer,) = read_predictions(client, run.info.run_id).values()  # one of the two clips is for validation
        assert answer.shape[1] == 8 and bool(answer.isfinite().all())
        assert 0 < run.data.metrics["test/latency_1000_us"] < run.data.metrics["test/latency_us"]
    link = np.array([run.data.metrics["test/link_cm"] for run in children])
    assert all(f"{value:.2f} (" in first or f" {value:.2f} " in first for value in link)
    monkeypatch.setattr(trainings, "fit", lambda *a, **k: pytest.fail("trained again"))
    main(given)
    assert capsys.readouterr().out == first
    assert len(client.search_runs([experiment.experiment_id])) == len(runs)


def test_mistakes_are_named() -> None:
    with pytest.raises(UserError, match="--seeds must be"):
        main(["--seeds", "none"])
    with pytest.raises(UserError, match="has its own configs"):
        main(["--config", "conf/nao.yaml"])
    with pytest.raises(UserError, match="set by --seeds"):
        main(["trainer.seed=3"])
    with pytest.raises(UserError, match="robot"):
        main(["--robots", "atlas"])
    with pytest.raises(UserError, match="--methods"):
        main(["--methods", "all"])


def test_s3le_is_left_out_aloud_without_motion_capture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(trainings, "default_capture", lambda: tmp_path / "none.npz")
    seen: list[Part] = []

    def stop(work: list[Part]) -> None:
        seen.extend(work)
        raise KeyboardInterrupt

    monkeypatch.setattr(trainings, "_open_parent", stop)
    with pytest.raises(KeyboardInterrupt):
        trainings.reproduce(["coman"], 1, [], Reporter())
    assert "S3LE is left out" in capsys.readouterr().out and {p.method for p in seen} == set(METHODS)
    with pytest.raises(UserError, match="S3LE learns from human motion capture"):
        trainings.reproduce(["coman"], 1, [], methods=["S3LE"])
