"""Where a robot with feet stands and goes, frame by frame, for one person: as `mrhubo.streaming.ground`, where the
reasons stand.

World: the human's, x left, y up, z forward; m. The floor is at y = 0.

Legend: H points of soles, R feet, L human joints, J = 21 posed joints or balls of soles, D directions, N joints.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from mrhubo.fast.description import Description
from mrhubo.fast.leg_section import Legs
from mrhubo.fast.plain.contacts import LiveContacts, next_contacts, standing_share
from mrhubo.fast.plain.human import cross, norm, normalize
from mrhubo.fast.plain.robot import Placed, place
from mrhubo.fast.plain.soles import carrier, turned_points

RETURN_S, RETURN_SPEED = 1.5, 0.1
"""Time constant [s] with which the root returns to the person's path, and how fast it does at most [m/s]."""
SETTLE_S, USUAL_S = 0.1, 2.0
"""Time constants [s] with which the root comes to the height at which planted legs point as the person's, or, where
nothing is planted, to its usual height; and with which it is found what is usual."""
PLANTED = 500.0
"""Weight [1/m^2] of a planted point's place. Of a whole motion it is five times that: there, legs alone keep the foot
that does not carry the root."""
FREE = 1.0
"""Weight [1/m^2] of a swinging point's place, which directions tell as well."""
UNDER_M = 0.01
"""How far under the floor [m] a swinging point counts as much as a planted one."""
FLAT = [0, 2]
"""The horizontal axes of the world."""
UP = 1
WORLD = [2, 0, 1]
"""Coordinates of the human's world in the order of the robot's: x forward, y left, z up."""


class Seen(NamedTuple):
    """A person with a root, in one frame."""

    local_J33: np.ndarray
    """Local rotations, float32."""
    turn_33: np.ndarray
    """Rotation of the root in the world, float64."""
    place_3: np.ndarray
    """Where it is [m]."""
    given_H: np.ndarray | None = None
    """Which points of soles are planted, where that is known."""


class Base(NamedTuple):
    """Where a robot's base is, in its world: x forward, y left, z up."""

    place_3: np.ndarray
    """[m]"""
    turn_33: np.ndarray


class Stance(NamedTuple):
    """How a robot stands or goes after a frame."""

    base: Base
    weight_H: np.ndarray
    """How much the contact of each point of a sole counts, 0..1."""
    q_N: np.ndarray
    """Joint angles [rad] with which the base is there, float64."""


@dataclass(frozen=True)
class GroundState:
    """What is remembered of the ground."""

    contacts: LiveContacts
    """Of one person."""
    held_H: np.ndarray
    """Which points are in the contact in which they were in the last frame."""
    path_3: np.ndarray
    """The person's root in the person's world, scaled."""
    turn_33: np.ndarray
    """Human axes of what carries the legs, in the world."""
    off_3: np.ndarray
    """What the robot's root is off the path."""
    usual: float
    """How high it is over the path, usually."""
    pointing_H3: np.ndarray
    """Where soles would be from the root, if legs pointed as the person's do, along the world's axes."""
    anchor_H2: np.ndarray
    """Where each point has been planted, on the floor."""
    above_H: np.ndarray
    """How far each point of the robot's soles was over what is lowest there [m]."""
    known: bool
    """Whether somebody has been seen."""

    @classmethod
    def none(cls, points: int) -> GroundState:
        """Nobody has been seen."""
        contacts, zeros_3 = LiveContacts.none(1, points), np.zeros(3)
        return cls(contacts, contacts.planted_BP[0], zeros_3, np.eye(3), zeros_3, 0.0, np.zeros((points, 3)),
                   np.zeros((points, 2)), np.zeros(points), False)  # fmt: skip


