"""Arms, legs, neck and trunk of random humanoids, as real robots have them.

Arms: with and without clavicles, shoulders whose axes cross or do not, two orders of the swings and one of an
industrial arm, twists at the shoulder or none, elbows before or on the arm's line, none to three joints at the wrist.
Legs: the common orders of the hip, thighs and knees before the line, ankles of two joints, one or none. All in the
planning frame, arms hanging (`plan`).
"""

from __future__ import annotations

import math

import numpy as np

from mrhubo.robot.generator.plan import Plan, X, Y, Z, mirrored

SIDES = {"left": 1.0, "right": -1.0}


class Chance:
    """A seeded source of choices."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)

    def maybe(self, share: float) -> bool:
        """True in that share of the cases."""
        return bool(self.random.random() < share)

    def between(self, low: float, high: float) -> float:
        """A number between two."""
        return float(self.random.uniform(low, high))

    def either(self, *choices):  # noqa: ANN002, ANN201
        """One of several."""
        return choices[int(self.random.integers(len(choices)))]

    def shift(self, share: float, low: float, high: float) -> float:
        """0, or in a share of the cases a number between two, of either sign."""
        return self.between(low, high) * self.either(-1.0, 1.0) if self.maybe(share) else 0.0


def limits(low: float, high: float, side: float) -> tuple[float, float]:
    """Limits of the left side's joint, or those of its mirror image about the mirrored axis."""
    return (low, high) if side > 0 else (-high, -low)


def trunk(chance: Chance, plan: Plan, start: int, height: float, joints: int) -> tuple[int, float]:
    """A waist of some joints upon a body; the chest and the height at which it begins."""
    kinds = list(chance.random.permutation(["yaw", "pitch", "roll"]))[:joints]
    axes = {"yaw": Z, "pitch": Y, "roll": X}
    ranges = {"yaw": (-1.2, 1.2), "pitch": (-0.3, 0.9), "roll": (-0.5, 0.5)}
    step = chance.either(0.0, 0.03, 0.06)
    body = start
    for kind in kinds:
        height += step
        low, high = ranges[kind]
        body = plan.join(f"waist_{kind}", body, np.array([0.0, 0.0, height]), axes[kind], (low, high))
    return body, height


def neck(chance: Chance, plan: Plan, chest: int, base_3: np.ndarray, joints: int, scale: float) -> int:
    """A neck of some joints and a head; the head's body."""
    kinds = list(chance.random.permutation(["yaw", "pitch", "roll"] if joints == 3 else ["yaw", "pitch"]))[:joints]
    axes = {"yaw": Z, "pitch": Y, "roll": X}
    ranges = {"yaw": (-1.5, 1.5), "pitch": (-0.6, 0.8), "roll": (-0.5, 0.5)}
    at_3, body = base_3.copy(), chest
    for kind in kinds:
        body = plan.join(f"neck_{kind}", body, at_3, axes[kind], ranges[kind])
        at_3 = at_3 + Z * chance.either(0.0, 0.03, 0.05) * scale
    if joints:
        plan.solid(body, at_3, at_3 + 0.18 * scale * Z, 0.07 * scale)
        if chance.maybe(0.6):
            plan.fix("head_camera", body, at_3 + scale * np.array([0.08, 0.0, 0.1]))
    return body


class ArmShape:
    """What both arms of a robot have in common."""

    def __init__(self, chance: Chance, scale: float) -> None:
        self.scale = scale
        self.upper, self.fore = scale * chance.between(0.2, 0.32), scale * chance.between(0.18, 0.3)
        self.clavicle = chance.maybe(0.15)
        self.swings = chance.either("pitch roll", "pitch roll", "pitch roll", "yaw roll", "yaw pitch", "roll pitch")
        self.twist = chance.maybe(0.88) or self.swings.startswith("yaw")
        self.crossing = not self.twist or chance.maybe(0.6)
        self.offsets = scale * np.array([chance.shift(1.0, 0.01, 0.06) for _ in range(3)]) * (not self.crossing)
        self.elbow_ahead = scale * chance.between(0.012, 0.03) if self.twist and chance.maybe(0.35) else 0.0
        self.forearm_on_hinge = chance.maybe(0.3)
        self.forearm_twist = chance.maybe(0.75)
        self.wrist_swings = chance.either(0, 1, 2, 2)
        self.wrist_apart = scale * chance.either(0.0, 0.0, 0.03, 0.045)
        self.last_roll = self.forearm_twist and self.wrist_swings == 1 and chance.maybe(0.5)
        self.both_ways = chance.either(0.0, 0.0, 0.0, 0.12, 0.4, 1.6)
        """How far the elbow bends backwards [rad]."""
        self.pitch_range = chance.either((-3.0, 1.0), (-2.8, 1.5), (-2.1, 0.8), (-3.1, 2.6))
        self.hand_length = scale * chance.between(0.08, 0.16)


