"""What a person's motion tells of a robot's root: the path, scaled by the legs' length, and when feet are planted.

World of this room: the human's, x left, y up, z forward; m. The floor is at y = 0.

Legend: T frames, P points of soles, D directions.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import normalize

from mrhubo.errors import InputWarning, UserError
from mrhubo.fast.plain.contacts import LIES, STANDS
from mrhubo.fast.roots import FAR_M, without_jumps
from mrhubo.motion.contacts import FootContacts, find_contacts, root_scale
from mrhubo.motion.motion import SOLE_POINTS, Motion
from mrhubo.motion.poses import NOT_FINITE, are_crooked, refuse_frames
from mrhubo.reference.standing.legs import Legs
from mrhubo.robot.bending import smooth_share

_LOWEST = 0.02
"""Share of the frames in which the body may be under a floor that no sole tells."""
_MANY = 0.05
"""Share of the frames with a jump from which on something else must be wrong."""


@dataclass(frozen=True)
class HumanSteps:
    """Of one motion."""

    turn_T33: Tensor
    """Human axes that what carries the robot's legs is to have, in the world: the person's, or as the config says."""
    path_T3: Tensor
    """The root on the person's path, made to fit the skeleton's legs, and scaled to the robot's."""
    contacts: FootContacts
    frame_rate: float
    place_TP3: np.ndarray
    """The person's own points, where the skeleton's are with the root's way made to fit."""

    def raised(self, lift_T: np.ndarray) -> HumanSteps:
        """The same with a path that is so much higher (T,) [m]."""
        path_T3 = self.path_T3.clone()
        path_T3[:, 1] += torch.from_numpy(lift_T).to(path_T3)
        return replace(self, path_T3=path_T3)


def read_steps(motion: Motion, local_TJ33: Tensor, legs: Legs, as_seen: Motion | None = None) -> HumanSteps | None:
    """The steps of a person; None where the motion tells no root, or the robot has no feet.

    Args:
        motion: tells the root and the frame rate.
        local_TJ33: its rotations (T, 21, 3, 3), for the legs' skeleton.
        legs: the robot's.
        as_seen: the motion before its pelvis was made steady (`mrhubo.motion.steady`), which moves feet by millimetres;
            it tells when they are planted. None: there is no other.

    Raises:
        UserError: the root holds NaN, infinite numbers or places out of this world; says in which frame.
    """
    if not legs.has_feet or not has_root(motion) or not len(motion):
        return None
    root_T33, way_T3 = motion_root(motion, local_TJ33, legs)
    _warn_of_jumps(as_seen or motion)
    points_TK3, turns_TJ33 = legs.body_map.skeleton.keypoints_and_rotations(local_TJ33)
    world_TK3 = points_TK3 @ root_T33.mT + way_T3[:, None]
    soles_TP3 = world_TK3[:, legs.contacts]
    if as_seen is not None and as_seen is not motion and as_seen.root_rotation_T33 is not None:
        skeleton = legs.body_map.skeleton
        points_TK3 = skeleton.keypoints(as_seen.for_skeleton(skeleton).local_TJ33.to(local_TJ33))
        soles_TP3 = points_TK3[:, legs.contacts] @ as_seen.root_rotation_T33.to(local_TJ33).mT + way_T3[:, None]
    place_TP3 = soles_TP3.double().cpu().numpy()
    human_T3, given_TP = legs.human_root(world_TK3), given_contacts(motion, legs)
    root_T = human_T3[:, 1].double().cpu().numpy()
    floor = None
    if given_TP is None and not (place_TP3[..., 1] < root_T[:, None]).any():  # who stands on the hands throughout
        floor = float(np.quantile(world_TK3[..., 1].amin(dim=1).double().cpu().numpy(), _LOWEST))
    contacts = find_contacts(place_TP3, motion.frame_rate, floor, given_TP, root_T)
    path_T3 = human_T3 - world_TK3.new_tensor([0.0, contacts.floor, 0.0])
    return HumanSteps(
        root_T33 @ legs.asked(local_TJ33, turns_TJ33), legs.scale * path_T3, contacts, motion.frame_rate, place_TP3
    )


def has_root(motion: Motion) -> bool:
    """Whether a motion tells where its root is and how it is turned."""
    return motion.root_rotation_T33 is not None and motion.root_position_T3 is not None


def given_contacts(motion: Motion, legs: Legs) -> np.ndarray | None:
    """Which points of soles (T, P) a motion says are planted; None: it does not say."""
    contact_T4 = motion.arrays.contact_T4
    if contact_T4 is None:
        return None
    columns = [SOLE_POINTS.index(name) for sole in legs.soles for name in sole.part.stands]
    return np.asarray(contact_T4, dtype=bool)[:, columns]


