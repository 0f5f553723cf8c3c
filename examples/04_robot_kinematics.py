"""What mrhubo knows of a robot: joints, limits, forward kinematics of many poses at once, self-collision.

    python examples/04_robot_kinematics.py [ROBOT]

ROBOT is a shipped robot (nao, coman, reachy) or a YAML file of your own; by default nao.
"""

from __future__ import annotations

import sys

import torch

import mrhubo
from mrhubo.robot import SelfCollision


def main(robot_name: str = "nao") -> None:
    """Prints joints and where the links get to in 1,000 random poses."""
    robot = mrhubo.Robot.from_config(robot_name)
    print(f"{robot.name}: {len(robot.joint_names)} joints")
    for name, lower, upper in zip(robot.joint_names, robot.lower_N.tolist(), robot.upper_N.tolist(), strict=True):
        print(f"  {name:<16} {lower:6.2f} to {upper:5.2f} rad")

    q_BN = robot.sample(1_000, torch.Generator().manual_seed(0))  # uniform inside the limits
    poses = robot.forward(q_BN)  # rotations (1000, links, 3, 3) and positions (1000, links, 3), in the base frame
    print("reach, in metres from the base's origin (x forward, y left, z up):")
    for link in robot.moving_links:
        position_B3 = poses.position_BL3[:, robot.link_index(link)]
        low, high = position_B3.amin(dim=0).tolist(), position_B3.amax(dim=0).tolist()
        ranges = ", ".join(f"{axis} {a:5.2f} to {b:5.2f}" for axis, a, b in zip("xyz", low, high, strict=True))
        print(f"  {link:<16} {ranges}")

    touching = SelfCollision(robot).collides(q_BN).float().mean()
    print(f"the robot touches itself in {float(touching):.0%} of these poses")


if __name__ == "__main__":
    if len(sys.argv) > 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
