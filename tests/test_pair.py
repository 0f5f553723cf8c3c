"""`mrhubo.pair` as a user runs it, and as fate treats it: killed, out of disk, run twice, by workers, by ranks."""

from __future__ import annotations

import os
import random
import resource
import signal
import subprocess
import time
from multiprocessing.context import ForkServerContext
from pathlib import Path

import pytest
import torch
from PIL import Image

from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.files.storage import remove_leftovers, write_tensors
from mrhubo.fitting.preparation import prepare_pairs
from mrhubo.pair import main
from mrhubo.pairing import PairStore, workers
from mrhubo.pairing.verify import check_shard
from tests.chain import as_command, as_torchrun, killed_at

pytestmark = pytest.mark.usefixtures("light_pairs")

SMALL = [
    "pairs.solver=fine", "pairs.count=900", "pairs.reverse_share=0.5", "pairs.shard_size=150", "pairs.amortiser_steps=10", "pairs.fine_steps=4",
]  # fmt: skip


def arguments(root: Path, folder: Path, *more: str) -> list[str]:
    config = str(root / "conf" / "nao.yaml")
    return ["--config", config, "--quiet", "trainer.accelerator=cpu", *SMALL, f"pairs.dir={folder}", *more]


def store_of(root: Path, folder: Path, *more: str) -> PairStore:
    given = [a for a in arguments(root, folder, *more) if "=" in a]
    return prepare_pairs(load_config(root / "conf" / "nao.yaml", given)).store


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of the only store in a folder, hidden ones included."""
    (store,) = folder.iterdir()
    return {path.name: path.read_bytes() for path in sorted(store.iterdir())}


@pytest.fixture(scope="module")
def undisturbed(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pairs")
    main(arguments(root, folder))
    return folder


@pytest.fixture
def spoilt(root: Path, undisturbed: Path, tmp_path: Path) -> PairStore:
    """A copy to damage."""
    (source,) = undisturbed.iterdir()
    store = store_of(root, tmp_path)
    store.folder.mkdir(parents=True)
    for path in source.iterdir():
        (store.folder / path.name).write_bytes(path.read_bytes())
    return store


def test_pairs_are_made_summed_up_and_found_again(
    root: Path, tmp_path: Path, undisturbed: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(arguments(root, tmp_path))
    first = capsys.readouterr().out
    assert (
        "450 pairs from robot poses" in first
        and "450 pairs from human poses" in first
        and "the filter keeps" in first
        and "made 900 pairs" in first
    )
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.safetensors")}
    main(arguments(root, tmp_path))
    assert "made nothing: all were there" in capsys.readouterr().out
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.safetensors")} == before
    assert contents(tmp_path) == contents(undisturbed)
    main(arguments(root, tmp_path, "--verify"))
    assert "all 6 shards are whole" in capsys.readouterr().out


def test_inspect_prints_a_summary_and_draws_a_picture(
    root: Path, spoilt: PairStore, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(arguments(root, tmp_path, "--inspect"))
    output = capsys.readouterr().out
    pairs = spoilt.read_all()
    for reverse in (False, True):
        assert f"{1000 * float(pairs['residual_m'][pairs['reverse'] == reverse].mean()):.3g}" in output
    assert "picture:" in output
    picture = Image.open(spoilt.folder / "pairs.png")
    assert picture.width > 800 and len(picture.getcolors(1 << 24)) > 100
    main(arguments(root, tmp_path, "--verify"))  # the picture disturbs nothing


def test_nothing_there_is_said(root: Path, tmp_path: Path) -> None:
    for flag in ("--verify", "--inspect"):
        with pytest.raises(UserError, match=f"without {flag} to make"):
            main(arguments(root, tmp_path, flag))
    with pytest.raises(UserError, match="does not go together"):
        main(arguments(root, tmp_path, "--verify", "--inspect"))
    assert not list(tmp_path.iterdir())


def alter(store: PairStore, damage: str) -> None:
    """Damages shard 2; what lies inside a tensor is written with a checksum that fits."""
    path = store.path(2)
    content = bytearray(path.read_bytes())
    if damage == "missing":
        path.unlink()
    elif damage == "truncated":
        path.write_bytes(content[:-100])
    elif damage == "a flipped bit":
        content[-333] ^= 16
        path.write_bytes(content)
    elif damage == "another shard":
        path.write_bytes(store.path(3).read_bytes())
    else:
        pairs = store.read(2)
        header = store.header_of(2)
        if damage == "outside the limits":
            pairs["q"][7, 0] = 9.0
        elif damage == "wrong kinematics":
            pairs["R"][7] = pairs["R"][8]
        elif damage == "no rotation":
            pairs["H"][7, 3] *= 1.01
        elif damage == "nan":
            pairs["phi"][7] = torch.nan
        elif damage == "negative":
            pairs["phi"][7] = -1.0
        else:
            header["seed"] = "5"
        write_tensors(path, pairs, header)


DAMAGES = {
    "missing": "is missing", "truncated": "safetensors", "a flipped bit": "checksum", "another shard": "other settings",
    "outside the limits": "1 pairs leave the joint limits", "wrong kinematics": "link orientations",
    "no rotation": "no rotations", "nan": "NaN", "negative": "negative", "another seed": "other settings",
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGES)
def test_verify_names_a_bad_shard(root: Path, spoilt: PairStore, tmp_path: Path, damage: str) -> None:
    alter(spoilt, damage)
    with pytest.raises(UserError, match=f"forward-000002.*{DAMAGES[damage]}.*without --verify"):
        main(arguments(root, tmp_path, "--verify"))
    robot = prepare_pairs(load_config(root / "conf" / "nao.yaml", [f"pairs.dir={tmp_path}"])).body_map.robot
    assert check_shard(spoilt, robot, 1) is None


@pytest.mark.parametrize("damage", ["missing", "truncated", "a flipped bit", "another shard", "nan", "another seed"])
def test_a_bad_shard_is_made_again(
    root: Path, spoilt: PairStore, tmp_path: Path, undisturbed: Path, damage: str
) -> None:
    alter(spoilt, damage)
    main(arguments(root, tmp_path))
    assert contents(tmp_path) == contents(undisturbed)


@pytest.mark.parametrize("damage", ["truncated", "a flipped bit", "another seed", "missing"])
def test_a_bad_amortiser_is_trained_again(
    root: Path, spoilt: PairStore, tmp_path: Path, undisturbed: Path, damage: str
) -> None:
    path = spoilt.amortiser_path
    content = bytearray(path.read_bytes())
    if damage == "missing":
        path.unlink()
    elif damage == "truncated":
        path.write_bytes(content[: len(content) // 2])
    elif damage == "a flipped bit":
        content[-5000] ^= 1
        path.write_bytes(content)
    else:
        other = tmp_path / "other"
        main(arguments(root, other, "pairs.seed=5", "pairs.count=100"))
        path.write_bytes(next(other.rglob("amortiser.safetensors")).read_bytes())
        next(other.iterdir()).rename(tmp_path / "away")
        (tmp_path / "away").rename(tmp_path.parent / f"{tmp_path.name}-away")
        other.rmdir()
    spoilt.path(1).unlink()
    main(arguments(root, tmp_path))
    assert contents(tmp_path) == contents(undisturbed)


def test_killed_at_many_moments_it_ends_with_the_same_bytes(
    root: Path, tmp_path: Path, undisturbed: Path, server: ForkServerContext
) -> None:
    """Some between two things that it does to its files, some at any time."""
    draw, stopped = random.Random(0), {True: 0, False: 0}
    given = arguments(root, tmp_path)
    for turn in range(100):
        at_files = turn % 3 > 0
        event = draw.randrange(1, 16) if at_files else 10**9
        process = server.Process(target=killed_at, args=(event, tmp_path, main, given))
        process.start()
        process.join(60 if at_files else draw.uniform(0.0, 0.5))
        process.kill()
        process.join()
        assert process.exitcode in (0, -signal.SIGKILL)
        stopped[at_files] += process.exitcode != 0
        if process.exitcode == 0:  # begin again
            for path in tmp_path.rglob("*.safetensors"):
                path.unlink()
        if stopped[True] >= 8 and stopped[False] >= 4:
            break
    assert stopped[True] >= 8 and stopped[False] >= 4
    main(given)
    assert store_of(root, tmp_path).missing() == []
    assert contents(tmp_path) == contents(undisturbed)


def test_two_processes_on_one_folder_do_not_disturb_each_other(
    root: Path, tmp_path: Path, undisturbed: Path, server: ForkServerContext
) -> None:
    given, folder = arguments(root, tmp_path / "pairs"), tmp_path / "pairs"
    both = [server.Process(target=as_command, args=("pair", given, tmp_path / f"{i}", {})) for i in range(2)]
    for process in both:
        process.start()
    for process in both:
        process.join(120)
    assert [process.exitcode for process in both] == [0, 0]
    assert contents(folder) == contents(undisturbed)


def test_a_full_disk_ends_in_one_sentence_and_no_broken_file(
    root: Path, tmp_path: Path, server: ForkServerContext
) -> None:
    output, folder = tmp_path / "output", tmp_path / "pairs"
    large = arguments(root, folder, "pairs.solver=fast", "pairs.shard_size=5000", "pairs.count=5000")
    limit = 3_500_000  # the amortiser fits, the shard of 4 MB does not
    process = server.Process(target=as_command, args=("pair", large, output, {}, limit))
    process.start()
    process.join(120)
    said = output.read_text()
    assert process.exitcode == 2, said
    assert said.count("\n") == 1 and "cannot be written: File too large" in said
    (store,) = folder.iterdir()
    assert [path.name for path in store.iterdir()] == ["amortiser.safetensors"]


def test_workers_make_the_same_bytes(
    root: Path, tmp_path: Path, undisturbed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(workers, "_MIN_PAIRS_PER_WORKER", 150)
    started = []
    popen = subprocess.Popen
    monkeypatch.setattr(workers.subprocess, "Popen", lambda *a, **k: started.append(popen(*a, **k)) or started[-1])
    folder = tmp_path / "not ${an} interpolation"  # the config reaches the workers as it is
    main(arguments(root, Path(str(folder).replace("$", "\\$")), "pairs.workers=2"))
    assert len(started) == 2 and all(process.poll() is not None for process in started)
    assert contents(folder) == contents(undisturbed)


def test_a_worker_that_cannot_write_says_why(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spoilt: PairStore
) -> None:
    monkeypatch.setattr(workers, "_MIN_PAIRS_PER_WORKER", 150)
    for index in (0, 1):
        spoilt.path(index).unlink()
    popen = subprocess.Popen
    limited = lambda *a, **k: popen(  # noqa: E731
        *a, **k, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))
    )
    monkeypatch.setattr(workers.subprocess, "Popen", limited)
    with pytest.raises(UserError, match="cannot be written: File too large"):
        main(arguments(root, tmp_path, "pairs.workers=2"))
    assert spoilt.missing() == [0, 1] and not list(spoilt.folder.glob(".*"))


def test_ranks_share_the_work_and_a_dead_ranks_part(
    root: Path,
    tmp_path: Path,
    spoilt: PairStore,
    undisturbed: Path,
    server: ForkServerContext,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    for index in (1, 3):  # the part of rank 1 of 2
        spoilt.path(index).unlink()
    given = ["--nproc-per-node", "2", "-m", "mrhubo.pair", *[a for a in arguments(root, tmp_path) if a != "--quiet"]]
    before, output = time.time(), tmp_path_factory.mktemp("torchrun") / "output"
    process = server.Process(target=as_torchrun, args=(given, output, {"LOGLEVEL": "ERROR"}))
    process.start()
    process.join(200)
    said = output.read_text()
    assert process.exitcode == 0, said
    assert said.count("made 300 pairs") == 1, "one rank reports, for all"
    assert "pairs: 150 of 150" in said, "each rank made one of the two"
    assert contents(tmp_path) == contents(undisturbed)
    assert sum(path.stat().st_mtime > before for path in spoilt.folder.glob("*-0*")) == 2


def test_leftovers_of_the_dead_are_removed_and_no_others(tmp_path: Path) -> None:
    ended = subprocess.Popen(["true"])
    ended.wait()
    host = os.uname().nodename
    dead, alive = tmp_path / f".a.safetensors.{host}.{ended.pid}.tmp", tmp_path / f".b.{host}.{os.getppid()}.tmp"
    elsewhere, other = tmp_path / f".c.elsewhere.{ended.pid}.tmp", tmp_path / f".d.{host}.notes.tmp"
    for path in (dead, alive, elsewhere, other):
        path.write_text("x")
    remove_leftovers(tmp_path)
    assert not dead.exists() and alive.exists() and elsewhere.exists() and other.exists()
