"""Retargets poses that come as arrays: a single one, and many at once, in the three shapes that are understood.

    python examples/02_your_own_arrays.py PACKAGE

A pose is the local rotation of SMPL's joints 1 to 21, each relative to its parent. Axes: x to the body's left, y up,
z forward. At rest the arms lie along x (T-pose).
"""

from __future__ import annotations

import math
import sys

import numpy as np

import mrhubo
from mrhubo.body import POSED_JOINT_NAMES


def arms_at_angle(down: float) -> np.ndarray:
    """A pose (21, 3), axis-angle [rad]: both arms turned down by an angle [rad] from the T-pose."""
    pose = np.zeros((21, 3))
    pose[POSED_JOINT_NAMES.index("left_shoulder")] = [0, 0, -down]  # about the forward axis
    pose[POSED_JOINT_NAMES.index("right_shoulder")] = [0, 0, down]
    return pose


def main(package: str) -> None:
    """Three forms of the same poses, one answer."""
    retargeter = mrhubo.load(package)

    single = arms_at_angle(math.radians(80)).reshape(63)
    result = retargeter(single)
    print(f"one pose {single.shape} -> joint angles {tuple(result.q.shape)}, confidence {float(result.confidence):.2f}")

    angles = np.radians([0, 30, 60, 90])
    many = np.stack([arms_at_angle(angle) for angle in angles]).reshape(2, 2, 63)  # any leading shape
    print(f"poses {many.shape} -> joint angles {tuple(retargeter(many).q.shape)}")

    matrices = np.broadcast_to(np.eye(3), (4, 21, 3, 3)).copy()  # rotation matrices
    for matrix, angle in zip(matrices, angles, strict=True):
        for side, sign in (("left", -1), ("right", 1)):
            c, s = math.cos(angle), sign * math.sin(angle)
            matrix[POSED_JOINT_NAMES.index(f"{side}_shoulder")] = [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    columns = matrices[..., :2].swapaxes(-1, -2).reshape(4, 21, 6)  # their first two columns, one after the other
    expected = retargeter(many).q.reshape(4, -1)
    for name, poses in (("matrices", matrices), ("first two columns", columns)):
        difference = float((retargeter(poses).q - expected).abs().max())
        print(f"{name} {poses.shape}: the same answer within {difference:.1e} rad")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
