"""Retargets a file of human motion and writes a ROS 2 bag, which `ros2 bag play` plays; no ROS is needed here.

    pip install 'mrhubo[ros]'
    python examples/07_ros_bag.py PACKAGE [MOTION.npz] [OUT.mcap]

PACKAGE is the folder that `mrhubo fit` printed at its end. The bag has one trajectory_msgs/msg/JointTrajectory on the
topic /joint_trajectory. `result.save` writes for other programs too: docs/formats.md lists what there is.
"""

from __future__ import annotations

import sys
from pathlib import Path

import mrhubo

WAVE = Path(__file__).parents[1] / "data" / "motions" / "wave.npz"


def main(package: str, motion_file: str = str(WAVE), out: str = "wave.mcap") -> None:
    """Reads, retargets, writes, and reads the bag back."""
    result = mrhubo.load(package)(mrhubo.read_motion(motion_file))
    result.save(out)

    found = mrhubo.read_robot_motion(out)
    print(f"{out}: {len(found)} points at {found.frame_rate:g} per second")
    print(f"joints: {', '.join(found.joint_names)}")
    print(f"largest difference to what was written: {abs(found.q - result.q.numpy()).max():g} rad")


if __name__ == "__main__":
    if not 2 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