class PlainGround:
    """The floor under one robot. `look` or `pass_by`, then `stand`, in every frame."""

    def __init__(self, description: Description, longest_step: float, floor: float | None = None) -> None:
        """`longest_step`: who was not seen for longer [s] goes on from where the robot is; `floor`: its height [m] in
        the person's world, None: it is learned.
        """
        assert description.legs is not None, "who has no feet stands on no floor"
        self._description, self._legs = description, description.legs
        self._longest_step, self._floor = longest_step, floor
        self._state = GroundState.none(len(self._legs.body_H))

    @property
    def planted_R(self) -> np.ndarray:
        """Whether each foot is planted."""
        return self._state.contacts.planted_BP[0].reshape(-1, 2).any(axis=1)

    @property
    def weight_H(self) -> np.ndarray:
        """How much the contact of each point of a sole counts, 0..1."""
        return self._state.contacts.weight_BP[0]

    def pass_by(self) -> None:
        """Nobody is seen in this frame: contacts stay as they are."""
        self._state = replace(self._state, held_H=self._state.contacts.planted_BP[0])

    def look(self, seen: Seen, aim_D3: np.ndarray, turn_33: np.ndarray, passed: float) -> tuple[np.ndarray, np.ndarray]:
        """What the frame asks for: directions (D, 3) whose planted feet stand flat, and the same with the places of
        soles after them (D + 2 H, 3), as `mrhubo.fast.plain.soles` has it.

        Args:
            seen: the person.
            aim_D3: directions, filtered.
            turn_33: human axes of what carries the legs, in the world, filtered.
            passed: time since the person was last seen [s].
        """
        last, legs = self._state, self._legs
        root_3, sole_H3 = person_points(legs, seen)
        given_1H = None if seen.given_H is None else seen.given_H[None]
        contacts = next_contacts(
            last.contacts, sole_H3[None], np.array([passed]), self._floor, given_1H, root_3[None, UP]
        )
        held_H = (last.contacts.planted_BP & contacts.planted_BP & ~contacts.began_BP)[0]
        aim_D3 = stand_flat(legs, aim_D3, turn_33[UP], contacts.weight_BP[0])
        state = replace(last, contacts=contacts, held_H=held_H, path_3=legs.scale_1[0] * root_3, turn_33=turn_33)
        self._state, wanted_H3, weight_H = self._ask(last, state, aim_D3, passed)
        weight_H3 = np.zeros_like(wanted_H3)
        weight_H3[:, 0] = weight_H
        return aim_D3, np.concatenate((aim_D3, wanted_H3, weight_H3))

    def _ask(
        self, last: GroundState, state: GroundState, aim_D3: np.ndarray, passed: float
    ) -> tuple[GroundState, np.ndarray, np.ndarray]:
        """Where the root is to go; places of soles (H, 3) [m], seen from what carries the legs, and their weights."""
        legs, contacts = self._legs, state.contacts
        pointing_H3 = pointing(legs, aim_D3) @ state.turn_33.T
        weight_H, whole = contacts.weight_BP[0], float(contacts.weight_BP.sum())
        if passed > self._longest_step:
            moved_3 = last.path_3 - state.path_3
        else:
            moved_H3 = last.path_3 + last.pointing_H3 - state.path_3 - pointing_H3
            moved_3 = weight_H @ moved_H3 / max(whole, 1.0)
        off_3, step = last.off_3 + moved_3, min(passed, self._longest_step)
        off_3[FLAT] -= _back(off_3[FLAT], step)
        share = min(whole, 1.0)
        level = float(weight_H @ (last.above_H - (state.path_3 + pointing_H3)[:, UP])) / max(whole, 1e-9)
        begun = level if share > 0 else -legs.scale_1[0] * contacts.floor_B[0]
        usual = last.usual if last.known else begun
        usual += share * (1 - np.exp(-step / USUAL_S)) * (level - usual)
        height = usual + share * (level - usual)
        off_3[UP] += (1 - np.exp(-step / SETTLE_S)) * (height - off_3[UP])
        off_3 = off_3 if last.known else np.array([0.0, begun, 0.0])
        state = replace(state, off_3=off_3, usual=usual, pointing_H3=pointing_H3, known=True)
        root_3 = state.path_3 + off_3
        wanted_H3 = root_3 + pointing_H3
        under_H = np.maximum(-wanted_H3[:, UP], 0.0)
        wanted_H3[:, UP] += under_H
        planted_H = contacts.planted_BP[0]
        wanted_H3[:, UP] = np.where(planted_H, last.above_H, wanted_H3[:, UP])
        wanted_H3[:, FLAT] = np.where(state.held_H[:, None], last.anchor_H2, wanted_H3[:, FLAT])
        counts_H = np.maximum(weight_H, np.minimum(under_H / UNDER_M, 1.0))
        return state, (wanted_H3 - root_3) @ state.turn_33, FREE + (PLANTED - FREE) * counts_H

    def stand(self, q_N: np.ndarray) -> Base:
        """Where the robot's base is, for joint angles (N,) [rad] as they turn out."""
        state, legs, weight_H = self._state, self._legs, self._state.contacts.weight_BP[0]
        placed = place(self._description.kinematics, q_N[None].astype(np.float64))
        axes_33, from_3 = (found[0] for found in carrier(legs, placed))
        turn_33 = axes_33 @ state.turn_33.T  # from the base to the world's axes, rows times it
        point_H3 = (turned_points(placed, legs.body_H, legs.point_H3)[0] - from_3) @ turn_33
        height_J = self._heights(placed, from_3, turn_33)
        low_H = np.where(legs.near_HJ > 0, height_J, np.inf).min(axis=1)
        whole = float(weight_H.sum())
        rest = max(1.0 - whole, 0.0)
        planned_3 = state.path_3 + state.off_3
        anchor_H2 = np.where(state.held_H[:, None], state.anchor_H2, (planned_3 + point_H3)[:, FLAT])
        root_3 = planned_3.copy()
        root_3[FLAT] = (weight_H @ (anchor_H2 - point_H3[:, FLAT]) + rest * planned_3[FLAT]) / (whole + rest)
        rise = (-float(weight_H @ low_H) + rest * planned_3[UP]) / (whole + rest)
        root_3[UP] = max(rise, -height_J.min())  # nothing is under the floor
        # What is hardly planted yet, or no more, goes along; what is planted stays.
        anchor_H2 = anchor_H2 + (1.0 - weight_H[:, None]) * ((root_3 + point_H3)[:, FLAT] - anchor_H2)
        self._state = replace(state, off_3=root_3 - state.path_3, anchor_H2=anchor_H2, above_H=point_H3[:, UP] - low_H)
        base_33 = state.turn_33[WORLD] @ axes_33.T
        return Base(root_3[WORLD] - base_33 @ from_3, base_33)

    def _heights(self, placed: Placed, from_3: np.ndarray, turn_33: np.ndarray) -> np.ndarray:
        """How high the lowest point of each ball (J,) is over the root [m]."""
        legs = self._legs
        ball_J3 = (turned_points(placed, legs.ball_body_J, legs.ball_J3)[0] - from_3) @ turn_33
        return ball_J3[:, UP] - legs.radius_J


