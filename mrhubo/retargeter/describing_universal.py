"""The universal network and a robot's branches as the plain arrays of `mrhubo.fast`.

Legend: as in `mrhubo.fast.sections`.
"""

from __future__ import annotations

import numpy as np

from mrhubo.fast.sections import Universal
from mrhubo.retargeter.describing_robot import Bodies, single, whole
from mrhubo.retargeter.universal import UniversalJoints
from mrhubo.universal.slots import SLOTS


def describe_universal(joints: UniversalJoints, bodies: Bodies) -> Universal:
    """Its arrays."""
    optimiser, robot = joints.optimiser, joints.optimiser.problem.robot
    network, parts = optimiser.network, optimiser.branches.parts
    block_N, seen_D = optimiser.problem.blocks.block_N.tolist(), optimiser.problem.body_map.shared.view_D.tolist()
    sense_N = np.ones(len(block_N), np.int64)
    for part in parts:
        sense_N[part.joints_X.tolist()] = whole(part.sense_X)
    first = [next(iter(part.places.values())) for part in parts]
    return Universal(
        block_E=whole([block_N[int(part.joints_X[0])] for part in parts]),
        slot_E5=whole([[part.places.get(slot, -1) for slot in range(len(SLOTS))] for part in parts]).reshape(-1, 5),
        view_E=whole([seen_D[d] for d in first]),
        axial_E3=whole([part.axial_3.tolist() for part in parts]).reshape(-1, 3),
        flip_E53=whole([part.flip_S3.tolist() for part in parts]).reshape(-1, 5, 3),
        joint_N=whole([bodies.joints.index(name) for name in robot.joint_names]),
        sense_N=sense_N,
        size_2=whole([network.heads, network.hypotheses]),
        weights={name: single(tensor) for name, tensor in network.state_dict().items()},
    )
