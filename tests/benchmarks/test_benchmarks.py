"""Every benchmark runs to its end at a tiny size and prints its tables; the figures themselves mean nothing here."""

from __future__ import annotations

import importlib
import importlib.util
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from subprocess import PIPE

import numpy as np
import pytest
import torch

from mrhubo import pair, rotation
from mrhubo.body import BodyPrior
from mrhubo.config import load_config
from mrhubo.fast import engines
from mrhubo.pairing import lbfgs
from mrhubo.retargeter import Retargeter, build_network, without_training
from mrhubo.retargeter.confidence import STANDARD
from mrhubo.robot import build_body_map
from tests.reference.walkers import entries, write_urdf
from tests.video.films import needs_models

pytestmark = pytest.mark.usefixtures("light_pairs")

SCRIPTS = [
    "ablation",
    "camera",
    "collisions",
    "confidence",
    "continuity",
    "discovery",
    "files",
    "headings",
    "imitation",
    "inference",
    "many_robots",
    "missing_points",
    "on_the_floor",
    "pair_pictures",
    "pair_quality",
    "pairing",
    "polish",
    "prior",
    "prior_experiments",
    "reference",
    "retarget",
    "scaling",
    "show",
]
SCRIPTS += ["live", "physics", "stream", "training", "universal", "whole_body", "universal_speed", "without_training"]
LIBRARIES = ["closed_form", "common", "levenberg_marquardt", "mink_loop"]
Run = Callable[..., str]


