"""Legs that are not as a human's, and bases that drive or float; functions as in `odd_parts`."""

from __future__ import annotations

import numpy as np

from mrhubo.robot.generator.limbs import SIDES, Chance
from mrhubo.robot.generator.odd_parts import Angles, Places, place_of
from mrhubo.robot.generator.plan import Plan, X, Y, Z, about


def askew_hips(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Hips whose axes cross in one point, and are turned so that none of them need be parallel to the knee's."""
    axis_3 = np.array([chance.between(-1.0, 1.0), chance.between(-1.0, 1.0), chance.between(-1.0, 1.0)])
    turn_33 = about(np.zeros(3), axis_3, chance.between(0.3, 1.2))[:3, :3]
    angles: Angles = {}
    for name, side in SIDES.items():
        flip_33 = np.diag([1.0, side, 1.0])
        for joint in [joint for joint in plan.joints if joint.role.startswith(f"{name}_hip_")]:
            at_3 = plan.points[f"{name}_hip"][1]
            plan.change(joint.role, point_3=at_3, axis_3=flip_33 @ turn_33 @ flip_33 @ joint.axis_3)
        angles |= {f"{name}_{role}": 0.0 for role in ("hip_pitch", "knee", "ankle_pitch")}
    return angles


def free_knees(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Knees that bend as far forwards as backwards."""
    for name in SIDES:
        if any(joint.role == f"{name}_knee" for joint in plan.joints):
            plan.change(f"{name}_knee", lower=-2.2, upper=2.2)
    return {}


def telescopes(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Legs that grow shorter in place of a knee that bends."""
    for name in SIDES:
        if any(joint.role == f"{name}_knee" for joint in plan.joints):
            plan.change(f"{name}_knee", kind="prismatic", axis_3=Z, lower=0.0, upper=0.2 * places.scale)
    return {f"{name}_{role}": 0.0 for name in SIDES for role in ("hip_pitch", "knee", "ankle_pitch")}


def floating_base(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Three joints that slide and three that turn, by which the pelvis floats in the world."""
    body, at_3 = places.pelvis, place_of(plan, places.pelvis)
    for word, axis_3 in zip("zyx", (Z, Y, X), strict=True):
        body = plan.join(f"floating_turn_{word}", body, at_3, axis_3, (-3.2, 3.2))
    for word, axis_3 in zip("zyx", (Z, Y, X), strict=True):
        body = plan.join(f"floating_{word}", body, at_3, axis_3, (-5.0, 5.0), "prismatic")
    return {}


def planar_base(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Two joints that slide and one that turns, by which the pelvis moves over the ground."""
    body, at_3 = places.pelvis, place_of(plan, places.pelvis) * np.array([1.0, 1.0, 0.0])
    kinds = [("turn", Z, "revolute"), ("y", Y, "prismatic"), ("x", X, "prismatic")]
    for word, axis_3, kind in kinds if chance.maybe(0.7) else kinds[1:] + kinds[:1]:
        limits = None if kind == "revolute" else (-5.0, 5.0)
        body = plan.join(f"floating_{word}", body, at_3, axis_3, limits, kind)
    return {}
