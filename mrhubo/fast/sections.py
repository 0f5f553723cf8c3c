"""What a description holds: arrays of the human, the networks, the robot, the cost and the confidence, and names.

Legend: J = 21 posed human joints, P of them that are looked at; D directions, V parts that they are seen from, Z bend
axes; A driven joints of the robot, N joints of q, C blocks of joints, U poses to start again from; K steps of a
reading, T turned human joints; X branches, S capsules; I inputs of the networks and F numbers that they see. Those of
legs are in `mrhubo.fast.leg_section`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

LIMB, BEND, SHARE, ORIENT = range(4)
"""Kinds of steps of a reading."""

Layers = tuple[tuple[np.ndarray, np.ndarray], ...]
"""Weights (out, in) and biases (out,) of layers, float32."""


@dataclass(frozen=True)
class Human:
    """From local rotations to directions (`mrhubo.robot.directions`)."""

    joint_P: np.ndarray
    """Positions among the 21 posed joints."""
    parent_P: np.ndarray
    """Places of their parents: 0 is the lowest joint above all, k + 1 the joint k."""
    view_V: np.ndarray
    """Places of the parts that directions are seen from."""
    place_D: np.ndarray
    """Places of the joints that turn the directions."""
    rest_D3: np.ndarray
    seen_D: np.ndarray
    """Which of the V parts sees each."""
    bend_Z: np.ndarray
    """Which directions are bend axes,"""
    upper_Z: np.ndarray
    """which limb carries each,"""
    lower_Z: np.ndarray
    """and which one bends."""


@dataclass(frozen=True)
class Features:
    """What the networks see (`mrhubo.retargeter.features`): I directions, then what follows from them, or the 6D
    rotations of I joints.
    """

    input_I: np.ndarray
    """Which of the directions, or of the 21 posed joints; what follows are places in these."""
    bend_W: np.ndarray
    """Bend axes,"""
    upper_W: np.ndarray
    """the limbs that carry them,"""
    lower_W: np.ndarray
    """and those that bend."""
    first_O: np.ndarray
    """Pairs of directions whose cosine is seen,"""
    second_O: np.ndarray
    """the second of each."""
    limb_M: np.ndarray
    """Directions seen from limbs: the limb,"""
    axis_M: np.ndarray
    """the bend axis,"""
    seen_M: np.ndarray
    """and the direction."""
    center_F: np.ndarray
    """What all is shifted"""
    scale_F: np.ndarray
    """and scaled by, float32."""


@dataclass(frozen=True)
class Part:
    """A network of one branch."""

    input: np.ndarray
    """Columns of what it sees."""
    output: np.ndarray
    """Columns of what it gives."""
    layers: Layers


@dataclass(frozen=True)
class Universal:
    """The network that is the same for every robot, and its branches here, E of them (`mrhubo.universal`); in place of
    networks of the robot's own.
    """

    block_E: np.ndarray
    """The block of joints that each branch is,"""
    slot_E5: np.ndarray
    """its direction in each slot, -1 where it has none,"""
    view_E: np.ndarray
    """which of the V parts sees its joints' axes,"""
    axial_E3: np.ndarray
    """the signs of these axes,"""
    flip_E53: np.ndarray
    """and those of directions."""
    joint_N: np.ndarray
    """The driven joint that each joint of q itself is,"""
    sense_N: np.ndarray
    """and -1 where its canonical sense of turn is the other one, else 1."""
    size_2: np.ndarray
    """Heads and hypotheses of the network."""
    weights: Mapping[str, np.ndarray]
    """Of its layers, float32, by the names of `mrhubo.universal.network`."""


@dataclass(frozen=True)
class Kinematics:
    """The robot's joints and directions, and how these turn with those (`mrhubo.reference.jacobian`).

    Body 0 is the root; body a + 1 is what the driven joint a carries. A joint stands after those above it.
    """

    parent_A: np.ndarray
    """Body that carries each joint."""
    origin_A34: np.ndarray
    """Rotation and position [m] of the joint in that body's frame."""
    axis_A3: np.ndarray
    rotary_A: np.ndarray
    column_A: np.ndarray
    """Which joint of q drives it,"""
    ratio_A: np.ndarray
    """by how much,"""
    offset_A: np.ndarray
    """from where [rad or m]."""
    limb_D: np.ndarray
    """1 for a limb, which has two ends; 0 for an axis fixed to a body, which is its end."""
    start_body_D: np.ndarray
    start_D3: np.ndarray
    end_body_D: np.ndarray
    end_D3: np.ndarray
    view_body_V: np.ndarray
    view_V33: np.ndarray
    """Columns are left, up and forward of the part, in the body's frame."""
    direction_Q: np.ndarray
    """Pairs Q of a direction"""
    joint_Q: np.ndarray
    """and a driven joint that turns it,"""
    column_Q: np.ndarray
    """the joint of q that drives that one,"""
    factor_Q4: np.ndarray
    """and how it moves the direction's end and start, sees both, and slides."""


