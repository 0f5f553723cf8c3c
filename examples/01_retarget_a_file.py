"""Retargets a file of human motion with a package, and writes the robot's joint angles.

    python examples/01_retarget_a_file.py PACKAGE [MOTION.npz] [OUT.csv]

PACKAGE is the folder that `mrhubo fit` printed at its end. MOTION is an .npz file with the keys of AMASS, SMPL-X or
SMPL-H, by default a wave of the right hand. OUT ends in .csv or .npz.
"""

from __future__ import annotations

import sys
from pathlib import Path

import mrhubo

WAVE = Path(__file__).parents[1] / "data" / "motions" / "wave.npz"


def main(package: str, motion_file: str = str(WAVE), out: str = "joint_angles.csv") -> None:
    """Reads, retargets, tells how far to trust the answer, writes."""
    retargeter = mrhubo.load(package)
    motion = mrhubo.read_motion(motion_file)
    result = retargeter(motion)

    print(f"{motion.name}: {len(result.q)} frames at {result.frame_rate:g} per second")
    for name, angles in zip(result.joint_names, result.q.T, strict=True):
        print(f"  {name:<16} {float(angles.min()):6.2f} to {float(angles.max()):5.2f} rad")
    print(
        f"confidence: {float(result.confidence.mean()):.2f} on average, {float(result.confidence.min()):.2f} at worst"
    )
    if result.collision is not None:  # it is None where collision shapes are missing
        print(f"the robot touches itself in {int(result.collision.sum())} frames")
    result.save(out)
    print(f"written: {out}")


if __name__ == "__main__":
    if not 2 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
