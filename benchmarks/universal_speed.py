"""How long the universal network's five iterations take in each form, and how far apart the forms' angles are.

    python benchmarks/universal_speed.py [--robots nao,reachy,FILE.urdf] [--batch 2000] [--rounds 100]

Iterations alone, from human directions to joint angles: no reading of poses, no steps afterwards, no confidence. A
frame by one thread, the median of the rounds; a batch by all cores (PyTorch and NumPy share out what they do between
matrices as they please), the best of three. Distance from PyTorch in float64: the largest angle of a frame, its median
and its 99th percentile over poses of the body prior.
"""

from __future__ import annotations

import copy
import statistics
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from common import print_header, print_table, read_options
from universal import MORE, SHIPPED

from mrhubo.body import BodyPrior
from mrhubo.describing.run import open_robot
from mrhubo.fast.engines import forms_here, make_engine
from mrhubo.retargeter import Retargeter, UniversalJoints
from mrhubo.robot import BodyMap, Robot
from mrhubo.runtime.locations import project_root
from mrhubo.universal.weights import open_network

Answer = Callable[[np.ndarray], np.ndarray]


def main(argv: list[str]) -> None:
    """Prints the table."""
    g1 = project_root() / MORE / "g1_29dof_rev_1_0.urdf"
    robots = ",".join([*SHIPPED, *([str(g1)] if g1.is_file() else [])])
    options, argv = read_options(argv, robots=robots, batch="2000", rounds="100")
    if argv:
        sys.exit(f"{argv[0]}: is unknown")
    warnings.simplefilter("ignore")
    print_header()
    prior, generator = BodyPrior.open(), torch.Generator().manual_seed(0)
    latent_TZ = 0.8 * torch.randn(int(options["batch"]), prior.latent, generator=generator)
    local_TJ33 = prior.decode_matrices(latent_TZ)
    rows = []
    for name in options["robots"].split(","):
        body_map = BodyMap.of(Robot.from_config(name) if name in SHIPPED else open_robot(name))
        retargeter = Retargeter(UniversalJoints(body_map, open_network()), body_map, prior, None, 0.0)
        target_TD3 = body_map.human_directions(local_TJ33)
        exact = copy.deepcopy(retargeter.network).double().of_directions(target_TD3.double()).numpy()
        for form, answer in forms(retargeter).items():
            off_T = np.abs(answer(target_TD3.double().numpy()) - exact).max(axis=1)
            figures = measured(answer, target_TD3.double().numpy(), int(options["rounds"]))
            off = [f"{np.quantile(off_T, share):.0e}" for share in (0.5, 0.99)]
            rows.append([Path(name).stem, str(len(body_map.robot.joint_names)), form, *figures, *off])
    heads = ["one frame [us]", "batch [frames/s]", "from float64 [rad]", "99%"]
    print_table(["robot", "joints", "form", *heads], rows)


def forms(retargeter: Retargeter) -> dict[str, Answer]:
    """What answers, by its name."""
    description = retargeter.describe()

    def by_torch(target_TD3: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            return retargeter.network.of_directions(torch.from_numpy(target_TD3).float()).numpy()

    def by(form: str) -> Answer:
        engine = make_engine(description, form)
        return lambda target_TD3: engine.network(np.zeros((len(target_TD3), 21, 3, 3), np.float32), target_TD3)

    return {"PyTorch": by_torch, **{form: by(form) for form in reversed(forms_here())}}


def measured(answer: Answer, target_TD3: np.ndarray, rounds: int) -> list[str]:
    """Microseconds of a frame, and frames per second."""

    def seconds(given_TD3: np.ndarray) -> float:
        start = time.perf_counter()
        answer(given_TD3)
        return time.perf_counter() - start

    single = statistics.median(seconds(target_TD3[r % len(target_TD3)][None]) for r in range(rounds))
    batch = min(seconds(target_TD3) for _ in range(3))
    return [f"{single * 1e6:,.0f}", f"{len(target_TD3) / batch:,.0f}"]


if __name__ == "__main__":
    main(sys.argv[1:])
