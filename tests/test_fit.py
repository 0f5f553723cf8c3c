"""The command as a user runs it, small: result, tracking, resumption after kill -9 and Ctrl-C, mistakes."""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import shutil
import signal
import socket
import time
from multiprocessing.context import ForkServerContext
from pathlib import Path
from typing import Any

import lightning
import mlflow
import numpy as np
import pytest
import torch

from mrhubo.body import BodyPrior, Skeleton, VPoser, save_skeleton
from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.evaluation import load_motions
from mrhubo.files.atomic import checksum_file
from mrhubo.fit import main
from mrhubo.fitting.record import run_name
from mrhubo.motion import read_motion
from mrhubo.retargeter import Retargeter
from mrhubo.runtime.ranks import Ranks
from tests.chain import as_command, cut_motion

pytestmark = pytest.mark.usefixtures("light_records", "light_pairs")

SMALL = [
    "pairs.count=600", "pairs.shard_size=200", "pairs.amortiser_steps=10", "pairs.fine_steps=3", "model.hidden=64",
    "model.layers=2",
    "trainer.max_steps=60", "trainer.batch_size=128", "trainer.validate_every=15", "trainer.accelerator=cpu",
]  # fmt: skip


@pytest.fixture(scope="module")
def motions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A second of three of the shipped motions."""
    folder = tmp_path_factory.mktemp("motions")
    for name in ("drinking", "wave", "boxing"):
        cut_motion(name, folder, (1, 2), every=4)
    return folder


@pytest.fixture(scope="module")
def two_motions(motions: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two of them, for fits of which it does not matter how good they are."""
    folder = tmp_path_factory.mktemp("motions")
    for name in ("drinking", "wave"):
        shutil.copy(motions / f"{name}.npz", folder)
    return folder


def arguments(root: Path, folder: Path, motions: Path, *overrides: str) -> list[str]:
    return [
        "--config", str(root / "conf" / "nao.yaml"), "--quiet", *SMALL, f"evaluation.motions=[{motions}]",
        f"pairs.dir={folder / 'pairs'}", f"tracking.dir={folder / 'mlruns'}", *overrides,
    ]  # fmt: skip


def runs_of(folder: Path) -> list[Any]:
    client = mlflow.MlflowClient(tracking_uri=f"sqlite:///{folder / 'mlruns' / 'mlflow.db'}")
    experiment = client.get_experiment_by_name("mrhubo")
    assert experiment is not None
    return client.search_runs([experiment.experiment_id])


