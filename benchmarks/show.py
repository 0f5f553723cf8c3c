"""How long what `mrhubo show` saves takes: a page, a film, a GIF and a sheet of a person and robots side by side.

    python benchmarks/show.py [--robots nao,coman] [--frames 100] [--motion data/motions/boxing.npz]

Frames are the first of the motion, 30 a second, in GIFs 15, as many as these keep. Robots sweep the ranges of their
joints, so that no answer's time is in it: what is measured is all that comes after the answer, from figures to the file
on disk, in one process. Two columns have seconds on the clock and of the processor; loading viser, PyAV and the painter
is not in them.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from common import print_header, print_table, read_options

from mrhubo.motion import Motion, read_motion, resample, trim
from mrhubo.robot import Robot
from mrhubo.robot_motion import RobotMotion
from mrhubo.runtime.locations import project_root
from mrhubo.viewer import arrange, perform, read_person
from mrhubo.viewer.page import save_page
from mrhubo.viewer.pictures import FILM_RATE, GIF_RATE, save_pictures

_RATES = {"html": FILM_RATE, "mp4": FILM_RATE, "gif": GIF_RATE, "png": FILM_RATE}
"""Kinds of files, and their frames a second."""


def sweep(robot: Robot, frames: int, rate: float) -> RobotMotion:
    """Joints go to and fro in their ranges, each at a pace of its own."""
    share_TN = 0.5 + 0.4 * np.sin(np.outer(np.arange(frames) / rate, 1.0 + np.arange(len(robot.joint_names)) % 5))
    lower_N, upper_N = robot.lower_N.numpy(), robot.upper_N.numpy()
    return RobotMotion(lower_N + share_TN * (upper_N - lower_N), robot.joint_names, rate)


def once(motion: Motion, robots: list[Robot], out: Path) -> list[str]:
    """The row of one file."""
    begun, worked = time.perf_counter(), time.process_time()
    frames, rate = len(motion), motion.frame_rate
    stage = arrange(read_person(motion), [perform(robot.name, robot, sweep(robot, frames, rate)) for robot in robots])
    if out.suffix == ".html":
        save_page(stage, out, "benchmark")
        written = stage.frames
    else:
        written = save_pictures(stage, out, "benchmark")
    seconds = time.perf_counter() - begun, time.process_time() - worked
    return [out.suffix, str(written), *(f"{value:.2f}" for value in seconds), f"{out.stat().st_size / 1e6:.2f}"]


def main(argv: list[str]) -> None:
    """Prints the table."""
    given = {"robots": "nao,coman", "frames": "100", "motion": "data/motions/boxing.npz"}
    options, rest = read_options(argv, **given)
    if rest or not options["frames"].isdecimal() or int(options["frames"]) < 2:
        sys.exit("usage: python benchmarks/show.py [--robots nao,coman] [--frames 100] [--motion FILE]")
    print_header()
    motion = read_motion(project_root() / options["motion"])
    robots = [Robot.from_config(name) for name in options["robots"].split(",")]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for kind, rate in _RATES.items():
            shown, place = resample(motion, rate), Path(folder) / f"a.{kind}"
            once(trim(shown, 0.0, 1.0 / rate), robots[:1], place)  # loads what it needs
            rows.append(once(trim(shown, 0.0, (int(options["frames"]) - 1) / rate), robots, place))
    print_table(["file", "frames", "[s]", "processor [s]", "MB"], rows)


if __name__ == "__main__":
    main(sys.argv[1:])
