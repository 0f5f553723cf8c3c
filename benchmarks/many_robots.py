"""One motion on several robots by the universal network, which was trained on none of them: a picture, and how near.

    python benchmarks/many_robots.py [--motion data/motions/directing_traffic.npz] [--robots nao,coman,reachy]
        [--urdfs DIR] [--out docs/images/many_robots.png]

Shipped robots, and every URDF in a folder, by the mapping that is detected.

Legend: T frames.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from common import print_header, print_table, read_options

from mrhubo.describing.run import open_robot
from mrhubo.motion import read_motion
from mrhubo.reference import OptimizationRetargeter, angle_between
from mrhubo.retargeter import untrained
from mrhubo.robot import Robot
from mrhubo.runtime.locations import project_root
from mrhubo.view import save_png
from mrhubo.view.figures import figure_sheet, human_figure
from mrhubo.view.pictures import Artist

MOMENTS = (0.2, 0.5, 0.8)
CELL = (150, 190)
"""Of a figure [pixels]."""


def main(argv: list[str]) -> None:
    """Draws the picture and prints the table."""
    options, argv = read_options(argv, motion="data/motions/directing_traffic.npz", robots="nao,coman,reachy",
                                 urdfs="data/external/robots/more", out="docs/images/many_robots.png")  # fmt: skip
    if argv:
        sys.exit(f"{argv[0]}: is unknown")
    warnings.simplefilter("ignore")
    print_header()
    motion = read_motion(project_root() / options["motion"])
    frames = [round(share * (len(motion.local_TJ33) - 1)) for share in MOMENTS]
    columns, titles, rows = [[human_figure(motion.local_TJ33[f]) for f in frames]], ["person"], []
    for name, robot in _robots(options["robots"], options["urdfs"]):
        start = time.perf_counter()
        retargeter = untrained(robot)
        made = time.perf_counter() - start
        q_TN = torch.as_tensor(np.asarray(retargeter(motion).q))
        body_map, shown = retargeter.body_map, motion.local_TJ33[frames]
        target_TD3, limbs = body_map.human_directions(shown), body_map.measured
        optimum_TN, _ = OptimizationRetargeter(body_map).solve_frames(shown)
        off, best = (
            float(torch.rad2deg(angle_between(directions_TD3[:, limbs], target_TD3[:, limbs])).mean())
            for directions_TD3 in (body_map.robot_directions(robot.forward(q)) for q in (q_TN[frames], optimum_TN))
        )
        rows.append([name, str(len(robot.joint_names)), f"{off:.2f}", f"{best:.2f}", f"{made:.1f}"])
        artist = Artist(robot, body_map.skeleton)
        columns.append([artist.robot_figure(q_TN[f]) for f in frames])
        titles.append(name)
    caption = "One motion on robots that nothing was trained for: one network for all of them"
    sheet = figure_sheet([list(row) for row in zip(*columns, strict=True)], titles, (), caption, CELL)
    print(save_png(sheet, Path(options["out"])))
    print()
    print_table(["robot", "joints", "limbs off [deg]", "each frame's optimum", "made in [s]"], rows)


def _robots(names: str, urdfs: str) -> Iterator[tuple[str, Robot]]:
    for name in names.split(","):
        yield name, Robot.from_config(name)
    for path in sorted((project_root() / urdfs).glob("*.urdf")):
        yield path.stem.split("_")[0], open_robot(str(path))


if __name__ == "__main__":
    main(sys.argv[1:])