def motion_root(motion: Motion, local_TJ33: Tensor, legs: Legs, keep_height: bool = False) -> tuple[Tensor, Tensor]:
    """Rotation (T, 3, 3) and place (T, 3) [m] of a motion's root, whose way has no jumps (`mrhubo.fast.roots`, which
    tells of `keep_height`), and is made to fit the skeleton's legs.

    Raises:
        UserError: as for `read_steps`.
    """
    root_T33, root_T3 = motion.root_rotation_T33, motion.root_position_T3
    assert root_T33 is not None and root_T3 is not None
    frames = len(local_TJ33)
    if root_T33.shape != (frames, 3, 3) or root_T3.shape != (frames, 3):
        found = f"{tuple(root_T33.shape)} and {tuple(root_T3.shape)}"
        raise UserError(
            f"{motion.name}: its root must be a rotation ({frames}, 3, 3) and a place ({frames}, 3) [m], found {found}"
        )
    for wrong_T, what in (
        (~(root_T33.flatten(1).isfinite().all(dim=1) & root_T3.isfinite().all(dim=1)), f"a root of {NOT_FINITE}"),
        (are_crooked(root_T33), "a root whose matrix is no rotation"),
        (root_T3.abs().amax(dim=1) > FAR_M, f"a root farther than {FAR_M / 1000:.0f} km from the origin"),
    ):
        refuse_frames(wrong_T, what)
    if len(root_T3):
        root_T3 = torch.from_numpy(without_jumps(root_T3.double().cpu().numpy(), motion.frame_rate, keep_height)[0])
    root_T33, root_T3 = root_T33.to(local_TJ33), root_T3.to(local_TJ33)
    turned_TP3 = legs.body_map.skeleton.keypoints(local_TJ33)[:, legs.contacts] @ root_T33.mT
    soles_TP3, way_T3 = (x.double().cpu().numpy() for x in (turned_TP3, root_T3))
    return root_T33, root_scale(soles_TP3, way_T3, motion.frame_rate) * root_T3


def _warn_of_jumps(motion: Motion) -> None:
    place_T3 = motion.arrays.root_position_T3
    if place_T3 is None:
        return
    far_T = np.linalg.norm(without_jumps(place_T3, motion.frame_rate)[1], axis=1)
    if not far_T.any():
        return
    count, frame = int((far_T > 0).sum()), int(far_T.argmax())
    jumps = "jumps" if count == 1 else f"jumps {count} times, the most"
    doubt = "; are its numbers metres, and is the frame rate right?" if count > _MANY * len(far_T) else ""
    warnings.warn(
        f"{motion.name}: the root {jumps} by {far_T[frame]:.3g} m to frame {frame}, counted from 0, faster than "
        f"anybody goes; the robot goes on from where it is{doubt}",
        InputWarning,
        stacklevel=3,
    )


def flatten(target_TD3: Tensor, steps: HumanSteps, legs: Legs) -> Tensor:
    """Directions (T, D, 3) whose planted feet stand flat: as far as rear and front of a sole that faces the floor are
    planted, its up is the world's.
    """
    up_T3 = steps.turn_T33[:, 1].to(target_TD3)  # the world's up, seen from what carries the legs
    return stand_flat(target_TD3, up_T3, torch.from_numpy(steps.contacts.weight_TP).to(target_TD3), legs)


def stand_flat(target_TD3: Tensor, up_T3: Tensor, weight_TP: Tensor, legs: Legs) -> Tensor:
    """The same, told the world's up (T, 3) as directions see it, and how much points of soles are planted (T, P)."""
    found_TD3, names = target_TD3.clone(), legs.body_map.direction_names
    for number, sole in enumerate(legs.soles):
        ahead, above = (names.index(name) for name in sole.part.direction_names)
        facing_T1 = (target_TD3[:, above] * up_T3).sum(-1, keepdim=True)
        share_T1 = weight_TP[:, 2 * number : 2 * number + 2].amin(dim=1, keepdim=True) * _standing_share(facing_T1)
        upright_T3 = normalize(torch.lerp(target_TD3[:, above], up_T3, share_T1), dim=-1)
        forward_T3 = target_TD3[:, ahead]
        forward_T3 = forward_T3 - upright_T3 * (forward_T3 * upright_T3).sum(-1, keepdim=True)
        found_TD3[:, above], found_TD3[:, ahead] = upright_T3, normalize(forward_T3, dim=-1)
    return found_TD3


def _standing_share(up_X: Tensor) -> Tensor:
    """As `mrhubo.fast.plain.contacts.standing_share`."""
    return smooth_share((up_X - LIES) / (STANDS - LIES))
