"""The same motion with its rotations shared out differently among the joints, as other people's files have them.

Every source of human motion has a habit of its own: whether collars move, how much of the forearm's twist is put into
the shoulder, the elbow or the wrist, which of the three spine joints bends. None of it shows in where limbs point and
how chest, head, hands and feet are turned, which is all that a robot can imitate. `reshare` draws another habit, so
that one can measure whether an answer depends on it.

Kept, to float accuracy: how chest, head, wrists, ankles and feet are turned relative to the pelvis, and the directions
of upper arms, forearms, thighs and shins. What changes, because nobody's limb shows it, is the twist of upper arm and
forearm (and of thigh and shin) about their own bones: an elbow is no hinge any longer, and a straight arm no longer
tells in which plane it is going to bend. Points move where a turned collar, neck or spine joint carries them: an arm as
a whole with its shoulder, by up to the length of the collar's bone.

Legend: T frames, J = 21: SMPL's joints 1..21.
"""

from __future__ import annotations

import dataclasses
import math

import torch
from torch import Tensor

from mrhubo.body.skeleton import KEYPOINT_NAMES, PARENTS, SIDES, Skeleton, joint_index, local_rotations
from mrhubo.motion.motion import Motion
from mrhubo.rotation import axis_angle_to_matrix, matrix_to_axis_angle, orthonormal, random_axes

_SLOWEST_HZ, _FASTEST_HZ = 0.02, 0.15
"""How fast a habit drifts [1/s]. At 0.15 Hz an angle whose range is 40 degrees turns at most 19 degrees a second, far
slower than a person moves, so that no jump comes in that was not there."""
_STEADY = 0.5
"""Share of a range that a habit's constant part takes; what drifts takes the rest."""
_TWISTED = (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
"""Joints that turn a limb, and the points where it ends: such a joint's own frame may turn about its limb unseen."""
_ARM = ("shoulder", "elbow")
_CURVE = math.radians(10.0)


def reshare(
    motion: Motion,
    seed: int,
    collar_deg: float = 40.0,
    arm_twist_deg: float = 40.0,
    leg_twist_deg: float = 15.0,
    split: float = 1.0,
) -> Motion:
    """The motion with another habit of sharing rotations out; the same seed gives the same numbers.

    Args:
        motion: what is done, by anybody.
        seed: of all that is drawn.
        collar_deg: up to how far each collar turns [deg] away from where it was, about any axis.
        arm_twist_deg: up to how much twist [deg] goes from one to the other of collar, shoulder, elbow and wrist. An
            elbow's change is that of its own frame against the shoulder's, up to twice as much.
        leg_twist_deg: the same for hip, knee and ankle.
        split: 0..1, how much of the spine's and of the neck's turn is shared out anew: 0 leaves it as it is; 1 gives
            each of spine1..3, and of neck and head, a share of the whole turn that is drawn at random, and curves both
            by up to 10 degrees a joint, as a straight back is curved in many files.
    """
    generator = torch.Generator().manual_seed(seed)
    seconds_T = torch.arange(len(motion), dtype=torch.float64) / motion.frame_rate
    skeleton = Skeleton().double()
    local_TJ33 = orthonormal(motion.local_TJ33.double())
    before = skeleton.global_rotations(local_TJ33)
    after = before.clone()
    for chain in (("spine1", "spine2", "spine3"), ("neck", "head")):
        _split(after, chain, split, seconds_T, generator)
    rest_K3 = skeleton.rest_K3
    for side in SIDES:
        for name, end in _TWISTED:
            joint, tip = joint_index(f"{side}_{name}"), KEYPOINT_NAMES.index(f"{side}_{end}")
            bone_3 = torch.nn.functional.normalize(rest_K3[tip] - rest_K3[joint], dim=0)
            most = math.radians(arm_twist_deg if name in _ARM else leg_twist_deg)
            twist_T = most * _drift(seconds_T, generator)
            after[:, joint] = before[:, joint] @ axis_angle_to_matrix(twist_T[:, None] * bone_3)
        collar = joint_index(f"{side}_collar")
        turn_T3 = math.radians(collar_deg) * _drift(seconds_T, generator)[:, None] * _axis(generator)
        after[:, collar] = before[:, collar] @ axis_angle_to_matrix(turn_T3)
    source = f"{motion.source}, re-shared".lstrip(", ")
    return dataclasses.replace(motion, local_TJ33=local_rotations(after).float(), source=source)


def _split(
    rotation_TJ33: Tensor, chain: tuple[str, ...], split: float, seconds_T: Tensor, generator: torch.Generator
) -> None:
    """Shares the turn between a chain's root and its last joint out anew among its joints; changes all but the last."""
    joints = [joint_index(name) for name in chain]
    root_T33 = rotation_TJ33[:, PARENTS[joints[0]]]
    whole_T3 = matrix_to_axis_angle(root_T33.mT @ rotation_TJ33[:, joints[-1]])
    weights = torch.stack([torch.exp(1.5 * _drift(seconds_T, generator)) for _ in joints])
    reached = (weights / weights.sum(dim=0)).cumsum(dim=0)
    for joint, share_T in zip(joints[:-1], reached, strict=False):
        curve_T3 = _CURVE * _drift(seconds_T, generator)[:, None] * _axis(generator)
        new_T33 = root_T33 @ axis_angle_to_matrix(share_T[:, None] * whole_T3) @ axis_angle_to_matrix(curve_T3)
        way_T3 = matrix_to_axis_angle(rotation_TJ33[:, joint].mT @ new_T33)
        rotation_TJ33[:, joint] = rotation_TJ33[:, joint] @ axis_angle_to_matrix(split * way_T3)


def _axis(generator: torch.Generator) -> Tensor:
    """A unit vector (3,) of any direction."""
    return random_axes(generator=generator, dtype=torch.float64)


def _drift(seconds_T: Tensor, generator: torch.Generator) -> Tensor:
    """Numbers (T,), -1..1: a constant, and three slow waves."""
    steady, *waves = torch.rand(4, generator=generator, dtype=torch.float64) * 2 - 1
    frequencies = torch.rand(3, generator=generator, dtype=torch.float64)
    drift_T = torch.zeros_like(seconds_T)
    for phase, share in zip(waves, frequencies, strict=True):
        hertz = _SLOWEST_HZ + (_FASTEST_HZ - _SLOWEST_HZ) * share
        drift_T = drift_T + torch.sin(2 * math.pi * hertz * seconds_T + math.pi * phase) / 3
    return _STEADY * steady + (1 - _STEADY) * drift_T