@dataclass(frozen=True)
class Cost:
    """What the optimiser's steps make small (`mrhubo.reference.solve`), and where they may start again."""

    lower_N: np.ndarray
    upper_N: np.ndarray
    velocity_N: np.ndarray
    middle_N: np.ndarray
    ridge_N: np.ndarray
    block_N: np.ndarray
    block_D: np.ndarray
    """The block that turns each direction; -1: none does."""
    weight_D: np.ndarray
    partial_D: np.ndarray
    """1 where a direction may count less than in full."""
    pool_UN: np.ndarray
    """Robot poses [rad],"""
    pool_UD3: np.ndarray
    """their directions,"""
    pool_ridge_CU: np.ndarray
    """what they cost beside,"""
    cell_CU: np.ndarray
    """and in which cell of its joints' space each is."""

    @cached_property
    def joints_NC(self) -> np.ndarray:
        """1 where a joint belongs to a block."""
        return (self.block_N[:, None] == np.arange(self._blocks)) * 1.0

    @cached_property
    def directions_DC(self) -> np.ndarray:
        """1 where a direction does."""
        return (self.block_D[:, None] == np.arange(self._blocks)) * 1.0

    @property
    def _blocks(self) -> int:
        return int(self.block_N.max()) + 1


@dataclass(frozen=True)
class Reading:
    """Steps by which a person at rest is turned until the directions are those of a pose, and how far its joints may
    turn (`mrhubo.robot.plausibility`). Slot 0 of joints is the pelvis, which no step turns.
    """

    kind_K: np.ndarray
    slot_K: np.ndarray
    """Which slot a step turns,"""
    of_K: np.ndarray
    """which slot's turn the joint has before it,"""
    seen_K: np.ndarray
    """which slot's turn the directions are seen from,"""
    direction_K3: np.ndarray
    """and the directions that it needs; -1: the joint's own."""
    rest_K23: np.ndarray
    """Where they point at rest."""
    share_K: np.ndarray
    """Which share of the missing turn the step makes."""
    last_K: np.ndarray
    """The slot whose turn is missing."""
    joint_T: np.ndarray
    """The posed joint of each slot but the first,"""
    parent_T: np.ndarray
    """and the slot of the joint above it."""
    axis_T33: np.ndarray
    limit_T32: np.ndarray
    """[rad]"""
    mirror_T: np.ndarray
    """1 for joints on the right."""


@dataclass(frozen=True)
class Prior:
    """The body prior, as far as the joints of a reading need it: the encoder of their numbers, the decoder to them."""

    encoder: Layers
    decoder: Layers
    spaces: tuple[np.ndarray, ...] | None = None
    """For each layer of the encoder, columns (E, R) whose space holds what it reads (`mrhubo.fast.narrowing`), none
    where there is no small one; None: it is to be looked for."""


@dataclass(frozen=True)
class Trust:
    """What confidence is worked out of (`mrhubo.retargeter.confidence`)."""

    column_XD: np.ndarray
    """1 where a branch is measured by a direction."""
    slot_XT: np.ndarray
    """1 where it reads a joint of the reading."""
    measured: np.ndarray
    """Columns of the directions whose error is told."""
    weight_25: np.ndarray
    """Certain, miss, implausible, excess, shake; where a frame rate is known, and where none is."""


@dataclass(frozen=True)
class Capsules:
    """The robot's collision shapes (`mrhubo.robot.collision`)."""

    body_S: np.ndarray
    end_S23: np.ndarray
    """In the body's frame [m]."""
    radius_S: np.ndarray
    pair_Y2: np.ndarray
    """Pairs Y that must not touch."""


@dataclass(frozen=True)
class Settings:
    """Names, and the numbers that are no arrays."""

    robot: str
    joint_names: tuple[str, ...]
    direction_names: tuple[str, ...]
    branch_names: tuple[str, ...]
    features: str
    """`directions` or `local`: what the networks see."""
    bound: str
    """`tanh` or `clamp`."""
    residual: bool
    activation: str
    """Of the prior."""
    constants: Mapping[str, float]
    """Numbers of the optimiser and of the confidence, by name."""
    own_rest: bool
    """Whether the human's rest pose is mrhubo's own."""
    facts: Mapping[str, Any]
    """Who made it, its checksum, and the robot's other joints (`mrhubo.robot_motion.RobotFacts`)."""
    collision_known: bool = True
    """Whether no collision shape is missing of what moves: else nobody knows whether the robot touches itself."""


SECTIONS: dict[str, type] = {
    "human": Human,
    "features": Features,
    "kinematics": Kinematics,
    "cost": Cost,
    "reading": Reading,
    "trust": Trust,
    "capsules": Capsules,
}
"""Parts of a description that hold arrays alone."""
