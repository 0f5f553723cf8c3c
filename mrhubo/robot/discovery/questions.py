"""What could not be decided, for the user to answer; and what a user should know of the whole robot."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from mrhubo.robot.discovery.arm import Spot
from mrhubo.robot.discovery.bodies import Chain
from mrhubo.robot.discovery.foot import Foot
from mrhubo.robot.discovery.members import Limbs
from mrhubo.robot.discovery.motion import along_at_most
from mrhubo.robot.discovery.necks import is_named
from mrhubo.robot.discovery.other_side import copied_limits
from mrhubo.robot.discovery.ranges import driver
from mrhubo.robot.discovery.result import Candidate, FoundRange, Question
from mrhubo.robot.discovery.roles import Roles
from mrhubo.robot.discovery.sole import GuessedSole
from mrhubo.robot.limits import beyond_turns
from mrhubo.robot.shapes import metres_of

_SURE = 0.5
"""Confidence under which the user is asked."""
_BACK = 3
"""Joints of a waist at most, where no legs tell that it is one."""

_ACROSS = 0.5
"""Cosine of how far a knee's axis may stay away from the robot's left and right, however its hip turns: 60 degrees."""
_LEG = 0.6
"""Length of a further leg at least, as a share of that of the legs; of one without a knee, of that of the arms."""
_PARTS = 3
"""Joints of a leg without a knee at least."""

Named = tuple[str, Spot, tuple[Candidate, ...]]
"""A point by its name, and where else it may lie."""


def questions(
    limbs: Limbs, spots: Sequence[Named], feet: Mapping[str, Foot], soles: Mapping[str, GuessedSole]
) -> Iterator[Question]:
    """About directions, limbs, points, hands and feet."""
    heading, roles = limbs.heading, limbs.roles
    if heading.forward_sure < _SURE:
        yield Question("forward", "it is not clear where the robot faces, nor therefore which side is left; "
                       f"taken by: {heading.forward_cue}")  # fmt: skip
    if heading.up_sure < _SURE:
        yield Question("up", f"it is not clear where the robot's up is; taken by: {heading.up_cue}")
    if roles.sure < _SURE:
        first = [chain[0].hinge.name for pair in (roles.arms, roles.legs) if pair for chain in pair.chains]
        yield Question("chest", "it is not clear which pair of limbs is arms and which legs", tuple(first))
    if more := _more_arms(roles):
        yield Question("chest", "it carries more than two limbs that may be arms; those were taken that are longest, "
                       "or most like arms, and the others stay as they are", more)  # fmt: skip
    if roles.neck and not is_named(roles.neck) and _below_shoulders(limbs):
        yield Question("neck", "the chain that was taken for a neck ends below the shoulders, so it may be a tail, or "
                       "an arm", tuple(step.hinge.name for step in roles.neck))  # fmt: skip
    for name, spot, _ in spots:
        if spot.confidence < _SURE:
            yield Question(name, f"the {name.replace('_', ' ')} was taken as {spot.cue}; give its point", spot.links)
    for side, hand in limbs.hands.items():
        if hand.doubt is not None:
            yield Question(f"{side}_hand", f"{hand.doubt}; taken: {hand.cue}", (hand.link,))
    if not limbs.whole_body:
        return
    for side, leg in limbs.legs.items():
        knee = leg.chain[leg.knee_at].hinge
        if along_at_most(leg.chain[: leg.knee_at], knee.line.axis_3, heading.left_3) < _ACROSS:
            yield Question(f"{side}_knee", f"'{knee.name}' bends the leg sideways, by its axis and by where the robot "
                           "was found to face, one of which is wrong: correct the axis in the file and describe it "
                           "anew, or give `forward`", (knee.name,))  # fmt: skip
    for side, foot in feet.items():
        if foot.doubt is not None:
            yield Question(f"{side}_foot", foot.doubt, (foot.link,))
        if side in soles:
            yield Question(f"{side}_foot", f"no shape tells where its sole is; taken: {soles[side].cue}; `sole` is how "
                           "far it reaches backwards, forwards and down from the link's origin [m]",
                           (foot.link,))  # fmt: skip
    if not limbs.legs and (first := _unread_legs(roles)):
        yield Question("pelvis", "of the limbs below it no knee could be told, so they are left out: if they are legs, "
                       "write hips, knees, ankles and feet by hand, with their joints", first)  # fmt: skip
    if roles.legs is not None and (more := _more_legs(roles)):
        yield Question("pelvis", "it carries more than two limbs that may be legs; those were taken that are like a "
                       "human's, or longest, and the others stay as they are", more)  # fmt: skip
    moved = limbs.moved
    turning = tuple(step.hinge.name for step in roles.waist if step.hinge.name in moved)
    if roles.legs is None and len(turning) > _BACK:
        yield Question("pelvis", f"there are no legs, and a chain of {len(turning)} joints was taken for a waist, "
                       "which may be a tail or an arm", turning)  # fmt: skip


def asked_of_neck(aside: Sequence[str]) -> Iterator[Question]:
    """About a head that stands turned aside at the zero pose, by these joints."""
    if aside:
        names = " and ".join(f"'{name}'" for name in aside)
        yield Question("head", f"at the zero pose {names} holds the head turned aside; taken: that it faces ahead "
                       "where the axes of the neck are straight again", tuple(aside))  # fmt: skip


def _below_shoulders(limbs: Limbs) -> bool:
    up_3, head_3 = limbs.heading.up_3, limbs.bodies.middle(limbs.roles.neck[-1].end)
    return all(float((head_3 - arm.shoulder.point_3) @ up_3) < 0 for arm in limbs.arms.values())


def _unread_legs(roles: Roles) -> tuple[str, ...]:
    """First joints of limbs that may be legs, and have no knee."""
    if roles.legs is not None:
        return tuple(chain[0].hinge.name for chain in roles.legs.chains)
    pairs = [
        pair for pair in roles.others
        if pair not in roles.more_arms and pair.size > _LEG * roles.arms.size and len(pair.chains[0]) >= _PARTS
    ]  # fmt: skip
    return tuple(chain[0].hinge.name for pair in pairs for chain in pair.chains)


def _more_arms(roles: Roles) -> tuple[str, ...]:
    """First joints of all pairs that may be arms, where there are more than one."""
    more = roles.more_arms
    return tuple(chain[0].hinge.name for pair in (roles.arms, *more) for chain in pair.chains) if more else ()


def _more_legs(roles: Roles) -> tuple[str, ...]:
    """First joints of further pairs of limbs on the body that carries the legs, about as long as these."""
    legs = roles.legs
    if legs is None:
        return ()
    pairs = [pair for pair in roles.others if pair.body == legs.body and pair.size > _LEG * legs.size]
    return tuple(chain[0].hinge.name for pair in pairs for chain in pair.chains)


def coupled(limbs: Limbs) -> Iterator[Question]:
    """Joints of moving limbs that mimic others of them: as a file may have it that is for a show of one side."""
    moving = [step for chain in limbs.moving.values() for step in chain]
    whole = {step.hinge.name for step in moving} & set(limbs.moved)
    for step in (step for step in moving if not step.hinge.free and step.hinge.name not in shared_hips(limbs)):
        source = driver(limbs.bodies, step)
        if source is not None and source.name in whole:
            name = step.hinge.name
            yield Question(name, f"'{name}' mimics '{source.name}', so neither follows a person by itself; if they "
                           f"can on the robot, take the <mimic> element of '{name}' out of the URDF and "
                           "describe it anew")  # fmt: skip


def shared_hips(limbs: Limbs) -> dict[str, str]:
    """Where one joint alone of a leg mimics the same of the other leg, as one motor may drive both: by its name, its
    source.
    """
    found: dict[str, str] = {}
    legs: list[Chain] = [leg.chain for leg in limbs.legs.values()]
    for chain, other in (legs, legs[::-1]) if len(legs) == 2 else ():
        names = [step.hinge.name for step in other]
        driven = [(step, driver(limbs.bodies, step)) for step in chain if not step.hinge.free]
        sources = {step.hinge.name: hinge.name for step, hinge in driven if hinge is not None and hinge.name in names}
        if len(sources) == 1:
            found |= sources
    return found


def notes(limbs: Limbs, ranges: Mapping[str, FoundRange]) -> Iterator[str]:
    """Sentences about the whole robot, whose joints have these ranges."""
    bodies = limbs.bodies
    if guessed := [name for name, found in ranges.items() if found.guessed]:
        more = f" and {len(guessed) - 1} more" if len(guessed) > 1 else ""
        yield (
            f"the file gives '{guessed[0]}'{more} no limits, or about a turn; robot.ranges holds guesses: write the "
            "robot's own there before it moves"
        )
    if bodies.degrees:
        joint = next(j for j in bodies.description.joints.values() if j.kind == "revolute" and beyond_turns(j))
        yield (
            f"the limits of most joints, as {joint.lower:g} .. {joint.upper:g} of '{joint.name}', can only be "
            "degrees, where a URDF has radians; robot.ranges holds them in radians, and nothing else need be done "
            "here, but other programs need a URDF with every limit times 0.0174533"
        )
    small = [word for word in ("collisions", "visuals") if metres_of(bodies.description.parsed, word) < 1.0]
    if small:
        yield (
            "the sizes of its boxes, cylinders and balls can only be millimetres, where a URDF has metres; they are "
            "read so here, but other programs need a URDF with a thousandth of them"
        )
    sides = [limbs.arms, limbs.legs] if limbs.whole_body else [limbs.arms]
    pairs = [(found["left"].chain, found["right"].chain) for found in sides if len(found) == 2]
    for one, other in copied_limits(pairs, limbs.heading.left_3):
        yield (
            f"the limits of '{one}' and '{other}' are not mirrored as their axes are, so that of one of them may be "
            "wrong in the file; if it is, correct it there, or give what is right in robot.ranges"
        )
    for what in limbs.heading.contradicted:
        yield f"what speaks against where the robot was found to face, as if it faced the other way: {what}"
    if not limbs.whole_body:
        return
    for name, source in shared_hips(limbs).items():
        yield f"'{name}' mimics '{source}' of the other leg, so the two legs share that joint"
    if not limbs.legs and not any(step.hinge.rotary for step in limbs.roles.waist):
        yield "neither legs nor a waist were found: what moves is arms and head, as without a whole body"
