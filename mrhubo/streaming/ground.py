"""Where a robot with feet stands and goes, frame by frame: what `mrhubo.reference.standing` is to a whole motion.

A frame in three steps. What the person does: contacts (`mrhubo.fast.plain.contacts`), the root's path scaled by the
legs' length, feet that stand flat while planted. What legs are asked for, beside directions: planted soles stay where
they are while the root goes on; it goes as far as the legs take it, and a little nearer to the person's path in every
frame, so that nothing adds up. What comes of it: with the joint angles that limits allow, the root is where planted
feet stay in their places. So a foot on which the robot stands cannot slide.

World: the human's, x left, y up, z forward; m. The floor is at y = 0.

Legend: B people, P points of soles, D directions, N joints.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
import torch
from torch import Tensor

from mrhubo.fast.plain.contacts import LiveContacts, next_contacts
from mrhubo.fast.plain.ground import FLAT, FREE, PLANTED, RETURN_S, RETURN_SPEED, SETTLE_S, UNDER_M, UP, USUAL_S
from mrhubo.frames import human_to_world
from mrhubo.reference.standing import Standing, stand_flat
from mrhubo.robot import LinkPoses


@dataclass(frozen=True)
class Seen:
    """People with a root, in one frame."""

    local_BJ33: Tensor
    turn_B33: Tensor
    """Rotation of the root in the world."""
    place_B3: Tensor
    """Where it is [m]."""
    given_BP: np.ndarray | None = None
    """Which points of soles are planted, where that is known."""


@dataclass(frozen=True)
class GroundState:
    """What is remembered of the ground; NumPy's arrays are float64."""

    contacts: LiveContacts
    path_B3: np.ndarray
    """The person's root in the person's world, scaled."""
    turn_B33: Tensor
    """Human axes of what carries the legs, in the world."""
    off_B3: np.ndarray
    """What the robot's root is off the path: upwards, by as much as the person's floor is under 0 and the robot's hips
    lie elsewhere."""
    usual_B: np.ndarray
    """How high it is over the path, usually."""
    pointing_BP3: np.ndarray
    """Where soles would be from the root, if legs pointed as the person's do, along the world's axes."""
    anchor_BP2: np.ndarray
    """Where each point has been planted, on the floor."""
    above_BP: np.ndarray
    """How far each point of the robot's soles was over what is lowest there [m]: who stands on a toe stands on its
    round edge, and who kneels, on the instep."""
    root_B3: np.ndarray
    """Where the robot's root is."""
    known_B: np.ndarray
    """Who has been seen."""

    @classmethod
    def none(cls, people: int, points: int, like: Tensor) -> Self:
        """Nobody has been seen."""
        zeros_B3 = np.zeros((people, 3))
        return cls(
            LiveContacts.none(people, points), zeros_B3, torch.eye(3).to(like).expand(people, 3, 3), zeros_B3,
            np.zeros(people), np.zeros((people, points, 3)), np.zeros((people, points, 2)), np.zeros((people, points)),
            zeros_B3, np.zeros(people, dtype=bool),
        )  # fmt: skip

    def where(self, chosen_B: np.ndarray, other: Self) -> Self:
        """`other` for some people, this one for the rest."""
        found = {}
        for field in fields(self):
            mine, others = getattr(self, field.name), getattr(other, field.name)
            if isinstance(mine, LiveContacts):
                found[field.name] = mine.where(chosen_B, others)
            elif isinstance(mine, Tensor):
                found[field.name] = torch.where(torch.from_numpy(chosen_B)[:, None, None].to(mine.device), others, mine)
            else:
                found[field.name] = np.where(chosen_B.reshape(-1, *[1] * (mine.ndim - 1)), others, mine)
        return type(self)(**found)


