"""How strangers' robots drive their joints: rods, pistons, gears and their play, hinges that follow others.

Each function adds to a robot that is being planned, as those of `odd_parts` do.
"""

from __future__ import annotations

import numpy as np

from mrhubo.robot.generator.limbs import SIDES, Chance
from mrhubo.robot.generator.odd_parts import Angles, Places, joint_of
from mrhubo.robot.generator.plan import Plan, X, Y, Z


def rods(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Beside elbows and ankles a crank and a rod, the loop of which is cut where the rod meets the forearm or foot."""
    for name in SIDES:
        for hinge in ("elbow", "ankle_pitch"):
            joint = joint_of(plan, f"{name}_{hinge}")
            if joint is None:
                continue
            carrier = joint.parent
            before = joint
            while (length := 0.9 * float(np.linalg.norm(joint.point_3 - before.point_3))) < 0.05 * places.scale:
                carrier, before = before.parent, next(j for j in plan.joints if j.child == before.parent)
            aside_3 = 0.04 * places.scale * X
            start_3 = joint.point_3 + length * Z
            crank = plan.join(f"{name}_{hinge[:1]}_crank", carrier, start_3, joint.axis_3, (-1.5, 1.5))
            rod = plan.join(f"{name}_{hinge[:1]}_rod", crank, start_3 + aside_3, joint.axis_3, (-1.5, 1.5))
            plan.fix(f"{name}_{hinge[:1]}_rod_end", rod, joint.point_3 + aside_3)
    return {}


def ball_rods(chance: Chance, plan: Plan, places: Places) -> Angles:
    """On each shank and forearm two cranks, on each of which a rod hangs by a ball joint, as the loop is cut there."""
    for name, side in SIDES.items():
        for hinge in ("wrist_pitch", "ankle_pitch"):
            joint = joint_of(plan, f"{name}_{hinge}")
            if joint is None:
                continue
            if joint.child not in plan.solids:  # that weighs nothing otherwise, beside rods that weigh something
                plan.solid(joint.child, joint.point_3, joint.point_3, 0.01 * places.scale)
            for part, aside in (("a", side), ("b", -side)):
                start_3 = joint.point_3 + places.scale * np.array([-0.03, 0.03 * aside, 0.12 if part == "a" else 0.08])
                role, ball_3 = f"{name}_{hinge[0]}_rod_{part}", start_3 - 0.02 * places.scale * X
                body = plan.join(role, joint.parent, start_3, X, (-1.2, 0.9))
                for letter, axis_3 in zip("xyz", (X, Y, Z), strict=True):
                    body = plan.join(f"{role}_{letter}", body, ball_3, axis_3, None)
                plan.solid(body, ball_3, ball_3 - 0.07 * places.scale * Z, 0.005 * places.scale)
    return {}


def play(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Behind each motor a joint of its own for the play of its gear."""
    for number, joint in enumerate(list(plan.joints)):
        if joint.kind == "revolute" and joint.mimics is None:
            plan.insert_after(joint.role, f"play_{number}", joint.point_3, joint.axis_3, (-0.0087, 0.0087))
    return {}


def pistons(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Beside each elbow a piston: a joint that turns, one that slides, and a second one that turns."""
    for name in SIDES:
        joint = plan.joint(f"{name}_elbow")
        aside_3 = joint.point_3 + 0.05 * places.scale * X
        high_3 = aside_3 + 0.15 * places.scale * Z
        cylinder = plan.join(f"{name}_cylinder", joint.parent, high_3, Y, (-1.0, 1.0))
        piston = plan.join(f"{name}_piston", cylinder, high_3 - 0.07 * places.scale * Z, Z, (-0.1, 0.1), "prismatic")
        plan.join(f"{name}_piston_eye", piston, aside_3 - 0.05 * places.scale * Z, Y, (-1.0, 1.0))
    return {}


def two_hinges(chance: Chance, plan: Plan, places: Places) -> Angles:
    """An elbow of two parallel hinges, the second of which follows the first."""
    for name in SIDES:
        joint = plan.joint(f"{name}_elbow")
        half_3 = 0.012 * places.scale * Z
        role = f"{name}_second_hinge"
        plan.insert_after(f"{name}_elbow", role, joint.point_3 - half_3, joint.axis_3, (joint.lower, joint.upper))
        plan.change(f"{name}_elbow", point_3=joint.point_3 + half_3)
        plan.change(role, mimics=(f"{name}_elbow", 1.0))
    return {}


def gears(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Elbows that follow a motor in the upper arm."""
    for name in SIDES:
        joint = plan.joint(f"{name}_elbow")
        at_3 = joint.point_3 + 0.08 * places.scale * Z
        plan.join(f"{name}_motor", joint.parent, at_3, joint.axis_3, (joint.lower, joint.upper))
        plan.change(f"{name}_elbow", mimics=(f"{name}_motor", 1.0))
    return {}


def geared_twists(chance: Chance, plan: Plan, places: Places) -> Angles:
    """Twists, wrists and a neck's first joint that follow motors drawn beside them, on the link before or behind."""
    roles = ["neck_yaw"]
    for name in SIDES:
        roles += [f"{name}_{role}" for role in ("shoulder_twist", "forearm_twist", "wrist_pitch", "hip_yaw")]
    behind, ratio = chance.maybe(0.5), chance.either(-1.0, -0.9, 1.0)
    for number, role in enumerate(roles):
        joint = joint_of(plan, role)
        if joint is None or joint.lower is None or joint.upper is None:
            continue
        at_3 = joint.point_3 + 0.02 * places.scale * (X if abs(joint.axis_3[0]) < 0.5 else Y)
        limits = sorted((joint.lower / ratio, joint.upper / ratio))
        start = joint.child if behind else joint.parent
        motor = f"motor_{number}"
        plan.join(motor, start, at_3, joint.axis_3, (limits[0], limits[1]))
        plan.change(role, mimics=(motor, ratio))
    return {}
