"""What strangers' robots have besides a human's parts, or instead of them: rods, tails, wings, faces, third arms.

Each function adds to a robot that is being planned (`plan`), arms hanging, and returns the angles of the zero pose that
it changes, by role.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mrhubo.robot.generator.limbs import SIDES, Chance
from mrhubo.robot.generator.plan import Plan, X, Y, Z, mirrored

Angles = dict[str, float]


@dataclass(frozen=True)
class Places:
    """Bodies, by number, and where the left shoulder is (3,)."""

    pelvis: int
    chest: int
    head: int
    shoulder_3: np.ndarray
    scale: float


def nothing(chance: Chance, plan: Plan, places: Places) -> Angles:
    """As it is."""
    return {}


def mimicking_arm(chance: Chance, plan: Plan, places: Places) -> Angles:
    """A right arm that follows the left one, joint by joint."""
    first, second = (f"{name}_" for name in SIDES)
    for joint in list(plan.joints):
        other = joint.role.replace(second, first, 1)
        if joint.role.startswith(second) and joint.mimics is None and joint_of(plan, other) is not None:
            factor = 1.0 if abs(joint.axis_3[1]) > 0.9 else -1.0
            plan.change(joint.role, mimics=(other, factor))
    return {}


def slides(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Each arm on a lift of its own."""
    for name in SIDES:
        first = next(joint for joint in plan.joints if joint.role.startswith(f"{name}_") and _in_arm(joint.role))
        plan.insert_before(first.role, f"{name}_shoulder_slide", first.point_3, Z, (-0.2, 0.2), "prismatic")
    return {}