@pytest.fixture(scope="module")
def fitted(root: Path, motions: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Folder and output of a whole fit."""
    folder = tmp_path_factory.mktemp("fit")
    with contextlib.redirect_stdout(io.StringIO()) as output:
        main(arguments(root, folder, motions))
    return folder, output.getvalue()


def test_it_ends_with_a_table_the_package_and_the_dashboard(fitted: tuple[Path, str]) -> None:
    folder, output = fitted
    lines = output.strip().splitlines()
    assert lines[0].split()[:6] == ["clip", "frames", "joint", "[rad]", "link", "[cm]"]
    assert {line.split()[0] for line in lines if line} >= {"boxing", "wave", "mean", "package:", "dashboard:"}
    ways = ["networks", "frame by frame", "whole clips", "stream", "reference"]
    assert all(f"\n{way} " in output for way in ways) and "\nwhole clips, re-shared " in output
    package = Path(next(line.split(None, 1)[1] for line in lines if line.startswith("package:")))
    assert package.parent == folder / "mlruns" / "packages"
    assert "--host 127.0.0.1" in lines[-1]


def test_the_run_holds_everything(fitted: tuple[Path, str]) -> None:
    folder, _ = fitted
    (found,) = runs_of(folder)
    assert found.info.status == "FINISHED" and found.info.run_name.startswith("nao")
    metrics = set(found.data.metrics)
    assert metrics >= {
        "train/loss", "train/loss_pre", "train/loss_post", "val/joint_rad", "val/link_cm", "test/joint_rad", "test/link_cm",
        "test/wave/link_cm", "test/limb_deg", "test/latency_us", "test/retarget/limb_deg", "test/retarget/latency_us",
        "pairs/kept_share", "pairs/ik_residual_mm", "pairs/per_second",
    }  # fmt: skip
    assert 0 < found.data.metrics["test/retarget/limb_deg"] < found.data.metrics["test/limb_deg"]
    assert set(found.data.tags) >= {"robot", "git_commit", "pairs_fingerprint", "prior_xxh3", "version.torch"}
    assert found.data.params["trainer/max_steps"] == "60" and found.data.params["pairs/seed"] == "0"
    artifacts = Path(found.info.artifact_uri.removeprefix("file://"))
    names = {str(path.relative_to(artifacts)) for path in artifacts.rglob("*") if path.is_file()}
    assert names >= {
        "config.yaml", "pairs/phi_histogram.png", "pairs/feasible_and_extreme.png", "test/clips.json",
        "test/key_poses_wave.png", "package/retargeter.safetensors", "package/robot.urdf", "checkpoint/best.ckpt",
    }  # fmt: skip
    (page,) = [name for name in names if name.endswith(".html")]
    assert page.startswith("test/") and 500_000 < (artifacts / page).stat().st_size < 5_000_000
    assert not any(name.endswith(".gif") for name in names), "the page is there in place of the GIF"


def test_a_model_version_leads_back_to_run_pairs_prior_urdf_and_motions(
    root: Path, fitted: tuple[Path, str], motions: Path
) -> None:
    folder, output = fitted
    found = min(runs_of(folder), key=lambda run: run.info.start_time)
    assert "model:     models:/mrhubo-nao/1\n" in output
    client = mlflow.MlflowClient(tracking_uri=f"sqlite:///{folder / 'mlruns' / 'mlflow.db'}")
    version = client.get_model_version("mrhubo-nao", "1")
    assert version.run_id == version.tags["run_id"] == found.info.run_id
    assert version.tags["urdf_xxh3"] == checksum_file(root / "data" / "robots" / "nao" / "nao.urdf")
    assert version.tags["prior_xxh3"] == BodyPrior.open().checksum
    assert float(version.tags["test_link_cm"]) == pytest.approx(found.data.metrics["test/link_cm"], abs=1e-3)
    data = {entry.tags[0].value: entry.dataset for entry in found.inputs.dataset_inputs}
    assert set(data) == {"training", "validation", "testing"}
    pairs = json.loads(data["training"].profile)
    assert data["training"].digest == version.tags["pairs_fingerprint"] == pairs["fingerprint"]
    assert (pairs["robot"], pairs["forward"] + pairs["reverse"]) == ("nao", 600)
    assert pairs["prior_xxh3"] == version.tags["prior_xxh3"]
    clips = json.loads(data["testing"].profile)["motion_xxh3"]
    assert "wave" in clips and clips == {name: read_motion(motions / f"{name}.npz").checksum for name in clips}


def test_a_fit_that_fails_says_why_and_goes_on_when_the_cause_is_gone(
    root: Path, fitted: tuple[Path, str], two_motions: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And one whose server has no registry still ends well."""
    shutil.copytree(fitted[0] / "pairs", tmp_path / "pairs")
    given = arguments(root, tmp_path, two_motions, "trainer.max_steps=30")

    def full(*_: object, **__: object) -> None:
        raise UserError("checkpoints: no space left on device")

    with monkeypatch.context() as patch, pytest.raises(UserError):
        patch.setattr(lightning.Trainer, "fit", full)
        main(given)
    (failed,) = runs_of(tmp_path)
    assert failed.info.status == "FAILED"
    assert failed.data.tags["ended_by"] == "UserError: checkpoints: no space left on device"
    with monkeypatch.context() as patch, contextlib.redirect_stdout(io.StringIO()) as output:
        patch.setattr(mlflow.MlflowClient, "create_model_version", full)
        main(given)
    (found,) = runs_of(tmp_path)
    assert found.info.run_id == failed.info.run_id and found.info.status == "FINISHED"
    assert "resumed" in found.data.tags and "ended_by" not in found.data.tags
    assert "\nmodel:     not registered: UserError: checkpoints" in output.getvalue()


def test_the_package_retargets(root: Path, fitted: tuple[Path, str], motions: Path) -> None:
    folder, output = fitted
    (package,) = (folder / "mlruns" / "packages").iterdir()
    retargeter = Retargeter.load(package)
    assert retargeter.joint_names[0] == "LShoulderPitch"
    config = load_config(root / "conf" / "nao.yaml", [f"evaluation.motions=[{motions}]"])
    for motion in load_motions(config).test:
        result = retargeter.retarget(motion.local_TJ33)
        robot = retargeter.body_map.robot
        assert bool(((result.q >= robot.lower_N) & (result.q <= robot.upper_N)).all())
        assert bool(((result.confidence >= 0) & (result.confidence <= 1)).all())
        assert result.q.shape == (len(motion), 8)
        torch.testing.assert_close(retargeter.predict(motion.local_TJ33, polish=10), result.q)


def test_the_dashboards_code_runs(root: Path, fitted: tuple[Path, str], monkeypatch: pytest.MonkeyPatch) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", (root / "docs" / "dashboard.md").read_text(), re.S)
    monkeypatch.chdir(root)
    before = mlflow.get_tracking_uri()
    names: dict[str, Any] = {}
    try:
        exec(code.replace("sqlite:///mlruns", f"sqlite:///{fitted[0] / 'mlruns'}"), names)
    finally:
        mlflow.set_tracking_uri(before)
    (package, *_) = sorted((fitted[0] / "mlruns" / "packages").iterdir(), key=lambda path: path.stat().st_mtime)
    retargeter, local_TJ33 = Retargeter.load(package), read_motion(root / "data" / "motions" / "wave.npz").local_TJ33
    q_TN = torch.tensor(names["table"][list(retargeter.joint_names)].to_numpy())
    torch.testing.assert_close(q_TN, retargeter.retarget(local_TJ33).q, atol=1e-3, rtol=0)


def final_metrics(folder: Path) -> dict[str, float]:
    (found,) = runs_of(folder)
    assert found.info.status == "FINISHED"
    metrics = found.data.metrics.items()
    return {k: v for k, v in metrics if k.startswith(("test", "val", "train")) and "latency" not in k}


def test_stopped_in_training_it_resumes_to_the_same_metrics(
    root: Path,
    fitted: tuple[Path, str],
    motions: Path,
    tmp_path: Path,
    server: ForkServerContext,
    empty_tracking: Path,
) -> None:
    """Killed, and when it has gone on, interrupted."""
    shutil.copytree(fitted[0] / "pairs", tmp_path / "pairs")
    shutil.copytree(empty_tracking, tmp_path / "mlruns")
    given, ids, written = arguments(root, tmp_path, motions), set(), [0]
    for stop, status in ((signal.SIGKILL, -signal.SIGKILL), (signal.SIGINT, 130)):
        process = server.Process(target=as_command, args=("fit", given, tmp_path / "output", {}))
        process.start()
        deadline = time.monotonic() + 200
        while time.monotonic() < deadline and process.is_alive():
            last = [path.stat().st_mtime_ns for path in (tmp_path / "mlruns").glob("fits/*/checkpoints/last.ckpt")]
            if last and last != written:
                break
            time.sleep(0.005)
        assert process.is_alive(), f"it ended before it could be stopped: {(tmp_path / 'output').read_text()}"
        assert process.pid is not None
        os.killpg(process.pid, stop)
        process.join(200)
        assert process.exitcode == status
        written = [path.stat().st_mtime_ns for path in (tmp_path / "mlruns").glob("fits/*/checkpoints/last.ckpt")]
        (unfinished,) = runs_of(tmp_path)
        assert unfinished.info.status == ("KILLED" if stop == signal.SIGINT else "RUNNING")
        assert ("ended_by" in unfinished.data.tags) is (stop == signal.SIGINT)
        ids.add(unfinished.info.run_id)
    main(given)
    (found,) = runs_of(tmp_path)
    assert {found.info.run_id} == ids and "resumed" in found.data.tags
    assert "ended_by" not in found.data.tags
    expected, got = final_metrics(fitted[0]), final_metrics(tmp_path)
    assert got.keys() == expected.keys()
    for name, value in expected.items():
        assert got[name] == pytest.approx(value, abs=1e-4), name


def test_a_finished_fit_run_again_is_a_new_run_with_the_same_result(
    root: Path, fitted: tuple[Path, str], motions: Path
) -> None:
    with contextlib.redirect_stdout(io.StringIO()) as output:
        main(arguments(root, fitted[0], motions))
    assert output.getvalue().split("package:")[0] == fitted[1].split("package:")[0]
    latest, earlier = runs_of(fitted[0])
    mlflow.MlflowClient(tracking_uri=f"sqlite:///{fitted[0] / 'mlruns' / 'mlflow.db'}").delete_run(latest.info.run_id)
    assert latest.info.run_id != earlier.info.run_id


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["pairs.cuont=10"], "pairs.count"),
        (["pairs.count=-5"], "pairs.count"),
        (["robot.urdf=nowhere/nao.urdf"], "nowhere/nao.urdf does not exist"),
        (["robot.key_links=[l_wirst]"], "nearest: 'l_wrist'"),
        (["robot.joints=[LShoulderPich]"], "nearest: 'LShoulderPitch'"),
        (["model.input_joints=[left_elbo]", "model.input_frame=local"], "nearest: 'left_elbow'"),
        (["evaluation.motions=[nowhere]"], "nowhere"),
        (["evaluation.validation=[]"], "evaluation.validation"),
        (["body.prior_path=nowhere.safetensors"], "nowhere.safetensors"),
        (["body.prior=vposer"], "body.prior_path: is missing"),
        (["body.prior=vposer", "body.prior_path=V02_05"], "V02_05: there is no such file or folder"),
        (["body.model_path=SMPLX_NEUTRAL.npz"], "SMPLX_NEUTRAL.npz: there is no such file"),
        (["body.betas=[0.5]"], "body.betas: shape the body model of body.model_path, which is not given"),
    ],
)
def test_a_mistake_is_one_sentence_before_any_work(
    root: Path, motions: Path, tmp_path: Path, overrides: list[str], message: str
) -> None:
    with pytest.raises(UserError) as error:
        main(arguments(root, tmp_path, motions, *overrides))
    assert message in str(error.value)
    assert list(tmp_path.iterdir()) == [], "nothing was begun"


