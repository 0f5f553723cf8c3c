"""How an arm is turned about itself when it rests: SMPL's way, and the way of the CMU recordings that we hold.

SMPL's elbows bend about the vertical of the T-pose, (0, -1, 0) on the left. The skeletons of the CMU Graphics Lab
Motion Capture Database bend theirs about an oblique axis of the upper arm, and a conversion that keeps the skeleton's
frames keeps that. The limbs point the same way; the upper arm's and the forearm's own turns differ by a constant, which
is taken out here.

Legend: B batch, J = 21 posed joints.
"""

from __future__ import annotations

import math

from torch import Tensor

from mrhubo import rotation
from mrhubo.body.skeleton import POSED_JOINT_NAMES, SIDES

CMU_ELBOW_AXIS = (0.0, -0.871, 0.491)
"""About which the left elbow of the CMU recordings bends, in the upper arm's frame: a pure hinge."""


def cmu_to_smpl_arms(local_BJ33: Tensor) -> Tensor:
    """Local rotations (B, 21, 3, 3) with both arms turned about their bones, so that elbows bend about SMPL's axis;
    limbs keep their directions, and hands their orientation.
    """
    _, y, z = CMU_ELBOW_AXIS
    turn_33 = rotation.axis_angle_to_matrix(local_BJ33.new_tensor([math.atan2(-z, -y), 0.0, 0.0]))
    found = local_BJ33.clone()
    for side in SIDES:  # bones lie along x, and a turn about x is its own mirror image
        shoulder, elbow, wrist = (POSED_JOINT_NAMES.index(f"{side}_{name}") for name in ("shoulder", "elbow", "wrist"))
        found[:, shoulder] = local_BJ33[:, shoulder] @ turn_33
        found[:, elbow] = turn_33.T @ local_BJ33[:, elbow] @ turn_33
        found[:, wrist] = turn_33.T @ local_BJ33[:, wrist]
    return found