def mounts(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Arms mounted askew: turned outwards about the vertical, and tilted."""
    yaw, tilt = chance.either(0.0, 0.5, 0.8), chance.either(0.0, 0.3, 0.6)
    for name, side in SIDES.items():
        first = next(joint for joint in plan.joints if joint.role.startswith(f"{name}_") and _in_arm(joint.role))
        at_3 = mirrored(places.shoulder_3, side)
        plan.insert_before(first.role, f"{name}_mount_tilt", at_3, X, (-3.0, 3.0))
        plan.insert_before(f"{name}_mount_tilt", f"{name}_mount_yaw", at_3, Z, (-3.0, 3.0))
    signs = SIDES.items()
    return {f"{name}_mount_yaw": side * yaw for name, side in signs} | {
        f"{name}_mount_tilt": side * tilt for name, side in signs
    }


def tilted_shoulders(chance: Chance, plan: Plan, places: Places) -> Angles:
    """First axes of the arms that are tilted by 15 to 30 degrees."""
    tilt = chance.between(0.25, 0.55) * chance.either(-1.0, 1.0)
    for name, side in SIDES.items():
        joint = joint_of(plan, f"{name}_shoulder_pitch")
        if joint is not None:
            plan.change(joint.role, axis_3=np.array([0.0, np.cos(tilt), side * np.sin(tilt)]))
    return {}


def balls(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Shoulders, elbows, wrists and a neck whose frames lie in one point each, with links of no length."""
    for joint in list(plan.joints):
        name = joint.role.partition("_")[0]
        if joint.role.endswith("shoulder_twist"):
            plan.change(joint.role, point_3=mirrored(places.shoulder_3, SIDES[name]))
        if joint.role.endswith("forearm_twist"):
            at_3 = plan.points[f"{name}_{chance.either('elbow', 'wrist')}"][1]
            plan.change(joint.role, point_3=joint.point_3 + Z * ((at_3 - joint.point_3) @ Z))
    necks = [joint for joint in plan.joints if joint.role.startswith("neck_")]
    for joint in necks:
        plan.change(joint.role, point_3=necks[0].point_3)
    return {}


def clavicles(chance: Chance, plan: Plan, places: Places) -> Angles:
    """A clavicle of two joints before each shoulder, well inside of it."""
    for name, side in SIDES.items():
        first = next(joint for joint in plan.joints if joint.role.startswith(f"{name}_") and _in_arm(joint.role))
        if first.role.endswith("clavicle"):
            continue
        at_3 = mirrored(places.shoulder_3 * np.array([1.0, 0.2, 1.0]), side)
        plan.insert_before(first.role, f"{name}_clavicle_lift", at_3, X, (-0.4, 0.4))
        plan.insert_before(f"{name}_clavicle_lift", f"{name}_clavicle_swing", at_3, Z, (-0.4, 0.4))
    return {}


def face(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Brows, lids, eyes, lips and a jaw, and a tree of cameras, of a robot that has a neck."""
    if places.head == places.chest:
        return {}
    scale = places.scale
    high_3 = _top(plan, places)
    for name, side in SIDES.items():
        at_3 = high_3 + scale * np.array([0.07, side * 0.03, 0.09])
        eye = plan.join(f"{name}_eye_tilt", places.head, at_3, Y, (-0.5, 0.5))
        plan.join(f"{name}_eye_pan", eye, at_3, Z, (-0.5, 0.5))
        plan.join(f"{name}_lid", places.head, at_3, Y, (0.0, 1.0))
        plan.join(f"{name}_brow", places.head, at_3 + 0.03 * scale * Z, X, (-0.4, 0.4))
        plan.join(f"{name}_lip", places.head, high_3 + scale * np.array([0.08, side * 0.02, 0.02]), X, (-0.4, 0.4))
    jaw = plan.join("jaw", places.head, high_3 + 0.03 * scale * Z, Y, (0.0, 0.4))
    plan.fix("chin", jaw, high_3 + scale * np.array([0.08, 0.0, 0.0]))
    body = places.head
    for part in ("camera_mount", "camera_link", "camera_color_frame", "camera_color_optical_frame"):
        body = plan.fix(part, body, high_3 + scale * np.array([0.08, 0.01, 0.12]))
    return {}


def tail(chance: Chance, plan: Plan, places: Places) -> Angles:
    """A tail of four joints behind the pelvis."""
    start_3 = place_of(plan, places.pelvis) + 0.1 * places.scale * np.array([-1.0, 0.0, 0.5])
    body = places.pelvis
    for number in range(4):
        at_3 = start_3 - number * 0.12 * places.scale * X
        body = plan.join(f"tail_{number}", body, at_3, Y if number % 2 else Z, (-0.8, 0.8))
        plan.solid(body, at_3, at_3 - 0.1 * places.scale * X, 0.02 * places.scale)
    return {}


def third_arm(chance: Chance, plan: Plan, places: Places) -> Angles:
    """A third arm before the chest."""
    start_3 = places.shoulder_3 * np.array([1.0, 0.0, 1.0]) + places.scale * np.array([0.1, 0.0, -0.15])
    body = places.chest
    for number, (out, axis_3) in enumerate(((0.0, Z), (0.03, Y), (0.25, Y), (0.3, X), (0.45, Y))):
        at_3 = start_3 + out * places.scale * X
        body = plan.join(f"middle_arm_{number}", body, at_3, axis_3, (-1.5, 1.5))
    plan.solid(body, at_3, at_3 + 0.1 * places.scale * X, 0.03 * places.scale)
    return {}


def wings(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Two wings behind the shoulders, of a flap and a fold."""
    for name, side in SIDES.items():
        root_3 = mirrored(places.shoulder_3 * np.array([1.0, 0.4, 1.0]) - 0.1 * places.scale * X, side)
        fold_3 = root_3 + places.scale * np.array([-0.1, side * 0.2, 0.1])
        flap = plan.join(f"{name}_wing_flap", places.chest, root_3, X, (-1.0, 1.0))
        fold = plan.join(f"{name}_wing_fold", flap, fold_3, Z, (-1.0, 1.0))
        plan.solid(flap, root_3, fold_3, 0.01)
        plan.solid(fold, fold_3, fold_3 + places.scale * np.array([-0.1, side * 0.2, 0.0]), 0.01)
    return {}


def one_arm(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Without one of the arms."""
    second = chance.either(*SIDES)
    gone = {joint.child for joint in plan.joints if joint.role.startswith(second) and _in_arm(joint.role)}
    while more := {joint.child for joint in plan.joints if joint.parent in gone} - gone:
        gone |= more
    plan.remove(gone)
    return {}


def without_limits(plan: Plan) -> Plan:
    """No joint that turns has limits."""
    turning = ("revolute", "continuous")
    joints = [replace(j, kind="continuous", lower=None, upper=None) if j.kind in turning else j for j in plan.joints]
    return replace(plan, joints=joints)


def in_degrees(plan: Plan) -> Plan:
    """Limits in degrees."""
    joints = [
        replace(j, lower=round(np.degrees(j.lower), 3), upper=round(np.degrees(j.upper), 3))
        if j.kind == "revolute" and j.lower is not None and j.upper is not None
        else j
        for j in plan.joints
    ]
    return replace(plan, joints=joints)


def with_fixed_mounts(plan: Plan) -> Plan:
    """Mounts no longer move."""
    return replace(plan, joints=[replace(j, kind="fixed") if "_mount_" in j.role else j for j in plan.joints])


def _in_arm(role: str) -> bool:
    return any(word in role for word in ("clavicle", "shoulder"))


def joint_of(plan: Plan, role: str):  # noqa: ANN202
    """The joint with a role, if there is one."""
    return next((joint for joint in plan.joints if joint.role == role), None)


def place_of(plan: Plan, body: int) -> np.ndarray:
    """About where a body is (3,)."""
    solid = plan.solids.get(body)
    below = [joint.point_3 for joint in plan.joints if joint.parent == body]
    return solid.centre_3 if solid is not None else np.mean(below, axis=0)


def _top(plan: Plan, places: Places) -> np.ndarray:
    necks = [joint.point_3 for joint in plan.joints if joint.role.startswith("neck_")]
    return max(necks, key=lambda point_3: point_3[2]) if necks else places.shoulder_3 * np.array([1.0, 0.0, 1.0])
