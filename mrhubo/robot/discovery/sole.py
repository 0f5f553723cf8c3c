"""Where a foot's sole is that no shape tells, as where the meshes did not come with the file: by what is fixed to the
foot, else by its mass, and as long as feet usually are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.robot.discovery.bodies import Bodies
from mrhubo.robot.discovery.foot import Foot
from mrhubo.robot.discovery.leg import Leg
from mrhubo.robot.discovery.result import Vector
from mrhubo.robot.soles import sole_balls

_MASS = 1.55
"""How much farther below the ankle a sole is than the foot's centre of mass: the median of nine public humanoids, of
which it is 1.2 to 2.2."""
_SHIN = 0.2
"""How far below the ankle it is without masses, as a share of the shin: the median of fifteen, of 0.11 to 0.63."""
_LEAST, _MOST = 0.05, 0.5
"""What is fixed to a foot, or its centre of mass, tells something of its sole if it is this far below the ankle, as
shares of the shin."""
_BACK, _AHEAD = 0.12, 0.24
"""How far a sole reaches behind and before the ankle, as shares of thigh and shin: medians of ten."""


@dataclass(frozen=True)
class GuessedSole:
    """A sole as a config gives it."""

    reach_3: Vector
    """How far it reaches from the link's origin backwards, forwards and down [m]."""
    cue: str


def guess_sole(bodies: Bodies, leg: Leg, foot: Foot) -> GuessedSole | None:
    """The sole of a foot without shapes; None where shapes tell it, or a leg ends in a wheel."""
    if leg.wheeled or sole_balls(foot.link, bodies.description)[1]:
        return None
    down, cue = _depth(bodies, leg, foot)
    from_3 = leg.ankle.point_3 - bodies.position(foot.link)
    shin, thigh = (float(np.linalg.norm(leg.knee.point_3 - end.point_3)) for end in (leg.ankle, leg.hip))
    along, up = float(from_3 @ foot.forward_3), float(from_3 @ foot.up_3)
    back, ahead = _BACK * (thigh + shin) - along, _AHEAD * (thigh + shin) + along
    return GuessedSole(
        (round(back, 3), round(ahead, 3), round(down - up, 3)), f"{cue}, and as long as feet usually are"
    )


def _depth(bodies: Bodies, leg: Leg, foot: Foot) -> tuple[float, str]:
    """How far below the ankle the sole is, and what tells it."""
    if leg.ankle_at is None:
        return 0.0, "at the end of the shin"
    ankle_3, body = leg.ankle.point_3, leg.chain[-1].end
    shin = float(np.linalg.norm(leg.knee.point_3 - ankle_3))
    least, most = _LEAST * shin, _MOST * shin
    centre_3 = bodies.centre(body)
    weight = 0.0 if centre_3 is None else float((ankle_3 - centre_3) @ foot.up_3)
    below = {link: float((ankle_3 - bodies.position(link)) @ foot.up_3) for link in bodies.links_of[body]}
    lowest = max(below, key=lambda link: below[link])
    # A frame above the centre of mass is a sensor's, and not the sole's.
    if max(least, weight) < below[lowest]:
        return below[lowest], f"as low as '{lowest}', which is fixed to the foot"
    if least < weight < most:
        return _MASS * weight, "as far below the foot's centre of mass as usual"
    return _SHIN * shin, "as far below the ankle as usual"
