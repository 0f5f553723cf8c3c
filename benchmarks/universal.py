"""The universal network on robots that it never saw: how much farther limbs are from the human than in each frame's
optimum for that robot, which the reference retargeter finds from twelve starts.

    python benchmarks/universal.py [--every 40] [--made 1000] [--seeds 500000] [--frames 8] [--urdfs DIR]
        [--network FILE] [--robots nao,coman,reachy] [--clips FOLDER]

Robots: the shipped ones, every URDF in a folder by its detected mapping, and random humanoids
(`mrhubo.robot.generator`), which are made by other code than the chains that the network learnt from. Motion: the nine
CMU test clips, and the same with rotations shared out differently. Beside the network, as many steps of
Levenberg-Marquardt from the middle of all ranges. With `--every 1`, jumps that the human did not make are counted too,
per clip, each frame answered for itself.

Legend: T frames, D directions, N joints.
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path

import torch
from common import print_header, print_table, read_options
from torch import Tensor

from mrhubo.config import EvaluationConfig
from mrhubo.describing.run import open_robot
from mrhubo.errors import UserError
from mrhubo.motion import read_folder, reshare
from mrhubo.reference import OptimizationRetargeter, angle_between, count_jumps
from mrhubo.robot import BodyMap, Robot
from mrhubo.robot.generator import humanoid
from mrhubo.runtime.locations import project_root
from mrhubo.universal.robots import UniversalRetargeter
from mrhubo.universal.weights import open_network

CLIPS = "data/external/cmu/evaluation"
MORE = "data/external/robots/more"
SHIPPED = ("nao", "coman", "reachy")
Answer = Callable[[Tensor], Tensor]


def main(argv: list[str]) -> None:
    """Prints the tables."""
    options, argv = read_options(argv, every="40", made="1000", seeds="500000", frames="8", urdfs=MORE, network="",
                                 robots=",".join(SHIPPED), clips=CLIPS)  # fmt: skip
    if argv:
        sys.exit(f"{argv[0]}: is unknown")
    warnings.simplefilter("ignore")
    print_header()
    network = open_network(Path(options["network"]) if options["network"] else None)
    every = int(options["every"])
    motions = [m for m in read_folder(project_root() / options["clips"]) if m.name not in EvaluationConfig().validation]
    kinds = {"as they are": motions, "re-shared": [reshare(m, seed) for seed, m in enumerate(motions)]}
    robots = [*options["robots"].split(","), *sorted(map(str, (project_root() / options["urdfs"]).glob("*.urdf")))]
    rows = []
    for name in robots:
        body_map = BodyMap.of(Robot.from_config(name) if name in SHIPPED else open_robot(name))
        for kind, clips in kinds.items():
            found = [measure(body_map, network, m.local_TJ33[::every], m.frame_rate / every) for m in clips]
            means = {key: sum(float(f[key].mean()) for f in found) / len(found) for key in found[0]}
            worst = max(float(f["network"].max()) for f in found)
            jumps = [f"{means[f'{which} jumps']:.1f}" for which in ("optimum", "network")] if every == 1 else ["", ""]
            rows.append([Path(name).stem, str(len(body_map.robot.joint_names)), kind, f"{means['optimum']:.2f}",
                         *(_number(means[key]) for key in _COLUMNS), f"{worst:.1f}", *jumps])  # fmt: skip
            print(" ".join(rows[-1]), file=sys.stderr)
    print_table(["robot", "joints", "clips", "optimum [deg]", *_COLUMNS.values(), "worst frame", "jumps of optima",
                 "jumps"], rows)  # fmt: skip
    print()
    first = int(options["seeds"])
    made(network, range(first, first + int(options["made"])), torch.cat([m.local_TJ33 for m in motions]),
         int(options["frames"]))  # fmt: skip


def _number(value: float) -> str:
    return f"{value:.3f}" if math.isfinite(value) else ""


_COLUMNS = {
    "network": "network",
    "network + 1": "+ 1 step",
    "network + 10": "+ 10 steps",
    "middle, 5": "5 steps from the middle",
    "middle, 10": "10 steps",
    "hands and heads": "network, hands and heads",
}


def measure(body_map: BodyMap, network: torch.nn.Module, local_TJ33: Tensor, rate: float) -> Mapping[str, Tensor]:
    """Of each frame (T,) [deg]: the limbs' angle to the human in the optimum, and what each answer has more."""
    optimum_TN, _ = OptimizationRetargeter(body_map).solve_frames(local_TJ33)
    target_TD3 = body_map.human_directions(local_TJ33)
    universal = UniversalRetargeter(body_map, network)  # pyright: ignore[reportArgumentType]
    problem = universal.problem
    middle_TN = ((problem.lower_N + problem.upper_N) / 2).expand(len(target_TD3), -1)
    answers = {"network": universal(target_TD3)}
    for more in (1, 10):
        answers[f"network + {more}"] = problem.minimise(answers["network"], target_TD3, more)[0]
    for steps in (5, 10):
        answers[f"middle, {steps}"] = problem.minimise(middle_TN, target_TD3, steps)[0]
    for name, q_TN in answers.items():
        outside = (q_TN < problem.lower_N) | (q_TN > problem.upper_N)
        assert not bool(outside.any()), f"{name}: limits are exceeded"
    limbs, others = ([i for i, d in enumerate(body_map.directions) if d.part.region in regions]
                     for regions in (("arm",), ("hand", "head")))  # fmt: skip

    def error(q_TN: Tensor, columns: list[int]) -> Tensor:
        robot_TD3 = body_map.robot_directions(body_map.robot.forward(q_TN))
        return torch.rad2deg(angle_between(robot_TD3[:, columns], target_TD3[:, columns])).mean(dim=1)

    best_T = error(optimum_TN, limbs)
    found = {"optimum": best_T, **{name: error(q_TN, limbs) - best_T for name, q_TN in answers.items()}}
    found["hands and heads"] = error(answers["network"], others) - error(optimum_TN, others)
    for name, q_TN in (("optimum", optimum_TN), ("network", answers["network"])):
        found[f"{name} jumps"] = torch.tensor([float(count_jumps(problem, q_TN, target_TD3, rate))])
    return found


def made(network: torch.nn.Module, seeds: range, local_TJ33: Tensor, frames: int) -> None:
    """Random humanoids, by their detected mapping, each on some frames of its own."""
    found: list[Mapping[str, Tensor]] = []
    refused, start = 0, time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "made.urdf"
        for seed in seeds:
            path.write_text(humanoid(seed).urdf)
            rows = torch.randint(len(local_TJ33), (frames,), generator=torch.Generator().manual_seed(seed))
            try:
                found.append(measure(BodyMap.of(open_robot(str(path))), network, local_TJ33[rows], 1.0))
            except UserError:
                refused += 1
    if not found:
        return
    rows = []
    for key, name in _COLUMNS.items():
        all_X = torch.cat([f[key] for f in found])
        all_X = all_X[all_X.isfinite()]
        numbers = [all_X.mean(), all_X.quantile(0.99), all_X.max()]
        rows.append([name, *(f"{float(number):.3f}" for number in numbers)])
    print(f"{len(found)} random humanoids, {frames} frames each; {refused} more were refused by detection; "
          f"{time.perf_counter() - start:.0f} s")  # fmt: skip
    print_table(["excess over the optimum [deg]", "mean", "99th percentile", "worst"], rows)


if __name__ == "__main__":
    main(sys.argv[1:])
