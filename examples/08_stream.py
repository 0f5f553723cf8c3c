"""Retargets poses as they come from a camera, one by one: no joint jumps, and none turns faster than it can.

    python examples/08_stream.py PACKAGE [MOTION.npz]

PACKAGE is the folder that `mrhubo fit` printed at its end. MOTION stands in for the camera, by default a wave of the
right hand. `mrhubo.FastStream(mrhubo.load_fast(package), rate)` does the same without PyTorch: docs/fast.md.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import torch

import mrhubo

WAVE = Path(__file__).parents[1] / "data" / "motions" / "wave.npz"
HIDDEN = range(60, 75)  # frames in which the camera sees nobody


def main(package: str, motion_file: str = str(WAVE)) -> None:
    """Two seconds, frame by frame; for a quarter of a second of them nobody is seen."""
    motion = mrhubo.read_motion(motion_file)
    stream = mrhubo.Stream(mrhubo.load(package), rate=motion.frame_rate)
    angles, seconds = [], []
    for number, pose in enumerate(motion.local_TJ33[: round(2 * motion.frame_rate)]):
        start = time.perf_counter()
        answer = stream(None if number in HIDDEN else pose)
        seconds.append(time.perf_counter() - start)
        angles.append(answer.q)  # here a robot would be told: robot.move(answer.joint_names, answer.q)

    speed_N = torch.stack(angles).diff(dim=0).abs().amax(dim=0) * motion.frame_rate
    limit_N = stream.retargeter.body_map.robot.velocity_N
    print(f"{len(angles)} frames, {1000 * sorted(seconds)[len(seconds) // 2]:.1f} ms each")
    for name, speed, limit in zip(answer.joint_names, speed_N.tolist(), limit_N.tolist(), strict=True):
        print(f"  {name:<16} {speed:5.2f} rad/s at most, of {limit:.2f}")


if __name__ == "__main__":
    if not 2 <= len(sys.argv) <= 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
