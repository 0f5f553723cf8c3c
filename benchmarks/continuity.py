"""How evenly the robot moves where the human does: each motion frame by frame, as a whole, and as a stream.

    python benchmarks/continuity.py PACKAGE [--motions data/motions,data/motions/straight_arms] [--touching no]

PACKAGE is the folder of a trained retargeter. Columns: jerk of the robot's directions over that of the human's (1 is as
even as the human); jumps (steps over 0.5 rad per 1/24 s that the human did not make); share of the steps in which a
joint turns faster than it can; the highest speed of a joint; and the angle of limbs, hands and head to the human over
that of each frame's own optimum (`solve_frames`). With --touching yes the robot may touch itself, so that this angle is
not that of giving way. Then, for each way of answering, the highest and the mean of all motions.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import torch
from common import print_header, print_table, read_options
from stream import measures
from torch import Tensor

import mrhubo
from mrhubo.motion import Motion, read_folder
from mrhubo.reference import OptimizationRetargeter
from mrhubo.retargeter import Retargeter
from mrhubo.streaming import Stream, StreamSettings

OWN = "data/motions,data/motions/straight_arms"
_FORM = "{:.2f} {:.0f} {:.2%} {:.1f} {:.2f}"


def ways(retargeter: Retargeter, avoid: bool) -> dict[str, Callable[[Motion], Tensor]]:
    """By name: joint angles (T, N) [rad] of a motion."""
    stream = Stream(retargeter, settings=StreamSettings(avoid_collisions=avoid))
    return {
        "frame by frame": lambda m: retargeter(m, together=False, avoid_collisions=avoid).q,
        "whole motions": lambda m: retargeter(m, avoid_collisions=avoid).q,
        "stream": lambda m: stream.retarget(m).q,
    }


@torch.no_grad()
def main(argv: list[str]) -> None:
    """Prints the tables."""
    options, rest = read_options(argv, motions=OWN, touching="no")
    if len(rest) != 1 or not Path(rest[0]).is_dir() or options["touching"] not in ("yes", "no"):
        sys.exit("usage: python benchmarks/continuity.py [--motions FOLDER,FOLDER] [--touching yes|no] PACKAGE")
    print_header()
    retargeter = mrhubo.load(rest[0])
    reference = OptimizationRetargeter(retargeter.body_map)
    motions = [motion for folder in options["motions"].split(",") for motion in read_folder(Path(folder))]
    rows: list[list[str]] = []
    found: dict[str, list[tuple[float, ...]]] = {}
    for motion in motions:
        best_TN, _ = reference.solve_frames(motion.local_TJ33)
        best_T = retargeter.judge(best_TN, motion.local_TJ33).direction_error_deg.mean(dim=1)
        for name, answer in ways(retargeter, options["touching"] == "no").items():
            _, over, jumps, fast, fastest, jerk, _ = measures(retargeter, motion, answer(motion), best_T)
            found.setdefault(name, []).append((jerk, jumps, fast, fastest, over))
            rows.append([motion.name, name, *_FORM.format(*found[name][-1]).split()])
    heads = ["jerk", "jumps", "too fast", "fastest [rad/s]", "over optimum [deg]"]
    print_table(["motion", "answers", *heads], rows)
    print()
    rows = []
    for name, values in found.items():
        all_MX = torch.tensor(values)
        for of, value_X in (("highest", all_MX.amax(dim=0)), ("mean", all_MX.mean(dim=0))):
            rows.append([name, of, *_FORM.format(*value_X.tolist()).split()])
    print_table(["answers", "of all", *heads], rows)


if __name__ == "__main__":
    main(sys.argv[1:])
