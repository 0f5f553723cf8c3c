"""A random humanoid as the text of a URDF, with what is true of it; the same for the same seed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mrhubo.robot.generator.hands import HandShape, hand
from mrhubo.robot.generator.limbs import SIDES, ArmShape, Chance, LegShape, arm, leg, neck, trunk, zero_pose
from mrhubo.robot.generator.naming import STYLES
from mrhubo.robot.generator.odd_parts import Places
from mrhubo.robot.generator.plan import Plan, X, Y, Z, about
from mrhubo.robot.generator.strange import STRANGE, Strange
from mrhubo.robot.generator.text import write


@dataclass(frozen=True)
class Humanoid:
    """A robot that was made up. Points and directions are in the root link's frame with every joint at 0."""

    seed: int
    urdf: str
    forward_3: np.ndarray
    up_3: np.ndarray
    joints: frozenset[str]
    """Those of arms and neck, without fingers."""
    chains: Mapping[str, tuple[str, ...]]
    """Joints by chain: arms, legs without toes, neck, waist."""
    points: Mapping[str, np.ndarray]
    """True joint centres by human keypoint."""
    carriers: Mapping[str, str]
    """The link that carries each of them."""
    directions: Mapping[str, np.ndarray]
    """`left_fingers`, `left_thumb`, `left_toes`, `left_foot_up`, ..."""
    chest: str
    """The link that carries the arms."""
    head: str | None
    hand: str
    """What kind of hands it has."""
    wrist_joints: int
    """Joints beyond the elbow of an arm; without a swing among them nothing tells exactly where the wrist is."""
    wrist_swings: int
    told: frozenset[str]
    """What else is true, for tables: `names`, `legs`, `zero: t`, ..."""
    mappable: bool
    """Whether it has arms that move by themselves; else it is to be refused."""


def humanoid(seed: int, kind: str | None = None) -> Humanoid:
    """The random humanoid of a seed.

    Args:
        seed: of what is random.
        kind: what is strange about it, one of `strange.STRANGE`; the rest is as without.
    """
    chance, odd = Chance(seed), Chance(seed + 10**6)
    strange = Strange() if kind is None else STRANGE[kind]
    scale = chance.either(0.35, 0.7, 1.0, 1.0, 1.2)
    plan = Plan()
    base = chance.either("legs", "legs", "legs", "legs", "wheels", "pedestal")
    legs = LegShape(chance, scale)
    waist = int(chance.random.choice(4, p=[0.25, 0.3, 0.2, 0.25]))
    pelvis = plan.body("pelvis")
    height = legs.height
    if base == "legs":
        plan.solid(
            pelvis,
            np.array([0.0, -0.05, height]),
            np.array([0.0, 0.05, height + 0.08]) * np.array([1, scale, 1]),
            0.05 * scale,
        )
        for name in SIDES:
            leg(plan, pelvis, legs, name)
    elif base == "wheels":
        for name, side in SIDES.items():
            plan.join(f"{name}_wheel", pelvis, np.array([0.0, side * 0.2 * scale, 0.1 * scale]), Y, None)
            if chance.maybe(0.5):
                caster = plan.join(f"{name}_caster", pelvis, np.array([0.2, side * 0.15, 0.05]) * scale, Z, None)
                plan.join(f"{name}_caster_wheel", caster, np.array([0.18, side * 0.15, 0.03]) * scale, Y, None)
    start = pelvis
    if base != "legs" and chance.maybe(0.4):
        start = plan.join(
            "lift", pelvis, np.array([0.0, 0.0, height]), Z, (0.0, 0.3 * scale), "prismatic", body="torso_lift"
        )
    chest, top = trunk(chance, plan, start, height + 0.1 * scale, waist)
    shoulder_3 = np.array([0.0, scale * chance.between(0.13, 0.22), top + scale * chance.between(0.25, 0.4)])
    plan.solid(chest, np.array([0.0, 0.0, top + 0.05 * scale]), shoulder_3 * np.array([1.0, 0.0, 1.0]), 0.08 * scale)
    shape, hands = ArmShape(chance, scale), HandShape(chance, scale)
    strange.shapes(odd, shape, hands)
    for name in SIDES:
        wrist, wrist_3 = arm(plan, chest, shape, name, shoulder_3)
        hand(chance, plan, wrist, wrist_3, hands, name)
    neck_joints = int(chance.random.choice(4, p=[0.2, 0.15, 0.4, 0.25]))
    top_3 = np.array([chance.shift(0.3, 0.0, 0.05) * scale, 0.0, shoulder_3[2] + scale * chance.between(0.05, 0.12)])
    head = neck(chance, plan, chest, top_3, neck_joints, scale)
    _extras(chance, plan, head, scale)
    angles = zero_pose(chance, plan, shape, base == "legs")
    last = len(plan.bodies) - 1
    angles |= strange.build(odd, plan, Places(pelvis, chest, head, shoulder_3, scale))
    posed, moved = plan.posed(angles)
    posed = strange.finish(posed)
    root = chance.either(pelvis, pelvis, pelvis, chest, last if base == "legs" and chance.maybe(0.1) else pelvis)
    root = strange.root(plan, root)
    style, tidy = chance.either(*STYLES), chance.maybe(0.4)
    base_44 = _base(chance, tidy)
    style = odd.either(*strange.names) if strange.names else style
    shapes = chance.maybe(0.7) and not strange.bare
    written = write(chance, posed, moved, root, base_44, style, tidy, shapes, masses=not strange.bare)
    back_44 = np.linalg.inv(base_44)
    turn_33 = back_44[:3, :3]
    # The chest faces where its body has gone.
    chest_33 = moved[chest][:3, :3]
    roles = {
        **{
            f"{name}_arm": [j.role for j in posed.joints if j.role.startswith(name) and _of_arm(j.role)]
            for name in SIDES
        },
        **{
            f"{name}_leg": [j.role for j in posed.joints if j.role.startswith(name) and _of_leg(j.role)]
            for name in SIDES
        },
        "neck": [j.role for j in posed.joints if j.role.startswith("neck")],
        "waist": [j.role for j in posed.joints if j.role.startswith("waist")],
    }
    chains = {name: tuple(written.joints[role] for role in found) for name, found in roles.items()}
    beyond = sum(_beyond(role) for role in roles["left_arm"])
    return Humanoid(
        seed=seed,
        urdf=written.text,
        forward_3=turn_33 @ chest_33 @ X,
        up_3=turn_33 @ chest_33 @ Z,
        joints=frozenset(joint for name in ("left_arm", "right_arm", "neck") for joint in chains[name]),
        chains=chains,
        points={name: turn_33 @ point_3 + back_44[:3, 3] for name, (_, point_3) in posed.points.items()},
        carriers={name: written.links[body] for name, (body, _) in posed.points.items()},
        directions={name: turn_33 @ way_3 for name, (_, way_3) in posed.directions.items()},
        chest=written.links[chest],
        head=written.links[head] if neck_joints else None,
        hand=hands.kind,
        wrist_joints=beyond,
        wrist_swings=shape.wrist_swings,
        told=frozenset(
            {
                f"names: {style}",
                f"base: {base}",
                f"frames: {'tidy' if tidy else 'by chance'}",
                f"hand: {hands.kind}",
                *([f"joints of an ankle: {len(legs.ankle.split())}"] if base == "legs" else []),
            }
        ),  # fmt: skip
        mappable=strange.mappable,
    )