def person_points(legs: Legs, seen: Seen) -> tuple[np.ndarray, np.ndarray]:
    """A person's root (3,), between the legs' first joints, and points of soles (H, 3) [m] in the world."""
    turn_L33, place_L3 = np.empty((len(legs.joint_L) + 1, 3, 3)), np.zeros((len(legs.joint_L) + 1, 3))
    turn_L33[0], local_L33 = seen.turn_33, seen.local_J33[legs.joint_L].astype(np.float64)
    place_L3[0] = seen.place_3
    for joint, parent in enumerate(legs.parent_L):
        turn_L33[joint + 1] = turn_L33[parent] @ local_L33[joint]
        place_L3[joint + 1] = place_L3[parent] + turn_L33[parent] @ legs.offset_L3[joint]
    sole_H3 = place_L3[legs.sole_H] + (turn_L33[legs.sole_H] @ legs.sole_H3[..., None])[..., 0]
    return place_L3[legs.start_R].mean(axis=0), sole_H3


def pointing(legs: Legs, aim_D3: np.ndarray) -> np.ndarray:
    """Where points of soles are (H, 3) [m] if legs point as directions say, seen from what carries them, from the
    root: of their lengths alone, whatever joints can do.
    """
    ankle_R3 = legs.hip_R3 + (legs.length_R2[..., None] * aim_D3[legs.limb_R2]).sum(axis=1)
    forward_R3, up_R3 = aim_D3[legs.foot_R2[:, 0]], aim_D3[legs.foot_R2[:, 1]]
    axes_R33 = np.stack((forward_R3, up_R3, cross(up_R3, forward_R3)), axis=1)
    return (ankle_R3[:, None] + legs.built_R23 @ axes_R33).reshape(-1, 3)


def stand_flat(legs: Legs, aim_D3: np.ndarray, up_3: np.ndarray, weight_H: np.ndarray) -> np.ndarray:
    """Directions (D, 3) whose planted feet stand flat: as far as rear and front of a sole that faces the floor are
    planted, its up is the world's, `up_3` as directions see it.
    """
    found_D3, (ahead_R, above_R) = aim_D3.copy(), legs.foot_R2.T
    share_R1 = (weight_H.reshape(-1, 2).min(axis=1) * standing_share(aim_D3[above_R] @ up_3))[:, None]
    upright_R3 = normalize(aim_D3[above_R] + share_R1 * (up_3 - aim_D3[above_R]))
    forward_R3 = aim_D3[ahead_R]
    forward_R3 = forward_R3 - upright_R3 * (forward_R3 * upright_R3).sum(-1, keepdims=True)
    found_D3[above_R], found_D3[ahead_R] = upright_R3, normalize(forward_R3)
    return found_D3


def _back(off_2: np.ndarray, passed: float) -> np.ndarray:
    """How much of what the root is off the path is taken out [m]."""
    back_2 = off_2 * (1 - np.exp(-passed / RETURN_S))
    return back_2 * min(1.0, RETURN_SPEED * passed / max(float(norm(back_2)), 1e-12))
