"""Which way answers a robot without a package better: the universal network or the optimiser (`--method` of
`mrhubo retarget`).

    python benchmarks/without_training.py [--clips 9] [--robots nao,coman,reachy,FILE.urdf]

Each robot, by each way, on the first CMU test clips, every frame, as whole motions: the limbs' angle to the human over
that of each frame's optimum, which twelve starts find without a look at other frames; jumps that the human did not
make, a clip; steps in which a joint turns faster than it can; jerk of the robot's directions over the human's. Then a
minute of the motions that ship, giving way to self-collision as the command does: seconds from a `Robot` to its motion.
"""

from __future__ import annotations

import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import torch
from common import print_header, print_table, read_options
from files import minute
from torch import Tensor
from universal import CLIPS, MORE, SHIPPED

from mrhubo.config import EvaluationConfig
from mrhubo.describing.run import open_robot
from mrhubo.motion import Motion, read_folder, read_motion
from mrhubo.reference import OptimizationRetargeter, angle_between, count_jumps, direction_jerk
from mrhubo.retargeter import untrained
from mrhubo.retargeting import of_reference, of_universal
from mrhubo.robot import Robot
from mrhubo.runtime.locations import project_root

WAYS = {"universal": of_universal, "reference": of_reference}


def main(argv: list[str]) -> None:
    """Prints the table."""
    urdfs = sorted(map(str, (project_root() / MORE).glob("*.urdf")))
    options, argv = read_options(argv, clips="9", robots=",".join([*SHIPPED, *urdfs]))
    if argv:
        sys.exit(f"{argv[0]}: is unknown")
    warnings.simplefilter("ignore")
    print_header()
    validation = EvaluationConfig().validation
    motions = [m for m in read_folder(project_root() / CLIPS) if m.name not in validation][: int(options["clips"])]
    with tempfile.TemporaryDirectory() as folder:
        long = read_motion(minute(Path(folder) / "minute.npz"))
    rows = []
    for name in options["robots"].split(","):
        robot = Robot.from_config(name) if name in SHIPPED else open_robot(name)
        for way, figures in measure(robot, motions).items():
            start = time.perf_counter()
            WAYS[way](robot).answer(long)
            rows.append([Path(name).stem, way, *figures, f"{time.perf_counter() - start:.1f}"])
            print(" ".join(rows[-1]), file=sys.stderr)
    heads = ["limbs, optimum [deg]", "over it", "99%", "worst", "jumps", "too fast", "jerk", "a minute [s]"]
    print_table(["robot", "method", *heads], rows)


def measure(robot: Robot, motions: list[Motion]) -> dict[str, list[str]]:
    """Figures of each way."""
    reference, universal = OptimizationRetargeter(robot), untrained(robot)
    body_map, problem = reference.body_map, reference.problem
    limbs = [i for i, d in enumerate(body_map.directions) if d.part.region == "arm"]
    found: dict[str, list[tuple[Tensor, Tensor, float, float, float]]] = {way: [] for way in WAYS}
    for motion in motions:
        rate, target_TD3 = motion.frame_rate, body_map.human_directions(motion.local_TJ33)
        q_TN, optimum_TN = reference.motion_and_optima(motion.local_TJ33, rate)
        error = _error(reference, target_TD3, limbs)
        human = float(direction_jerk(target_TD3[:, limbs], rate).mean())
        answers = {"universal": universal.predict(motion.local_TJ33, 10, rate, False), "reference": q_TN}
        for way, answer_TN in answers.items():
            jerk = direction_jerk(body_map.robot_directions(robot.forward(answer_TN))[:, limbs], rate).mean()
            fast = answer_TN.diff(dim=0).abs() * rate > robot.velocity_N * 1.001
            jumps, over = count_jumps(problem, answer_TN, target_TD3, rate), float(fast.any(dim=1).float().mean())
            found[way].append((error(optimum_TN), error(answer_TN), float(jumps), over, float(jerk) / human))
    return {way: _told(clips) for way, clips in found.items()}


def _error(reference: OptimizationRetargeter, target_TD3: Tensor, limbs: list[int]) -> Callable[[Tensor], Tensor]:
    def error(q_TN: Tensor) -> Tensor:
        body_map = reference.body_map
        own_TD3 = body_map.robot_directions(body_map.robot.forward(q_TN))
        return torch.rad2deg(angle_between(own_TD3[:, limbs], target_TD3[:, limbs])).mean(dim=1)

    return error


def _told(clips: list[tuple[Tensor, Tensor, float, float, float]]) -> list[str]:
    best_T, own_T = torch.cat([clip[0] for clip in clips]), torch.cat([clip[1] for clip in clips])
    over_T = own_T - best_T
    jumps, fast, jerk = (sum(clip[place] for clip in clips) / len(clips) for place in (2, 3, 4))
    numbers = [float(best_T.mean()), float(over_T.mean()), float(over_T.quantile(0.99)), float(over_T.max())]
    return [*(f"{number:.2f}" for number in numbers), f"{jumps:.1f}", f"{fast:.1%}", f"{jerk:.2f}"]


if __name__ == "__main__":
    main(sys.argv[1:])
