"""How long `mrhubo retarget` takes for a minute of motion, from its start to the file on disk.

    python benchmarks/files.py [--rounds N] PACKAGE [MOTION ...]

PACKAGE is the folder of a trained retargeter. Besides a minute of the motions that ship, as AMASS's .npz at 60 frames a
second, each MOTION is a file that `mrhubo retarget` reads, BVH at 120 frames a second for instance. Each file is
answered in a new process: by PyTorch (with a copy of the package that lacks `runtime.safetensors`), in NumPy, and,
where numba is there, as the command chooses once numba has kept what it compiled. Seconds are the best of the rounds,
on the clock and of the processor.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from common import print_header, print_table, read_options

import mrhubo
from mrhubo.fast.description import FILE
from mrhubo.fast.kept import numba_is_there
from mrhubo.fast.rotations import matrix_to_axis_angle
from mrhubo.motion import Motion, read_motion, write_motion
from mrhubo.runtime.locations import project_root

_SECONDS = 60.0


def minute(out: Path) -> Path:
    """A minute of the motions that ship, one after the other."""
    motions = [read_motion(path) for path in sorted((project_root() / "data" / "motions").glob("*.npz"))]
    rate = motions[0].frame_rate
    local_TJ33 = np.concatenate([motion.arrays.local_TJ33 for motion in motions if motion.frame_rate == rate])
    pose_T63 = matrix_to_axis_angle(local_TJ33[: round(_SECONDS * rate)]).reshape(-1, 63)
    still_T3 = np.zeros((len(pose_T63), 3))
    write_motion(out, pose_T63, still_T3, still_T3, rate, "a minute of the motions that ship")
    return out


def once(package: Path, motion: Path, out: Path, environment: Mapping[str, str]) -> tuple[float, float]:
    """Seconds of one command, on the clock and of the processor."""
    command = [sys.executable, "-m", "mrhubo", "retarget", "--retargeter", str(package), "--motion", str(motion)]
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run([*command, "--out", str(out)], env=environment, capture_output=True, text=True)
    taken, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise SystemExit(done.stderr)
    return taken, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def figures(package: Path, motion: Path, out: Path, rounds: int, environment: Mapping[str, str]) -> list[str]:
    """The best of some commands."""
    runs = [once(package, motion, out, environment) for _ in range(rounds)]
    return [f"{min(seconds):.2f}" for seconds in zip(*runs, strict=True)]


def ways(package: Path, folder: Path) -> dict[str, tuple[Path, dict[str, str]]]:
    """Packages and environments by who answers."""
    environment = {**os.environ, "PYTHONPATH": str(project_root())}
    bare = shutil.copytree(package, folder / "bare" / package.name)
    (bare / FILE).unlink(missing_ok=True)
    unknown = {**environment, "XDG_CACHE_HOME": str(folder / "cache")}  # where no note says that numba has compiled
    found = {"PyTorch": (bare, environment), "NumPy": (package, unknown)}
    if numba_is_there():
        compile_all(package)
        found["compiled"] = (package, environment)
    return found


def compile_all(package: Path) -> None:
    """Lets numba compile, and note that it did."""
    poses = np.tile(np.eye(3, dtype=np.float32), (100, 21, 1, 1))
    mrhubo.load_fast(package, "compiled")(Motion.of(name="still", local_TJ33=poses, frame_rate=60.0))


def rows(package: Path, files: Sequence[Path], rounds: int) -> list[list[str]]:
    """A row a file and way."""
    found = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for motion in (minute(folder / "minute.npz"), *files):
            read = read_motion(motion)
            told = [motion.name, f"{len(read):,}", f"{read.frame_rate:g}"]
            for way, (of, environment) in ways(package, folder / str(len(found))).items():
                found.append([*told, way, *figures(of, motion, folder / "out.npz", rounds, environment)])
    return found


def main(argv: list[str]) -> None:
    """Prints the table."""
    options, rest = read_options(argv, rounds="3")
    if not rest or not Path(rest[0]).is_dir():
        sys.exit("usage: python benchmarks/files.py [--rounds N] PACKAGE [MOTION ...]")
    print_header()
    table = rows(Path(rest[0]).resolve(), [Path(name) for name in rest[1:]], max(1, int(options["rounds"])))
    print_table(["file", "frames", "per second", "by", "start to file [s]", "processor [s]"], table)


if __name__ == "__main__":
    main(sys.argv[1:])