class Ground:
    """The floor under one robot."""

    def __init__(self, standing: Standing, longest_step: float, floor: float | None = None) -> None:
        """What is worked with.

        Args:
            standing: of the robot.
            longest_step: who was not seen for longer [s] goes on from where the robot is.
            floor: its height [m] in the people's world; None: it is learned.
        """
        self.legs, self.longest_step, self.floor = standing.legs, longest_step, floor
        self._low_body = standing.low_body

    def begin(self, people: int) -> GroundState:
        """Nobody has been seen."""
        return GroundState.none(people, len(self.legs.contacts), self.legs.root_3)

    def carrier(self, seen: Seen) -> tuple[Tensor, Tensor]:
        """A person's keypoints (B, K, 3) [m] from the root, along the world's axes, and the human axes (B, 3, 3) that
        what carries the robot's legs is to have.
        """
        point_BK3, turn_BJ33 = self.legs.body_map.skeleton.keypoints_and_rotations(seen.local_BJ33)
        return point_BK3 @ seen.turn_B33.mT, seen.turn_B33 @ self.legs.asked(seen.local_BJ33, turn_BJ33)

    def look(
        self, state: GroundState, point_BK3: Tensor, turn_B33: Tensor, seen: Seen, passed_B: np.ndarray
    ) -> GroundState:
        """The state with the person's contacts and path of one more frame.

        Args:
            state: the last one.
            point_BK3: as `carrier` has them.
            turn_B33: the axes of what carries the legs, filtered.
            seen: the people.
            passed_B: time since they were last seen [s].
        """
        legs = self.legs
        world_BK3 = point_BK3.double() + seen.place_B3.double()[:, None]
        sole_BP3, root_B3 = _array(world_BK3[:, legs.contacts]), _array(legs.human_root(world_BK3))
        contacts = next_contacts(state.contacts, sole_BP3, passed_B, self.floor, seen.given_BP, root_B3[:, UP])
        return replace(state, contacts=contacts, path_B3=legs.scale * root_B3, turn_B33=turn_B33)

    def level(self, state: GroundState, target_BD3: Tensor) -> Tensor:
        """Directions (B, D, 3) whose planted feet stand flat: as far as rear and front of a sole that faces the floor
        are planted, its up is the world's.
        """
        weight_BP = torch.from_numpy(state.contacts.weight_BP).to(target_BD3)
        return stand_flat(target_BD3, state.turn_B33[:, 1].to(target_BD3), weight_BP, self.legs)

    def ask(
        self, last: GroundState, state: GroundState, target_BD3: Tensor, passed_B: np.ndarray
    ) -> tuple[GroundState, Tensor]:
        """Where the root is to go, and the directions with the places of soles after them, as `SoleTerm` has it.

        Args:
            last: the state before this frame.
            state: what `look` made of it.
            target_BD3: directions, as `level` has them.
            passed_B: time since the last frame [s].
        """
        turn_B33, contacts = state.turn_B33.to(target_BD3), state.contacts
        seen_BP3 = self.legs.pointing(target_BD3)
        pointing_BP3 = _array(seen_BP3 @ turn_B33.mT)
        weight_BP, whole_B1 = contacts.weight_BP, contacts.weight_BP.sum(axis=1)[:, None]
        # Planted feet take the root along; where none is, it goes as the person's does.
        moved_BP3 = last.path_B3[:, None] + last.pointing_BP3 - state.path_B3[:, None] - pointing_BP3
        moved_B3 = (weight_BP[..., None] * moved_BP3).sum(axis=1) / np.maximum(whole_B1, 1.0)
        moved_B3 = np.where((passed_B > self.longest_step)[:, None], last.path_B3 - state.path_B3, moved_B3)
        off_B3 = last.off_B3 + moved_B3
        step_B = np.minimum(passed_B, self.longest_step)
        off_B3[:, FLAT] -= _back(off_B3[:, FLAT], step_B)
        share_B = np.minimum(whole_B1[:, 0], 1.0)
        level_B = (weight_BP * (last.above_BP - (state.path_B3[:, None] + pointing_BP3)[..., UP])).sum(axis=1)
        level_B = level_B / np.maximum(whole_B1[:, 0], 1e-9)
        begun_B = np.where(share_B > 0, level_B, -self.legs.scale * contacts.floor_B)
        usual_B = np.where(last.known_B, last.usual_B, begun_B)
        usual_B = usual_B + share_B * (1 - np.exp(-step_B / USUAL_S)) * (level_B - usual_B)
        height_B = usual_B + share_B * (level_B - usual_B)
        off_B3[:, UP] += (1 - np.exp(-step_B / SETTLE_S)) * (height_B - off_B3[:, UP])
        first_B3 = np.stack((np.zeros_like(begun_B), begun_B, np.zeros_like(begun_B)), axis=1)
        off_B3 = np.where(last.known_B[:, None], off_B3, first_B3)
        root_B3 = state.path_B3 + off_B3
        state = replace(state, off_B3=off_B3, usual_B=usual_B, pointing_BP3=pointing_BP3,
                        known_B=np.ones_like(last.known_B))  # fmt: skip
        wanted_BP3 = root_B3[:, None] + pointing_BP3
        under_BP = np.maximum(-wanted_BP3[..., UP], 0.0)
        wanted_BP3[..., UP] += under_BP
        anchor_BP3 = np.stack((last.anchor_BP2[..., 0], last.above_BP, last.anchor_BP2[..., 1]), axis=-1)
        held_BP1 = (last.contacts.planted_BP & contacts.planted_BP & ~contacts.began_BP)[..., None]
        on_floor_BP3 = np.stack((wanted_BP3[..., 0], last.above_BP, wanted_BP3[..., 2]), axis=-1)
        wanted_BP3 = np.where(held_BP1, anchor_BP3, np.where(contacts.planted_BP[..., None], on_floor_BP3, wanted_BP3))
        counts_BP = np.maximum(weight_BP, np.minimum(under_BP / UNDER_M, 1.0))
        wanted_BP3 = torch.from_numpy(wanted_BP3 - root_B3[:, None]).to(target_BD3) @ turn_B33
        counts_BP3 = torch.zeros_like(wanted_BP3)
        counts_BP3[..., 0] = FREE + (PLANTED - FREE) * torch.from_numpy(counts_BP).to(target_BD3)
        return state, torch.cat((target_BD3, wanted_BP3, counts_BP3), dim=1)

    def stand(self, last: GroundState, state: GroundState, poses: LinkPoses) -> GroundState:
        """The state with the root in its place, for link poses of the joints as they turn out."""
        legs, contacts, weight_BP = self.legs, state.contacts, state.contacts.weight_BP
        seen, turn_B33 = legs.places(poses), state.turn_B33.to(poses.position_BL3)
        point_BP3, ball_BK3 = (_array(place @ turn_B33.mT) for place in (seen.point_BP3, seen.ball_BK3))
        low_BP = legs.lowest(ball_BK3[..., UP])
        whole_B1 = weight_BP.sum(axis=1)[:, None]
        rest_B1 = np.maximum(1.0 - whole_B1, 0.0)
        held_BP1 = (last.contacts.planted_BP & contacts.planted_BP & ~contacts.began_BP)[..., None]
        planned_B3 = state.path_B3 + state.off_B3
        planned_BP2 = (planned_B3[:, None] + point_BP3)[..., FLAT]
        anchor_BP2 = np.where(held_BP1, last.anchor_BP2, planned_BP2)
        flat_B2 = (weight_BP[..., None] * (anchor_BP2 - point_BP3[..., FLAT])).sum(axis=1)
        root_B3 = planned_B3.copy()
        root_B3[:, FLAT] = (flat_B2 + rest_B1 * planned_B3[:, FLAT]) / (whole_B1 + rest_B1)
        rise_B = (-(weight_BP * low_BP).sum(axis=1) + rest_B1[:, 0] * planned_B3[:, UP]) / (whole_B1 + rest_B1)[:, 0]
        up_B3, level_B = turn_B33[:, UP], turn_B33.new_zeros(len(turn_B33))
        lowest_B = low_BP.min(axis=1)
        if self._low_body.near(poses, up_B3, torch.from_numpy(rise_B).to(turn_B33)):
            lowest_B = np.minimum(lowest_B, _array(self._low_body.lowest_of_any(poses, up_B3, level_B)))
        root_B3[:, UP] = np.maximum(rise_B, -lowest_B)  # nothing is under the floor
        # What is hardly planted yet, or no more, goes along; what is planted stays.
        loose_BP1 = 1.0 - weight_BP[..., None]
        anchor_BP2 = anchor_BP2 + loose_BP1 * ((root_B3[:, None] + point_BP3)[..., FLAT] - anchor_BP2)
        above_BP = point_BP3[..., UP] - low_BP
        return replace(state, root_B3=root_B3, off_B3=root_B3 - state.path_B3, anchor_BP2=anchor_BP2, above_BP=above_BP)

    def base(self, state: GroundState, poses: LinkPoses) -> tuple[Tensor, Tensor]:
        """Place (B, 3) [m] and rotation (B, 3, 3) of the robot's base, x forward, y left, z up."""
        root_B3 = human_to_world(torch.from_numpy(state.root_B3).to(poses.position_BL3))
        return self.legs.base(poses, root_B3, state.turn_B33.to(poses.position_BL3))

    def planted(self, state: GroundState) -> np.ndarray:
        """Whether each foot is planted (B, S)."""
        return self.legs.planted(state.contacts.planted_BP)


def _back(off_B2: np.ndarray, passed_B: np.ndarray) -> np.ndarray:
    """How much of what the root is off the path is taken out [m]."""
    back_B2 = off_B2 * (1 - np.exp(-passed_B / RETURN_S))[:, None]
    far_B1 = np.linalg.norm(back_B2, axis=1, keepdims=True)
    return back_B2 * np.minimum(1.0, RETURN_SPEED * passed_B[:, None] / np.maximum(far_B1, 1e-12))


def _array(tensor: Tensor) -> np.ndarray:
    return tensor.double().cpu().numpy()