def arm(plan: Plan, chest: int, shape: ArmShape, name: str, shoulder_3: np.ndarray) -> tuple[int, np.ndarray]:
    """One arm; the hand's body and the wrist.

    Args:
        plan: the robot.
        chest: the body that carries it.
        shape: what both arms have in common.
        name: left or right.
        shoulder_3: the left shoulder's centre.
    """
    side, body = SIDES[name], chest

    def add(role: str, at_3: np.ndarray, axis_3: np.ndarray, low: float, high: float) -> None:
        """A joint of this side: a turn about y is its own mirror image, about x and z it turns round."""
        nonlocal body
        sense = 1.0 if abs(axis_3[1]) > 0.9 else side
        body = plan.join(f"{name}_{role}", body, mirrored(at_3, side), axis_3, limits(low, high, sense))

    if shape.clavicle:
        inner_3 = shoulder_3 * np.array([1.0, 0.25, 1.0]) + 0.02 * shape.scale * Z
        add("clavicle", inner_3, Z if shape.scale > 0.9 else X, -0.4, 0.4)
    dx, dy, dz = shape.offsets
    one, two = shape.swings.split()
    ranges = {"pitch": shape.pitch_range, "roll": (-0.2, 2.8), "yaw": (-1.2, 1.6)}
    axes = {"pitch": Y, "roll": X, "yaw": Z}
    # The last swing passes the twist axis at a distance, at the shoulder's height; the first one passes both.
    add(
        f"shoulder_{one}",
        shoulder_3 + np.array([dx if one != "roll" else 0.0, dy if one != "pitch" else 0.0, dz]),
        axes[one],
        *ranges[one],
    )
    aside_3 = np.array([dx, 0.0, 0.0]) if two == "pitch" else np.array([0.0, dy, 0.0])
    add(f"shoulder_{two}", shoulder_3 + aside_3 * shape.twist, axes[two], *ranges[two])
    if shape.twist:
        add("shoulder_twist", shoulder_3 - shape.scale * 0.1 * Z, Z, -1.6, 1.6)
    carrier = body
    elbow_3 = shoulder_3 - shape.upper * Z
    hinge_3 = elbow_3 + shape.elbow_ahead * X
    plan.solid(
        carrier,
        mirrored(shoulder_3 - 0.06 * shape.scale * Z, side),
        mirrored(elbow_3 + 0.06 * shape.scale * Z, side),
        0.03 * shape.scale,
    )
    add("elbow", hinge_3, Y, -2.3, shape.both_ways)
    start_3 = hinge_3 if shape.forearm_on_hinge else elbow_3
    wrist_3 = start_3 - shape.fore * Z
    plan.points[f"{name}_shoulder"] = (carrier, mirrored(shoulder_3, side))
    plan.points[f"{name}_elbow"] = (carrier, mirrored(elbow_3 if shape.twist else hinge_3, side))
    fore = body
    if shape.forearm_twist:
        add("forearm_twist", start_3 - 0.4 * shape.fore * Z, Z, -1.6, 1.6)
        fore = body
    plan.solid(fore, mirrored(start_3 - 0.04 * shape.scale * Z, side), mirrored(wrist_3, side), 0.025 * shape.scale)
    for swing, axis_3 in zip(("wrist_pitch", "wrist_roll")[: shape.wrist_swings], (Y, X), strict=False):
        add(swing, wrist_3 - (shape.wrist_apart * Z if axis_3 is X else 0.0), axis_3, -0.8, 0.8)
    if shape.last_roll:
        add("wrist_twist", wrist_3 - 0.05 * shape.scale * Z, Z, -2.0, 2.0)
    plan.points[f"{name}_wrist"] = (fore, mirrored(wrist_3, side))
    return body, mirrored(wrist_3, side)