def test_nan_in_a_motion_is_refused_before_any_work(root: Path, motions: Path, tmp_path: Path) -> None:
    folder = tmp_path / "motions"
    shutil.copytree(motions, folder)
    arrays = dict(np.load(folder / "wave.npz"))
    arrays["pose_body"][7, 3] = np.nan
    np.savez(folder / "wave.npz", **arrays)
    with pytest.raises(UserError, match=r"wave\.npz.* 7"):
        main(arguments(root, tmp_path, folder))
    assert [path.name for path in tmp_path.iterdir()] == ["motions"]


def test_vposer_and_an_official_skeleton_take_the_place_of_ours(root: Path, two_motions: Path, tmp_path: Path) -> None:
    """Random weights and lengths: what counts here is that a fit goes through, and the package without the files."""
    torch.manual_seed(0)
    VPoser().save(tmp_path / "vposer.safetensors")
    save_skeleton(tmp_path / "longer.safetensors", Skeleton(1.1 * Skeleton().offsets_J3))
    paths = [f"body.prior_path={tmp_path}/vposer.safetensors", f"body.model_path={tmp_path}/longer.safetensors"]
    main(arguments(root, tmp_path, two_motions, "body.prior=vposer", *paths, "trainer.max_steps=30", "pairs.count=200"))
    (found,) = runs_of(tmp_path)
    assert found.info.status == "FINISHED" and "prior=vposer" in found.info.run_name
    for name in ("vposer", "longer"):
        (tmp_path / f"{name}.safetensors").unlink()
    (package,) = (tmp_path / "mlruns" / "packages").iterdir()
    assert isinstance(Retargeter.load(package).prior, VPoser)


