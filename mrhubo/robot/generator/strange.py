"""Kinds of robots that strangers have: what each changes about a random humanoid, by the kind's name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mrhubo.robot.generator import odd_drives, odd_legs, odd_parts
from mrhubo.robot.generator.hands import HandShape
from mrhubo.robot.generator.limbs import ArmShape, Chance
from mrhubo.robot.generator.odd_parts import Angles, Places
from mrhubo.robot.generator.plan import Plan


def _as_they_are(chance: Chance, arms: ArmShape, hands: HandShape) -> None:
    """Shapes of arms and hands stay."""


def _same_plan(plan: Plan) -> Plan:
    return plan


@dataclass(frozen=True, kw_only=True)
class Strange:
    """What is strange about a robot; nothing, as it stands here."""

    shapes: Callable[[Chance, ArmShape, HandShape], None] = _as_they_are
    """Changes arms and hands before they are planned."""
    build: Callable[[Chance, Plan, Places], Angles] = odd_parts.nothing
    """Adds parts, and says which angles of the zero pose they change."""
    finish: Callable[[Plan], Plan] = _same_plan
    """Changes the robot as it stands at its zero pose."""
    root_at: tuple[str, ...] = ()
    """Ends of roles, the last joint of which carries the root link."""
    names: tuple[str, ...] = ()
    """Habits of naming, one of which it has."""
    bare: bool = False
    """Whether links have neither shapes nor masses."""
    mappable: bool = True
    """Whether it has arms that move by themselves."""

    def root(self, plan: Plan, usual: int) -> int:
        """The body that becomes the root link."""
        found = [joint.child for word in self.root_at for joint in plan.joints if joint.role.startswith(word)]
        return found[-1] if found else usual


def _many_fingers(chance: Chance, arms: ArmShape, hands: HandShape) -> None:
    hands.kind, hands.fingers, hands.phalanges = chance.either("fingers", "mimicking fingers"), 4, 4


def _twist_alone(chance: Chance, arms: ArmShape, hands: HandShape) -> None:
    """A forearm that only twists, near the elbow and sometimes beside it."""
    arms.forearm_twist, arms.wrist_swings, arms.last_roll, arms.twist = True, 0, False, True
    arms.forearm_on_hinge = chance.maybe(0.5)
    arms.elbow_ahead = arms.scale * chance.either(0.0, 0.02, 0.03)
    hands.kind = chance.either("none", "palm", "fingers", "palm")


def _crossing(chance: Chance, arms: ArmShape, hands: HandShape) -> None:
    arms.crossing, arms.offsets, arms.wrist_apart = True, 0.0 * arms.offsets, 0.0


def _few_joints(chance: Chance, arms: ArmShape, hands: HandShape) -> None:
    """Arms of three or four joints."""
    arms.twist, arms.crossing, arms.offsets = chance.maybe(0.5), True, 0.0 * arms.offsets
    arms.swings, arms.elbow_ahead, arms.clavicle = "pitch roll", 0.0, False
    arms.forearm_twist, arms.wrist_swings, arms.last_roll = False, 0, False


STRANGE: dict[str, Strange] = {
    "no limits": Strange(finish=odd_parts.without_limits),
    "limits in degrees": Strange(finish=odd_parts.in_degrees),
    "neither shapes nor masses": Strange(bare=True),
    "twenty fingers' joints": Strange(shapes=_many_fingers),
    "the forearm's twist alone": Strange(shapes=_twist_alone),
    "the forearm's twist alone, bare": Strange(shapes=_twist_alone, bare=True),
    "few joints": Strange(shapes=_few_joints),
    "ball joints": Strange(shapes=_crossing, build=odd_parts.balls),
    "clavicles of two joints": Strange(build=odd_parts.clavicles),
    "shoulders tilted": Strange(build=odd_parts.tilted_shoulders),
    "arms mounted askew": Strange(build=odd_parts.mounts, finish=odd_parts.with_fixed_mounts),
    "arms on lifts": Strange(build=odd_parts.slides),
    "rods": Strange(build=odd_drives.rods),
    "rods, names of noise": Strange(build=odd_drives.rods, names=("noise",)),
    "rods on balls, names of noise": Strange(build=odd_drives.ball_rods, names=("noise",)),
    "play of gears": Strange(build=odd_drives.play),
    "pistons": Strange(build=odd_drives.pistons),
    "elbows of two hinges": Strange(build=odd_drives.two_hinges),
    "elbows behind gears": Strange(build=odd_drives.gears),
    "twists behind gears": Strange(build=odd_drives.geared_twists),
    "one arm mimics the other": Strange(build=odd_parts.mimicking_arm, mappable=False),
    "a face": Strange(build=odd_parts.face),
    "a tail": Strange(build=odd_parts.tail),
    "a third arm": Strange(build=odd_parts.third_arm),
    "wings": Strange(build=odd_parts.wings),
    "one arm": Strange(build=odd_parts.one_arm),
    "hips askew": Strange(build=odd_legs.askew_hips),
    "knees both ways": Strange(build=odd_legs.free_knees),
    "legs that telescope": Strange(build=odd_legs.telescopes),
    "floating base of six joints": Strange(build=odd_legs.floating_base, root_at=("floating",)),
    "planar base of three joints": Strange(build=odd_legs.planar_base, root_at=("floating",)),
    "root at the head": Strange(root_at=("neck",)),
    "root at a foot": Strange(root_at=("left_ankle",)),
    "root at a hand": Strange(root_at=("left_elbow", "left_forearm", "left_wrist")),
    "sides swapped in names": Strange(names=("swapped words", "swapped short")),
    "other languages": Strange(names=("french", "german", "spanish", "japanese")),
}
"""By name."""