class LegShape:
    """What both legs have in common."""

    def __init__(self, chance: Chance, scale: float) -> None:
        self.scale = scale
        self.thigh, self.shank = scale * chance.between(0.28, 0.42), scale * chance.between(0.28, 0.42)
        self.order = chance.either(
            "pitch roll yaw", "yaw roll pitch", "roll yaw pitch", "roll pitch yaw", "roll pitch", "yaw roll pitch"
        )
        self.apart = scale * chance.shift(0.4, 0.02, 0.08)
        self.knee_ahead = scale * chance.either(0.0, 0.0, 0.02, 0.04)
        self.ankle = chance.either(
            "pitch roll", "roll pitch", "pitch roll", "pitch", "pitch roll", "roll pitch", "pitch", ""
        )
        self.sole = scale * chance.between(0.04, 0.1)
        self.width = scale * chance.between(0.07, 0.13)
        self.toes = chance.maybe(0.1) and self.ankle != ""
        self.knee_back = chance.either(0.0, 0.05, 0.15)

    @property
    def height(self) -> float:
        """Of the hips above the ground."""
        return self.thigh + self.shank + self.sole


def leg(plan: Plan, pelvis: int, shape: LegShape, name: str) -> None:
    """One leg, standing on the ground."""
    side, body = SIDES[name], pelvis
    hip_3 = np.array([0.0, shape.width, shape.height])
    axes = {"pitch": Y, "roll": X, "yaw": Z}
    ranges = {"pitch": (-2.0, 0.6), "roll": (-0.4, 0.7), "yaw": (-0.7, 0.7)}

    def add(role: str, at_3: np.ndarray, axis_3: np.ndarray, low: float, high: float) -> None:
        nonlocal body
        sense = 1.0 if abs(axis_3[1]) > 0.9 else side
        body = plan.join(f"{name}_{role}", body, mirrored(at_3, side), axis_3, limits(low, high, sense))

    kinds = shape.order.split()
    for kind in kinds:
        # A roll above or below the pitch; the yaw runs through the thigh.
        at_3 = hip_3 + (shape.apart * Z if kind == "roll" else 0.0)
        add(f"hip_{kind}", at_3, axes[kind], *ranges[kind])
    thigh = body
    knee_3 = hip_3 - shape.thigh * Z + shape.knee_ahead * X
    ankle_3 = hip_3 - (shape.thigh + shape.shank) * Z
    add("knee", knee_3, Y, -shape.knee_back, 2.2)
    shank = body
    plan.points[f"{name}_hip"], plan.points[f"{name}_knee"] = (
        (thigh, mirrored(hip_3, side)),
        (thigh, mirrored(knee_3, side)),
    )
    plan.points[f"{name}_ankle"] = (shank, mirrored(ankle_3, side))
    for kind in shape.ankle.split():
        add(f"ankle_{kind}", ankle_3, axes[kind], -0.7, 0.7)
    plan.directions[f"{name}_toes"], plan.directions[f"{name}_foot_up"] = (body, X), (body, Z)
    sole_3 = ankle_3 - shape.sole * Z
    length = 0.2 * shape.scale
    plan.solid(
        body,
        mirrored(sole_3 + np.array([-0.3 * length, 0.0, 0.01]), side),
        mirrored(sole_3 + np.array([0.7 * length, 0.0, 0.02]), side),
        0.01,
    )
    if shape.toes:
        add("toe", sole_3 + np.array([0.5 * length, 0.0, 0.01]), Y, -0.5, 0.1)


def zero_pose(chance: Chance, plan: Plan, shape: ArmShape, legs: bool) -> dict[str, float]:
    """Angles of a zero pose by role: hanging, spread, forearms forward, T, arms forward; knees straight or bent."""
    kind = chance.either("hanging", "hanging", "spread", "forearms", "t", "forward", "folded")
    roles = {joint.role for joint in plan.joints}
    found: dict[str, float] = {}
    for name, side in SIDES.items():
        roll = {"spread": chance.between(0.1, 0.5), "t": math.pi / 2}.get(kind, 0.0)
        if kind == "forward":
            found[f"{name}_shoulder_pitch"] = -math.pi / 2
        found[f"{name}_shoulder_roll"] = side * roll
        found[f"{name}_elbow"] = {"forearms": -math.pi / 2, "folded": -chance.between(0.2, 1.2)}.get(kind, 0.0)
    if kind == "folded":
        found["right_elbow"] = found["left_elbow"]
    if kind in ("spread",):
        found["right_shoulder_roll"] = -found["left_shoulder_roll"]
    if legs and chance.maybe(0.2):
        bend = chance.between(0.1, 0.5)
        for name in SIDES:
            found |= {f"{name}_hip_pitch": -bend, f"{name}_knee": 2 * bend, f"{name}_ankle_pitch": -bend}
    return {role: angle for role, angle in found.items() if role in roles}