@pytest.mark.parametrize("variants", [["model.stages=1", "pairs.filter=none"], ["trainer.precision=bf16"]])
def test_variants_are_settings(
    root: Path, fitted: tuple[Path, str], two_motions: Path, tmp_path: Path, variants: list[str]
) -> None:
    shutil.copytree(fitted[0] / "pairs", tmp_path / "pairs")
    main(arguments(root, tmp_path, two_motions, *variants))
    (found,) = runs_of(tmp_path)
    assert all(variant.split(".")[1] in found.info.run_name for variant in variants)
    assert ("train/loss_pre" in found.data.metrics) is ("model.stages=1" not in variants)


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def test_two_ranks_fit_together_to_nearly_the_same_result(
    root: Path, fitted: tuple[Path, str], motions: Path, tmp_path: Path, server: ForkServerContext, empty_tracking: Path
) -> None:
    """With what `torch.distributed.run` sets; that it starts ranks is seen where they make pairs."""
    shutil.copytree(fitted[0] / "pairs", tmp_path / "pairs")
    shutil.copytree(empty_tracking, tmp_path / "mlruns")
    given = arguments(root, tmp_path, motions)
    shared = {"TORCHELASTIC_RUN_ID": "1", "WORLD_SIZE": "2", "LOCAL_WORLD_SIZE": "2", "GROUP_RANK": "0"}
    shared |= {"MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(free_port())}
    ranks = [
        server.Process(
            target=as_command,
            args=("fit", given, tmp_path / f"output{rank}", {**shared, "RANK": str(rank), "LOCAL_RANK": str(rank)}),
        )
        for rank in range(2)
    ]
    for process in ranks:
        process.start()
    for process in ranks:
        process.join(200)
    outputs = [(tmp_path / f"output{rank}").read_text() for rank in range(2)]
    assert [process.exitcode for process in ranks] == [0, 0], outputs
    assert "".join(outputs).count("package:") == 1, "one rank reports"
    expected, got = final_metrics(fitted[0]), final_metrics(tmp_path)
    assert got.keys() == expected.keys()
    for name, value in expected.items():
        if name.startswith("test"):
            assert got[name] == pytest.approx(value, rel=0.02, abs=1e-3), name


def test_ranks_that_cannot_share_a_batch_are_refused(
    root: Path, motions: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Ranks, "join", lambda accelerator: Ranks(0, 2))
    with pytest.raises(UserError, match="batch_size: must be a multiple of the 2 processes"):
        main(arguments(root, tmp_path, motions, "trainer.batch_size=127"))


def test_runs_are_named_after_what_differs(root: Path) -> None:
    config = load_config(root / "conf" / "nao.yaml", ["pairs.workers=3", "model.stages=1", "pairs.filter=none"])
    assert run_name(config) == "nao filter=none stages=1"
    config.pairs.count = 10
    assert run_name(config) == "nao filter=none stages=1 count=10"
    assert run_name(load_config(root / "conf" / "paper" / "reachy.yaml")).endswith(" scale=manual max_steps=9000")
