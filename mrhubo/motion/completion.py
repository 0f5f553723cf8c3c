"""Bones of a body that no frame shows, as the body prior would have them beside all that is seen.

A gap in time is better filled from before and after (`mrhubo.motion.gaps`): docs/experiments/keypoints.md has the
measurements. What is never seen has no before and after.

Legend: T frames, F of them that are solved, J = 21: SMPL's joints 1..21.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from mrhubo.body.joints import JOINT_NAMES, KEYPOINT_NAMES
from mrhubo.motion.gaps import fill_directions

_RATE = 4.0
"""Frames a second that are solved; between them a bone turns evenly, so that it does not shake."""
_MOST = 1_000
"""Frames that are solved at most: some seconds of work."""


@dataclass(frozen=True)
class Bone:
    """A bone of which nothing is known, from one keypoint to another, and the joint from which it is seen."""

    start: str
    end: str
    carrier: str


def complete(
    local_TJ33: np.ndarray, frame_rate: float, given: Collection[str], bones: Sequence[Bone]
) -> dict[str, np.ndarray]:
    """Directions (T, 3) of bones by the names of their ends, each seen from its carrier, float64. Imports PyTorch.

    Args:
        local_TJ33: a motion of our skeleton that is right in all but these bones.
        frame_rate: its frames per second.
        given: keypoints that the source tells; none of them hangs on these bones.
        bones: those to be found.
    """
    import torch  # by files that need it alone
    from torch.nn.functional import normalize

    from mrhubo.body.latent_ik import inverse_kinematics
    from mrhubo.body.prior import BodyPrior
    from mrhubo.body.skeleton import Skeleton
    from mrhubo.rotation import sixd_to_matrix

    frames, skeleton = len(local_TJ33), Skeleton()
    step = max(1, round(frame_rate / _RATE), -(-frames // _MOST))
    solved_T = np.zeros(frames, dtype=bool)
    solved_T[::step] = solved_T[-1] = True
    seen_FK3 = skeleton.keypoints(torch.from_numpy(local_TJ33[solved_T].astype(np.float32)))
    targets = {name: seen_FK3[:, KEYPOINT_NAMES.index(name)] for name in given}
    pose_FJ33 = sixd_to_matrix(inverse_kinematics(BodyPrior.open(), targets, skeleton))
    point_FK3, turn_FJ33 = skeleton.keypoints_and_rotations(pose_FJ33)
    found = {}
    for bone in bones:
        start_F3, end_F3 = (point_FK3[:, KEYPOINT_NAMES.index(name)] for name in (bone.start, bone.end))
        carrier_F33 = turn_FJ33[:, JOINT_NAMES.index(bone.carrier)]
        seen_F3 = normalize((carrier_F33.mT @ (end_F3 - start_F3)[..., None])[..., 0], dim=-1)
        direction_T3 = np.zeros((frames, 3))
        direction_T3[solved_T] = seen_F3.detach().numpy()
        found[bone.end] = fill_directions(direction_T3, solved_T)
    return found
