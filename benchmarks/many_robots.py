"""One motion on several robots by the universal network, which was trained on none of them: a picture, and how near.

    python benchmarks/many_robots.py [--motion data/motions/directing_traffic.npz] [--robots nao,coman,reachy]
        [--made 9] [--seeds 600000] [--urdfs DIR] [--out docs/images/twelve_robots.png]

Shipped robots; random humanoids (`mrhubo.robot.generator`) of seeds from a number on, as many as are asked for; and
every URDF in a folder. The latter two by the mapping that is detected, with legs and waist.

Legend: T frames.
"""

from __future__ import annotations

import contextlib
import itertools
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from common import print_header, print_table, read_options

from mrhubo.describing.run import open_robot
from mrhubo.errors import UserError
from mrhubo.motion import read_motion
from mrhubo.reference import OptimizationRetargeter, angle_between
from mrhubo.retargeter import untrained
from mrhubo.robot import Robot
from mrhubo.robot.generator import humanoid
from mrhubo.runtime.locations import project_root
from mrhubo.view import save_png
from mrhubo.view.figures import figure_sheet, human_figure
from mrhubo.view.pictures import Artist

MOMENTS = (0.2, 0.5, 0.8)
CELL = (104, 170)
"""Of a figure [pixels]."""
_LOOKED_AT, _UPRIGHT = 100, 0.99
"""Random humanoids for each that is drawn, at most; cosine of how far they may be turned."""


def main(argv: list[str]) -> None:
    """Draws the picture and prints the table."""
    options, argv = read_options(argv, motion="data/motions/directing_traffic.npz", robots="nao,coman,reachy",
                                 made="9", seeds="600000", urdfs="", out="docs/images/twelve_robots.png")  # fmt: skip
    if argv:
        sys.exit(f"{argv[0]}: is unknown")
    warnings.simplefilter("ignore")
    print_header()
    motion = read_motion(project_root() / options["motion"])
    frames = [round(share * (len(motion.local_TJ33) - 1)) for share in MOMENTS]
    columns, titles, rows = [[human_figure(motion.local_TJ33[f]) for f in frames]], ["person"], []
    robots = itertools.chain(_shipped(options["robots"]), _made(int(options["made"]), int(options["seeds"])),
                            _in_folder(options["urdfs"]))  # fmt: skip
    for name, robot in robots:
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


def _shipped(names: str) -> Iterator[tuple[str, Robot]]:
    for name in names.split(","):
        yield name, Robot.from_config(name)


def _made(count: int, seed: int) -> Iterator[tuple[str, Robot]]:
    """So many random humanoids whose body parts are found, with waist; those that stand upright on legs and face
    forwards, so that they can be drawn beside others, with sticks.
    """
    found = 0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "made.urdf"
        for number in range(seed, seed + _LOOKED_AT * count):
            if found == count:
                return
            made = humanoid(number)
            path.write_text(made.urdf)
            upright = min(made.up_3[2], made.forward_3[0]) > _UPRIGHT
            if upright and made.chains.get("left_leg") and "<collision>" not in made.urdf:
                with contextlib.suppress(UserError):
                    robot = open_robot(str(path), whole_body=True)
                    found += 1
                    yield f"made {found}", robot


def _in_folder(folder: str) -> Iterator[tuple[str, Robot]]:
    for path in sorted((project_root() / folder).glob("*.urdf")) if folder else ():
        yield path.stem.split("_")[0], open_robot(str(path), whole_body=True)


if __name__ == "__main__":
    main(sys.argv[1:])
