"""Why no arms were found: what of a file hides them, as the end of a sentence."""

from __future__ import annotations

from mrhubo.errors import UserError
from mrhubo.robot.discovery.bodies import Bodies
from mrhubo.robot.joint import stuck


class NoArms(UserError):
    """No pair of arms can be told; there may be one arm."""


def no_arms(bodies: Bodies) -> type[UserError]:
    """What to raise: where an arm mimics one of another limb, there are two, and neither is the only one."""
    return UserError if _mimicking(bodies) else NoArms


def _mimicking(bodies: Bodies) -> str:
    """The end of a sentence on a joint that mimics one of another limb, which hides its own; else nothing."""
    root = bodies.body_of[bodies.description.root]
    for hinge in (hinge for hinge in bodies.hinges if hinge.rotary and not hinge.free):
        mimic = bodies.description.joints[hinge.name].mimic
        source = next((other for other in bodies.hinges if mimic is not None and other.name == mimic.joint), None)
        above = {root, *(step.end for step in bodies.path(root, hinge.bodies[0]))}
        if source is not None and source.bodies[0] not in above:
            return (
                f"; '{hinge.name}' mimics '{source.name}' of another limb: if the robot can move both by themselves, "
                "take the <mimic> elements of such joints out of the URDF"
            )
    return ""


def why_no_arms(bodies: Bodies) -> str:
    """The end of a sentence on a joint that mimics one of another limb, on joints whose limits leave them no way to
    move, or on fixed ones that have limits; else nothing.
    """
    if mimicking := _mimicking(bodies):
        return mimicking
    still = [joint for joint in bodies.description.joints.values() if joint.rotary and stuck(joint)]
    if not still:
        return _fixed_with_limits(bodies)
    first, more = still[0], f" and {len(still) - 1} more" * (len(still) > 1)
    ends = f"{first.lower:g} .. {first.upper:g}"
    return f"; '{first.name}'{more} cannot move, by limits as {ends}: correct them if it can"


def _fixed_with_limits(bodies: Bodies) -> str:
    joints = [joint for joint in bodies.description.joints.values() if joint.kind == "fixed"]
    named = [j.name for j in joints if j.lower is not None and j.upper is not None and j.lower < j.upper]
    if not named:
        return ""
    more = f" and {len(named) - 1} more" * (len(named) > 1)
    return f"; '{named[0]}'{more} are fixed, though they have limits: make them revolute if they can move"
