"""Where feet are planted: round spots on the floor, under points of a person's soles and under a robot's feet.

Legend: T frames, P spots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.robot.soles import soles_of
from mrhubo.viewer.performance import Performance
from mrhubo.viewer.person import SOLE_POINTS, Person
from mrhubo.viewer.stage import Standing

SPOT_COLOR = (0.85, 0.51, 0.17)
"""RGB, 0..1."""
SPOT_HEIGHT_M = 0.004
_POINT_M = 0.045
"""Radius of a spot under a point."""
_MARGIN_M = 0.04
"""How far a spot is seen around a foot."""
_ABOVE_M = 0.002
"""The middle of a spot above the floor."""


@dataclass(frozen=True)
class Spots:
    """Spots of one figure."""

    names: tuple[str, ...]
    """Of the points, or of the feet."""
    place_TP3: np.ndarray
    """Their middles [m] in the world of the stage."""
    radius_P: np.ndarray
    """[m]."""
    planted_TP: np.ndarray
    """Whether each is to be seen."""


def spots_of(figure: Person | Performance, standing: Standing) -> Spots | None:
    """The spots of a figure where it stands; None where nobody tells when its feet are planted, or where they are."""
    found = _of_person(figure, standing) if isinstance(figure, Person) else _of_robot(figure, standing)
    if found is not None:
        found.place_TP3[..., 2] = _ABOVE_M
    return found


def _of_person(person: Person, standing: Standing) -> Spots | None:
    if person.planted_TP is None:
        return None
    turn_T33 = standing.pose_T44[:, :3, :3] @ person.root_T33.swapaxes(-1, -2)
    apart_TP3 = person.soles_TP3 - person.root_T3[:, None]
    place_TP3 = standing.pose_T44[:, None, :3, 3] + apart_TP3 @ turn_T33.swapaxes(-1, -2)
    return Spots(SOLE_POINTS, place_TP3, np.full(len(SOLE_POINTS), _POINT_M), person.planted_TP)


def _of_robot(robot: Performance, standing: Standing) -> Spots | None:
    """A foot has one spot, as large as its sole: the answer tells of feet, and not of their points."""
    motion, keypoints = robot.motion, robot.robot.keypoints
    if motion.contact is None or keypoints is None:
        return None
    soles = [s for s in soles_of(keypoints, robot.robot.description) if s.part.name in motion.contact_names]
    if not soles:
        return None
    links, poses_TL44 = robot.links()
    pose_TP44 = standing.pose_T44[:, None] @ poses_TL44[:, [links.index(sole.link) for sole in soles]]
    middle_P3 = robot.scale * np.array([(sole.rear_3 + sole.front_3) / 2 for sole in soles])
    place_TP3 = np.einsum("tpij,pj->tpi", pose_TP44[..., :3, :3], middle_P3) + pose_TP44[..., :3, 3]
    half_P = robot.scale * np.array([np.linalg.norm(sole.front_3 - sole.rear_3) / 2 for sole in soles])
    names = tuple(sole.part.name for sole in soles)
    planted_TP = motion.contact[:, [motion.contact_names.index(name) for name in names]]
    return Spots(names, place_TP3, half_P + _MARGIN_M, planted_TP)
