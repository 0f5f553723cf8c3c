"""Retargets a motion by optimisation: no training and no package, but slower, and with the whole clip at hand.

    python examples/03_optimization_without_training.py [ROBOT]

ROBOT is a shipped robot (nao, coman, reachy) or a YAML file of your own; by default nao.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import mrhubo

WAVE = Path(__file__).parents[1] / "data" / "motions" / "wave.npz"


def main(robot_name: str = "nao") -> None:
    """Two seconds of a wave."""
    robot = mrhubo.Robot.from_config(robot_name)
    optimiser = mrhubo.OptimizationRetargeter(robot)
    motion = mrhubo.read_motion(WAVE)

    start = time.perf_counter()
    result = optimiser(motion)
    seconds = time.perf_counter() - start
    print(f"{robot.name}: {len(result.q)} frames in {seconds:.1f} s")
    print(f"the robot's limbs are {float(result.direction_error_deg.mean()):.1f} degrees off the person's on average")

    fastest = float(result.q.diff(dim=0).abs().max()) * motion.frame_rate
    print(f"the fastest joint turns at {fastest:.1f} rad/s")
    result.save(f"wave_on_{robot.name}.npz")
    print(f"written: wave_on_{robot.name}.npz")


if __name__ == "__main__":
    if len(sys.argv) > 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
