"""What a description holds of a robot with feet: how it stands on the floor.

Legend: R feet, H = 2 R points of their soles (rear and front of each), J balls of soles and of what else can touch the
floor, L human joints on the way to feet, N joints of q, D directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Legs:
    """How a robot with feet stands on the floor (`mrhubo.reference.standing.legs`). Its root is the middle of the
    joints where the legs start, at home, fixed to what carries the legs; so is a person's.
    """

    joint_L: np.ndarray
    """Human joints, as positions among the 21 posed joints,"""
    parent_L: np.ndarray
    """places of their parents: 0 is the pelvis, k + 1 the joint k,"""
    offset_L3: np.ndarray
    """and where they are in their parents' frames [m]."""
    start_R: np.ndarray
    """Places of the joints where a person's legs start,"""
    sole_H: np.ndarray
    """of those that carry the points of a person's soles,"""
    sole_H3: np.ndarray
    """and where these are in their frames [m]."""
    carrier_1: np.ndarray
    """The robot's body that carries the legs,"""
    axes_33: np.ndarray
    """its left, up and forward, as columns,"""
    root_3: np.ndarray
    """and the root, in its frame [m]."""
    body_H: np.ndarray
    """Bodies of points of the robot's soles,"""
    point_H3: np.ndarray
    """and where they are there [m]."""
    ball_body_J: np.ndarray
    """Bodies of what can touch the floor,"""
    ball_J3: np.ndarray
    """centres"""
    radius_J: np.ndarray
    """and radii [m],"""
    near_HJ: np.ndarray
    """and 1 where it is at that end of its sole at which a point is; balls at none are of hands, knees, trunk, head."""
    scale_1: np.ndarray
    """Length of the robot's legs by that of a person's."""
    hip_R3: np.ndarray
    """Where each leg starts, from the root, in the axes of what carries it [m];"""
    limb_R2: np.ndarray
    """directions of its thigh and shin,"""
    length_R2: np.ndarray
    """and their lengths [m];"""
    foot_R2: np.ndarray
    """directions of its foot's forward and up,"""
    built_R23: np.ndarray
    """and rear and front of its sole from the ankle, in its foot's forward, up and left [m]."""
    block_N: np.ndarray
    """As of `Cost`, where the places of soles cost too; more joints may hang together then."""
    block_D: np.ndarray


@dataclass(frozen=True)
class RootTurn:
    """Of a robot whose base is not turned as the person's pelvis: G joints of its waist (`mrhubo.robot.root_turn`)."""

    spine_3: np.ndarray
    """Which of the 21 posed joints turn a person's chest against the pelvis, from there upwards."""
    leg_D: np.ndarray
    """1 for directions that are turned back by what the base does."""
    share_1: np.ndarray
    """How much of what the waist cannot do the base does: 1 or 0.5."""
    axis_G3: np.ndarray
    """Axes of the waist's joints with the robot at home, in the axes of its pelvis, from there upwards,"""
    limit_G2: np.ndarray
    """how far they turn from there [rad],"""
    rest_33: np.ndarray
    """and the axes of its chest there, as columns."""
