"""The reference retargeter's two outputs on the evaluation's motions: q, and q_cf, free of self-collision.

    python benchmarks/reference.py [--robots nao,coman,reachy] [key.sub=value ...]

All clips together: frames per second, angle to the human by direction, joints at a limit, jumps (steps over 0.5 rad per
1/24 s that the human did not make), jerk of the directions over the human's, frames in self-collision, frames at rest.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import torch
from common import print_header, print_table, read_options

from mrhubo.config import load_config
from mrhubo.evaluation import load_motions
from mrhubo.motion import Motion
from mrhubo.reference import OptimizationRetargeter, ReferenceResult, direction_jerk
from mrhubo.robot import build_body_map
from mrhubo.runtime.locations import default_motions


def main(argv: list[str]) -> None:
    """Prints a table a robot."""
    options, argv = read_options(argv, robots="nao,coman,reachy")
    print_header()
    for robot in options["robots"].split(","):
        config = load_config(Path(f"conf/{robot}.yaml"), argv)
        config.evaluation.motions = config.evaluation.motions or default_motions()
        motions, retargeter = load_motions(config).all, OptimizationRetargeter(build_body_map(config.robot))
        retargeter.retarget(motions[0].local_TJ33[:50], motions[0].frame_rate)
        start = time.perf_counter()
        plain = [retargeter.retarget(motion.local_TJ33, motion.frame_rate) for motion in motions]
        middle = time.perf_counter()
        free = [
            retargeter.retarget_collision_free(motion.local_TJ33, motion.frame_rate, found.q_TN)
            for motion, found in zip(motions, plain, strict=True)
        ]
        end = time.perf_counter()
        measured = retargeter.body_map.measured
        parts = list(dict.fromkeys(retargeter.body_map.directions[i].part.name for i in measured))
        rows = [
            [name, *measures(retargeter, motions, found, parts, seconds)]
            for name, found, seconds in (("q", plain, middle - start), ("q_cf, from q", free, end - middle))
        ]
        heads = ["frames/s", *(f"{part} [deg]" for part in parts), "at a limit", "jumps", "jerk", "collision", "rests"]
        print(f"## {robot}, {len(motions)} clips, {sum(len(m) for m in motions):,} frames\n")
        print_table(["output", *heads], rows)
        print()


def measures(
    retargeter: OptimizationRetargeter,
    motions: list[Motion],
    found: list[ReferenceResult],
    parts: list[str],
    seconds: float,
) -> list[str]:
    """The cells of a row, means over frames."""
    body_map = retargeter.body_map
    shapes, names = body_map.collision, [body_map.directions[i].part.name for i in body_map.measured]
    q_TN, residual_TD = torch.cat([f.q_TN for f in found]), torch.cat([f.residual_deg_TD for f in found])
    jerks = []
    for motion, result in zip(motions, found, strict=True):
        robot_TD3 = body_map.robot_directions(body_map.robot.forward(result.q_TN))
        both = (d[:, body_map.measured] for d in (robot_TD3, body_map.human_directions(motion.local_TJ33)))
        jerks.append([float(direction_jerk(d, motion.frame_rate).sum()) for d in both])
    robot_jerk, human_jerk = torch.tensor(jerks).sum(0).tolist()
    limits = sum(f.at_limit_share * len(f.q_TN) for f in found) / len(q_TN)
    columns = [[i for i, name in enumerate(names) if name == part] for part in parts]
    return [
        f"{len(q_TN) / seconds:,.0f}",
        *(f"{float(residual_TD[:, column].mean()):.2f}" for column in columns),
        f"{limits:.1%}",
        str(sum(f.jumps for f in found)),
        f"{robot_jerk / human_jerk:.2f}",
        f"{float(shapes.collides(q_TN).float().mean()):.2%}",
        str(int(sum(int(f.rests_T.sum()) for f in found))),
    ]


if __name__ == "__main__":
    main(sys.argv[1:])