@pytest.fixture
def run(root: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs a benchmark's `main` in this process, from the repository's root, and gives what it printed."""

    def run(name: str, *arguments: object) -> str:
        argv = [str(argument) for argument in arguments]
        monkeypatch.chdir(root)
        monkeypatch.setattr(sys, "argv", [f"benchmarks/{name}.py", *argv])
        importlib.import_module(name).main(argv)
        text = capsys.readouterr().out
        assert re.search(r"^machine: .*\ncommit:  .*\ncommand: python benchmarks/" + name, text, re.M), text
        assert "nan" not in text.lower().split()
        return text

    return run


@pytest.fixture(autouse=True)
def _uncalibrated(monkeypatch: pytest.MonkeyPatch) -> None:
    """The confidence of a robot that nothing was trained for takes seconds, and no table here has it."""
    monkeypatch.setattr(without_training, "calibrated", lambda _: STANDARD)


@pytest.fixture(scope="module")
def clips(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of two short motions: 24 frames of two shipped ones."""
    folder = tmp_path_factory.mktemp("clips")
    for name in ("wave", "boxing"):
        motion = np.load(root / "data" / "motions" / f"{name}.npz")
        arrays = {key: motion[key][60:84] if motion[key].ndim == 2 else motion[key] for key in motion.files}
        np.savez(folder / f"{name}.npz", **arrays)
    return folder


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of training poses: ten clips of poses that the shipped prior draws, one under a name that it held out."""
    prior = BodyPrior.open()
    z = torch.randn(200, prior.latent, generator=torch.Generator().manual_seed(0))
    turns = rotation.matrix_to_axis_angle(prior.decode_matrices(z)).flatten(1)
    poses = torch.cat((torch.zeros(200, 3), turns), dim=1).numpy()
    path = tmp_path_factory.mktemp("capture") / "poses.npz"
    names = np.array([json.loads(prior.metadata["card"])["held_out_clips"][0], *(f"clip{i}" for i in range(9))])
    np.savez(path, poses=poses, clip_starts=np.arange(0, 201, 20), clip_ids=names)
    return path


def rows(text: str, heading: str) -> list[list[str]]:
    """The cells of the first table whose heading starts with a word, without the heading."""
    lines = iter(text.splitlines())
    for line in lines:
        if line.startswith(f"| {heading}"):
            next(lines)
            break
    else:
        raise AssertionError(f"no table of '{heading}' in\n{text}")
    found = []
    for line in lines:
        if not line.startswith("|"):
            break
        found.append([cell.strip() for cell in line.strip("|").split("|")])
    return found


def few_pairs(folder: Path) -> list[str]:
    return [f"pairs.dir={folder}", "pairs.amortiser_steps=10", "pairs.shard_size=100", "pairs.fine_steps=3"]


def two_clips(folder: Path) -> list[str]:
    return [f"evaluation.motions=[{folder}]", "evaluation.validation=[wave]"]


def test_discovery(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    urdfs, discovery = ["--urdfs", tmp_path], importlib.import_module("discovery")
    monkeypatch.setattr(discovery, "STRANGE", ["clavicles of two joints", "one arm"])
    (tmp_path / "nothing.urdf").write_text("<robot name='a'><link name='b'/></robot>")
    text = run("discovery", "--robots", "reachy", "--seeds", "600-601", "--strange", "600-601", *urdfs)
    assert "| all " in text and "| clavicles " in text and "no body of the robot carries two limbs" in text
    assert len(re.findall(r"^\| reachy ", text, re.M)) == 6
    assert {row[0] for row in rows(text, "random humanoids, by part")} <= {"arms and head", "legs", "waist"}


def test_every_benchmark_has_a_test(root: Path) -> None:
    assert sorted(path.stem for path in (root / "benchmarks").glob("*.py")) == sorted(SCRIPTS + LIBRARIES)
    here = Path(__file__).read_text()
    assert all(f'run("{name}"' in here for name in SCRIPTS)


@pytest.fixture
def short_lbfgs(monkeypatch: pytest.MonkeyPatch) -> None:
    """The paper's solver stops early: its 500 iterations take seconds for a single pose too."""
    monkeypatch.setattr(lbfgs, "_ITERATIONS", 5)


@pytest.mark.usefixtures("short_lbfgs")
def test_pairing(run: Run, tmp_path: Path) -> None:
    sizes = ["--robots", "nao", "--poses", 5, "--parts", 20, "--reverse", 5, "--exhaustive", 10, "--pairs", 300]
    text = run("pairing", *sizes, *few_pairs(tmp_path))
    methods = [row[0] for row in rows(text, "method")]
    assert len(methods) == 6 and "fine (up to 3 steps)" in methods
    assert [row[0] for row in rows(text, "part")][-2] == "all of `fast`"
    assert [row[0] for row in rows(text, "reverse pairs")][1] == "4 starts (used)"
    assert [row[0] for row in rows(text, "`mrhubo.pair`")] == ["fast", "fine", "reverse"]


@pytest.mark.usefixtures("short_lbfgs")
def test_pair_pictures(run: Run, tmp_path: Path) -> None:
    options = ["--robots", "nao", "--poses", 8, "--out", tmp_path / "pictures"]
    text = run("pair_pictures", *options, *few_pairs(tmp_path))
    assert [row[:2] for row in rows(text, "robot")] == [["nao", solver] for solver in ("fine", "fast", "paper")]
    assert (tmp_path / "pictures" / "pairs_nao.png").stat().st_size > 10_000


def test_pair_quality(run: Run, tmp_path: Path, clips: Path) -> None:
    options = ["--robots", "nao", "--only", "not aligned", "--counts", "100,200,300", "--results", tmp_path / "results"]
    small = ["model.hidden=8", "trainer.max_steps=2", "trainer.batch_size=16", "trainer.validate_every=2"]
    settings = [*few_pairs(tmp_path), *two_clips(clips), *small, "trainer.accelerator=cpu"]
    text = run("pair_quality", *options, *settings)
    ((name, error),) = rows(text, "pairs")
    assert name == "fine, 200, linear, k 1, not aligned" and float(error) > 0
    assert run("pair_quality", *options, *settings) == text, "what is in the results is not trained again"


def test_prior(run: Run, tmp_path: Path, clips: Path, capture: Path) -> None:
    (tmp_path / "prior.yaml").write_text(f"data: {capture}\nmax_excess_deg: 180\n")
    text = run("prior", "--motions", clips, "--seconds", 0.01, "--config", tmp_path / "prior.yaml")
    assert all(row[1] and row[2] for row in rows(text, "measure") if "others' limbs" not in row[0])
    assert [row[0] for row in rows(text, "clip")] == ["boxing", "wave", "mean over clips"]
    assert [row[0] for row in rows(text, "joint")][:3] == ["hip", "spine1", "knee"]
    assert {"chest up", "upper arm", "forearm", "thigh", "shin", "foot up"} <= {
        row[0] for row in rows(text, "direction")
    }
    assert "poses/s decoded" in text


def test_prior_experiments(
    run: Run,
    tmp_path: Path,
    clips: Path,
    capture: Path,
    monkeypatch: pytest.MonkeyPatch,
    copied_database: Callable[..., None],
) -> None:
    monkeypatch.setattr("mlflow.store.db.utils._initialize_tables", copied_database)
    (tmp_path / "prior.yaml").write_text(f"data: {capture}\ntracking_dir: {tmp_path}\nmax_excess_deg: 180\n")
    small = ["steps=2", "batch_size=8", "hidden=8", "encoder_hidden=8", "held_out=0.2"]
    options = ["--config", tmp_path / "prior.yaml", "--only", "no noise", "--motions", clips]
    ((name, *cells),) = rows(run("prior_experiments", *options, *small), "variant")
    assert name == "no noise" and sum(float(cell) >= 0 for cell in cells if cell) >= len(cells) - 1


def test_reference(run: Run, clips: Path) -> None:
    text = run("reference", "--robots", "nao", *two_clips(clips))
    assert "## nao, 2 clips, " in text
    assert [row[0] for row in rows(text, "output")] == ["q", "q_cf, from q"]


def test_many_robots(run: Run, clips: Path, tmp_path: Path) -> None:
    picture, motion = tmp_path / "many.png", clips / "wave.npz"
    text = run("many_robots", "--robots", "nao", "--made", 1, "--motion", motion, "--out", picture)
    (name, *numbers), (made, *_) = rows(text, "robot")
    assert (name, made) == ("nao", "made 1") and picture.stat().st_size > 1000
    assert abs(float(numbers[1]) - float(numbers[2])) < 1


def test_whole_body(run: Run, clips: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engines, "numba_is_there", lambda: False)  # it would compile for half a minute
    text = run("whole_body", "--robots", "nao", "--clips", clips, "--rate", 30, "--ways", "motion,stream,fast",
               "--picture", tmp_path / "moments.png")  # fmt: skip
    found = rows(text, "clip")
    assert [row[0] for row in found] == ["boxing", "wave", "mean"] and "as a stream: 2 clips" in text
    assert (tmp_path / "moments.png").stat().st_size > 1000


def test_ablation(run: Run, clips: Path) -> None:
    found = rows(run("ablation", "--robots", "nao", "--clips", clips, "--rate", 12, "--parts", "2"), "without")
    assert [row[0] for row in found] == ["nothing", "2. flat feet", "limits of speed"]
    assert found[0][-1] == "1.00" and float(found[0][9]) <= 1.01


def test_on_the_floor(run: Run) -> None:
    found = rows(run("on_the_floor", "--robots", "nao", "--postures", "all fours", "--rate", 8), "posture")
    assert [row[:2] for row in found] == [["all fours", "bends and is lifted"], ["", "neither"]]
    assert float(found[0][2]) == 0.0 and float(found[1][2]) > 1


def test_headings(run: Run, clips: Path) -> None:
    text = run("headings", "--robots", "nao", "--clips", clips, "--headings", 2, "--seconds", 0.2)
    found = rows(text, "robot")
    assert [row[1:3] for row in found] == [[clip, way] for clip in ("boxing", "wave") for way in ("motion", "stream")]
    assert all(float(row[3]) < 1 and row[-1] == "0 of 2" for row in found)


def test_physics(run: Run, clips: Path, tmp_path: Path) -> None:
    """A robot that weighs something: what the floor has to do is to hold its weight."""
    urdf = write_urdf(tmp_path / "walker.urdf")
    inertia = (
        '<inertial><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    weighing = re.sub(r'(<link name="[^"]*">)', rf"\1{inertia}", urdf.read_text())
    urdf.write_text(weighing.replace('effort="1"', 'effort="300"'))
    joints = re.findall(r'<joint name="([^"]*)"', urdf.read_text())
    config = {"name": "walker", "urdf": str(urdf), "joints": joints, "keypoints": entries(), "key_links": ["l_foot"]}
    (tmp_path / "walker.yaml").write_text(json.dumps({"robot": config}))
    text = run("physics", "--robots", tmp_path / "walker.yaml", "--clips", clips, "--own", "wave", "--rate", 12)
    found = rows(text, "clip")
    assert [row[0] for row in found] == ["boxing", "wave", "mean"]
    assert all(float(row[1]) < 0.1 and abs(float(row[2]) - 1) < 0.1 and row[4] == "0.0%" for row in found)
    ((_, stands, whole),) = rows(text, "motion")
    assert 0 < float(stands) <= float(whole)
    with pytest.raises(SystemExit, match="tells no masses"):
        run("physics", "--robots", "nao", "--clips", clips)


def test_universal(run: Run, clips: Path, tmp_path: Path) -> None:
    sizes = ["--every", 12, "--made", 1, "--frames", 2]
    text = run("universal", "--robots", "nao,coman", "--clips", clips, "--urdfs", tmp_path, *sizes)
    found = rows(text, "robot")
    assert [row[0] for row in found] == ["nao", "nao", "coman", "coman"]
    assert all(float(row[4]) < 1 for row in found), "degrees over the optimum"
    assert "1 random humanoids, 2 frames each; 0 more were refused" in text


def test_universal_speed(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    speed = importlib.import_module("universal_speed")
    monkeypatch.setattr(speed, "forms_here", lambda: ("numpy",))  # numba would compile for half a minute
    found = rows(run("universal_speed", "--robots", "nao", "--batch", 3, "--rounds", 1), "robot")
    assert [row[2] for row in found] == ["PyTorch", "numpy"] and all(float(row[5]) < 1e-3 for row in found)


def test_without_training(run: Run, clips: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = importlib.import_module("without_training")
    monkeypatch.setattr(module, "CLIPS", clips)
    monkeypatch.setattr(importlib.import_module("files"), "_SECONDS", 0.2)
    found = rows(run("without_training", "--robots", "nao", "--clips", 1), "robot")
    assert [row[1] for row in found] == ["universal", "reference"] and all(float(row[3]) < 1 for row in found)


@pytest.fixture(scope="module")
def package(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A retargeter that has learned nothing."""
    config = load_config(root / "conf" / "nao.yaml", ["model.hidden=8"])
    body_map = build_body_map(config.robot)
    torch.manual_seed(0)
    made = Retargeter(build_network(config, body_map), body_map, BodyPrior.open(), config, phi_threshold=0.01)
    return made.save(tmp_path_factory.mktemp("package"), {"run_id": "abc"})


def test_confidence(run: Run, package: Path, clips: Path, tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    shutil.copy(clips / "wave.npz", tmp_path / "one")
    text = run("confidence", package, "--motions", tmp_path / "one", "--frames", 4, "--picture", tmp_path / "a.png")
    ((_, _, error, *_), *others) = rows(text, "  ")
    assert len(others) == 13 and 0 <= float(error) < 60
    areas = {row[0].split(",")[0].split(" ")[0]: float(row[1]) for row in rows(text, "told apart")}
    assert areas["elbows"] > 0.8 and (tmp_path / "a.png").stat().st_size > 10_000


def test_retarget(run: Run, package: Path) -> None:
    ((_, one, twenty),) = rows(run("retarget", package, "--frames", "1,20", "--rounds", 2), "commit")
    assert 0 < float(one.split()[0]) < 1_000 and 0 < float(twenty.split()[0]) < 1_000


def test_inference(run: Run, package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In NumPy's form; others need packages and time, and PyTorch takes seconds to start."""
    inference = importlib.import_module("inference")
    start = inference.start
    monkeypatch.setattr(inference, "_WARM_UP", 1)
    monkeypatch.setattr(inference, "there", lambda *names: False)
    monkeypatch.setattr(
        inference, "start", lambda package, form: start(package, form) if form == "numpy" else [form, "9", "9", "yes"]
    )
    text = run("inference", "--batch", 10, "--rounds", 2, "--frames", 4, package)
    assert {row[0] for row in rows(text, "form")} >= {"PyTorch", "numpy"}
    assert re.search(r"^\| numpy +\| \d+\.\d+ +\| \d+ +\| no +\|$", text, re.M), text
    over = {(row[0], row[1].removesuffix(" (numpy)")): float(row[4]) for row in rows(text, "motion")}
    assert over["wide", "10 steps"] < over["wide", "1 step"] < over["wide", "network"]
    assert "left out: mink: is not installed" in text and "left out: closed form of seven-joint arms: no arm" in text


def test_camera(run: Run, clips: Path) -> None:
    needs_models()
    text = run("camera", "--motions", clips, "--seconds", 0.12, "--views", "0,45", "--models", "lite", "--size", 240)
    found = {row[0]: [float(cell) for cell in row[1:]] for row in rows(text, "model")}
    assert found["drawn"][:7] == [0] * 7 and found["lite"][5] < 45
    assert found["true points"][5] < found["lite"][5] and found["lite, smoothed"][7] < found["lite"][7]
    assert re.search(r"^\| lite +\| \d+\.\d +\| \d+\.\d +\|$", text, re.M), text


def test_missing_points(run: Run, root: Path, tmp_path: Path) -> None:
    shutil.copy(root / "data" / "motions" / "wave.npz", tmp_path)
    text = run("missing_points", "--motions", tmp_path, "--gaps", 1, "--rate", 4)
    found = {row[0]: [float(cell) for cell in row[1:]] for row in rows(text, "filled in by")}
    assert len(found) == 9 and found["body prior, nothing away"][1] < 10 < found["hanging"][1]
    assert found["body prior, wrist away"][0] < 10 and found["forearm in line"][0] == pytest.approx(0, abs=0.1)


def test_polish(run: Run, package: Path, tmp_path: Path) -> None:
    np.savez(tmp_path / "poses.npz", poses=0.3 * np.random.default_rng(0).standard_normal((40, 66)))
    found = rows(run("polish", package, tmp_path / "poses.npz", "--every", 2), "steps")
    assert [row[0] for row in found] == ["0", "1", "3", "10"]
    excess = [float(row[1]) for row in found]
    assert excess[0] > 1 > excess[-1] > -1


def test_retarget_compares_two_checkouts(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Processes that claim known times stand in for those that retarget: the other checkout's is half of ours."""
    retarget = importlib.import_module("retarget")

    @contextmanager
    def claims(checkout: Path, package: Path) -> Iterator[subprocess.Popen[str]]:
        factor = 1 if checkout == tmp_path else 2
        code = f"import sys\nfor line in sys.stdin: print(0.001 * {factor} * int(line), flush=True)"
        process = subprocess.Popen([sys.executable, "-c", code], stdin=PIPE, stdout=PIPE, text=True, bufsize=1)
        yield process
        process.communicate()

    monkeypatch.setattr(retarget, "server", claims)
    text = run("retarget", tmp_path, "--against", tmp_path, "--frames", "1,20", "--rounds", 5)
    ours, other, ratio = rows(text, "commit")
    assert ours[1:] == ["2.000 (2.000 to 2.000)", "40.000 (40.000 to 40.000)"] and other[1].startswith("1.000 ")
    assert ratio == ["first over second", "2.000", "2.000"]


def test_scaling(run: Run, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The commands run in this process, one rank each, as starting a dozen would take a minute; of a fit's, whose
    parts other tests run, it is only checked that its file and keys exist.
    """
    scaling = importlib.import_module("scaling")
    commands = []

    def run_here(arguments: list[str]) -> float:
        start = len(arguments) - 1 - arguments[::-1].index("-m")
        command, (flag, config, *rest) = arguments[start + 1], arguments[start + 2 :]
        commands.append(command)
        if command == "mrhubo.pair":
            pair.main([*arguments[start + 2 :], "pairs.workers=1"])
        else:
            assert flag == "--config"
            load_config(root / config, [argument for argument in rest if "=" in argument])
        return float(len(commands))

    monkeypatch.setattr(scaling, "run", lambda arguments: run_here(list(arguments)))
    small = ["pairs.amortiser_steps=10", "pairs.shard_size=100", "pairs.fine_steps=3"]
    text = run("scaling", "--pairs", 200, "--steps", 5, "--torchrun", "2", *small)
    assert commands == ["mrhubo.pair"] * 4 + ["mrhubo.fit"] * 5
    assert len(rows(text, "pairs")) == 3 and "the same bytes: yes" in text
    assert [row[0] for row in rows(text, "training")] == ["one process", "torchrun, 2 processes"]


def test_scaling_starts_commands_and_says_what_failed() -> None:
    scaling = importlib.import_module("scaling")
    assert 0 < scaling.run(["-c", "pass"]) < 60
    with pytest.raises(SystemExit, match="no luck"):
        scaling.run(["-c", "raise ValueError('no luck')"])


def test_stream(run: Run, package: Path, clips: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stream = importlib.import_module("stream")
    monkeypatch.setattr(stream, "forms_here", lambda: ("numpy",))  # numba would compile for half a minute
    monkeypatch.setattr(stream, "_HANGING_S", 3.0)
    text = run("stream", package, "--motions", clips, "--rate", 10, "--seconds", 0.01)
    assert len(rows(text, "a frame alone")) == 4 + 2
    found = rows(text, "motion")
    assert [row[1] for row in found[:3]] == ["networks", "`retarget`", "stream"]
    assert all(row[4] == "0" and row[5] == "0.0%" for row in found if row[1] == "stream")


def test_live(run: Run, package: Path, clips: Path) -> None:
    sizes = ["--frames", 10, "--minutes", 1, "--form", "numpy"]
    live = importlib.import_module("live")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(live, "_RATE", 30.0)
        patch.setattr(live, "_MINUTE", 2.0)
        text = run("live", package, "--motion", clips / "wave.npz", *sizes)
    times = rows(text, "time")
    assert [row[0] for row in times] == ["the clock's", "the thread's own", "least of 5 passes"]
    assert all(float(least) <= float(own) for least, own in zip(times[2][1:], times[1][1:], strict=True))
    (minute,) = rows(text, "minute")
    assert minute[-1] == "0" and "malformed" in text


def test_continuity(run: Run, package: Path, clips: Path) -> None:
    text = run("continuity", package, "--motions", clips)
    found = rows(text, "motion")
    names = ["frame by frame", "whole motions", "stream"]
    assert [row[:2] for row in found] == [[motion, name] for motion in ("boxing", "wave") for name in names]
    assert all(row[3] == "0" and row[4] == "0.00%" for row in found if row[1] != "frame by frame")
    for name, of, jerk, *_ in rows(text, "answers"):
        jerks = [float(row[2]) for row in found if row[1] == name]
        assert float(jerk) == pytest.approx(max(jerks) if of == "highest" else sum(jerks) / 2, abs=0.011)


def test_imitation(run: Run, package: Path, clips: Path) -> None:
    found = rows(run("imitation", package, "--motions", clips), "the networks")
    assert [row[0] for row in found] == [
        "the reference", "the reference without speed limits", "each frame's own optimum",
    ]  # fmt: skip
    assert all(0 < float(number) < 100 for row in found for number in row[1:])


def test_files(run: Run, package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = importlib.import_module("files")
    monkeypatch.setattr(files, "_SECONDS", 1)
    monkeypatch.setattr(files, "numba_is_there", lambda: False)  # it would compile for a minute
    found = rows(run("files", package, "--rounds", 1), "file")
    assert [row[3] for row in found] == ["PyTorch", "NumPy"]
    assert all(float(row[4]) > 0 for row in found)


def test_show(run: Run) -> None:
    found = rows(run("show", "--robots", "nao", "--frames", 3), "file")
    assert [row[:2] for row in found] == [[".html", "3"], [".mp4", "3"], [".gif", "3"], [".png", "3"]]
    assert all(float(value) > 0 for row in found for value in row[2:4])


def test_collisions(run: Run, package: Path, clips: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.import_module("collisions"), "forms_here", lambda: ("numpy",))  # as in `stream`
    text = run("collisions", package, "--motions", clips, "--rate", 10, "--rounds", 2, "--random", 300)
    found = rows(text, "answers of")
    assert [row[:2] for row in found[::2]] == [[name, "no"] for name in ("frames", "whole motions", "streams")]
    assert all(row[4] == "0" and row[5] == "0.00%" for row in found[2:])
    assert [row[1] for row in rows(text, "form")[:2]] == ["stay", "give way"]


def test_training(run: Run) -> None:
    text = run("training", "--steps", 2, "--pairs", 64, "--repeats", 1, "trainer.batch_size=16", "model.hidden=8")
    assert [row[0] for row in rows(text, "loop")] == ["bare loop", "Trainer", "Trainer + MLflow"]
