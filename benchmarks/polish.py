"""What the steps of optimisation after the networks bring: excess of the limbs' error over each frame's own optimum.

    python benchmarks/polish.py PACKAGE POSES [--every 40]

PACKAGE is the folder of a trained retargeter, POSES an .npz file with `poses` (frames, 66 or more), axis-angle [rad] of
SMPL's joints with the root first; of these every 40th frame is taken. The optimum is `solve_frames`.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import torch
from common import print_header, print_table
from torch import Tensor

from mrhubo import rotation
from mrhubo.reference import OptimizationRetargeter, direction_error
from mrhubo.retargeter import POLISH, Retargeter

_STEPS = (0, 1, 3, POLISH)
_MANY_DEG = 3.0


def main(argv: list[str] | None = None) -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description="What the steps of optimisation after the networks bring.")
    parser.add_argument("package", type=Path, help="folder of a trained retargeter")
    parser.add_argument("poses", type=Path, help="an .npz file with `poses`")
    parser.add_argument("--every", type=int, default=40, help="which frames are taken (default: every %(default)s.)")
    given = parser.parse_args(argv)
    print_header()
    with np.load(given.poses, allow_pickle=False) as file:
        turns_T66 = torch.from_numpy(file["poses"][:: given.every, :66].astype(np.float32))
    local_TJ33 = rotation.axis_angle_to_matrix(turns_T66[:, 3:].unflatten(1, (21, 3)))
    retargeter = Retargeter.load(given.package)
    body_map = retargeter.body_map
    measured = [body_map.directions[i] for i in body_map.measured]
    limbs = [i for i, direction in enumerate(measured) if direction.part.region in ("arm", "leg")]

    def limb_error(q_TN: Tensor) -> Tensor:
        return direction_error(body_map, q_TN, local_TJ33)[:, limbs].mean(dim=1)

    best_T = limb_error(OptimizationRetargeter(body_map).solve_frames(local_TJ33)[0])
    rows = []
    for steps in _STEPS:
        start = time.perf_counter()
        q_TN = retargeter.predict(local_TJ33, steps)
        seconds = time.perf_counter() - start
        excess_T = limb_error(q_TN) - best_T
        many = float((excess_T > _MANY_DEG).float().mean())
        rows.append([str(steps), f"{float(excess_T.mean()):.3f}", f"{many:.3%}", f"{float(excess_T.max()):.1f}",
                     f"{1e6 * seconds / len(q_TN):.0f}"])  # fmt: skip
    print(f"{len(local_TJ33):,} frames, {body_map.robot.name}; their own optimum: {float(best_T.mean()):.2f} degrees\n")
    print_table(["steps at most", "mean excess of the limbs [deg]", f"frames over {_MANY_DEG:.0f} degrees",
                 "worst frame [deg]", "a frame in batches [us]"], rows)  # fmt: skip


if __name__ == "__main__":
    main()