def _of_arm(role: str) -> bool:
    return any(word in role for word in ("clavicle", "shoulder", "elbow", "forearm", "wrist"))


def _of_leg(role: str) -> bool:
    return any(word in role for word in ("hip", "knee", "ankle"))


def _beyond(role: str) -> bool:
    return any(word in role for word in ("forearm", "wrist"))


def _extras(chance: Chance, plan: Plan, head: int, scale: float) -> None:
    """What does not belong to a body: ears, eyes, a lidar."""
    kind = chance.either("", "", "ears", "eyes", "lidar", "bar")
    high_3 = max((joint.point_3 for joint in plan.joints if "neck" in joint.role), key=lambda p: p[2], default=None)
    if high_3 is None:
        return
    for name, side in SIDES.items():
        if kind == "ears":
            plan.join(f"{name}_antenna", head, high_3 + scale * np.array([-0.05, side * 0.06, 0.1]), Y, (-2.0, 2.0))
        if kind == "eyes":
            at_3 = high_3 + scale * np.array([0.06, side * 0.03, 0.08])
            eye = plan.join(f"{name}_eye_yaw", head, at_3, Z, (-0.5, 0.5))
            plan.join(f"{name}_eye_pitch", eye, at_3, Y, (-0.5, 0.5))
        if kind == "bar" and f"{name}_elbow" in {joint.role for joint in plan.joints}:
            elbow = plan.joint(f"{name}_elbow")
            at_3 = elbow.point_3 + 0.05 * scale * Z - 0.02 * scale * X
            source = (f"{name}_elbow", 1.0)
            plan.join(f"{name}_linkage", elbow.parent, at_3, elbow.axis_3, (-2.5, 2.5), mimics=source)
    if kind == "lidar":
        plan.join("lidar_spin", head, high_3 + scale * np.array([0.0, 0.0, 0.2]), Z, None)


def _base(chance: Chance, tidy: bool) -> np.ndarray:
    """Pose of the root's frame: as the file's habit has it, y-up, facing -x, lying, or by chance."""
    kind = chance.either("usual", "usual", "usual", "back", "y up", "lying", "turned")
    turn_44 = {
        "usual": np.eye(4),
        "back": about(np.zeros(3), Z, np.pi),
        "y up": about(np.zeros(3), X, np.pi / 2),
        "lying": about(np.zeros(3), Y, np.pi / 2),
        "turned": about(np.zeros(3), chance.random.normal(size=3), chance.between(0.3, 3.0)),
    }[kind]
    place_44 = np.eye(4)
    if chance.maybe(0.5):
        place_44[:3, 3] = [chance.shift(0.3, 0.0, 0.5), chance.shift(0.3, 0.0, 0.5), chance.between(0.0, 1.0)]
    return place_44 @ turn_44
