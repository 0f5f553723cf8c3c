"""How a foot points: by the ankle's axis and the flat of its shape, else as it stands at the zero pose."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mrhubo.robot.discovery.arm import GUESS, Spot
from mrhubo.robot.discovery.bodies import Bodies, lines_of
from mrhubo.robot.discovery.facing import Heading
from mrhubo.robot.discovery.leg import Leg
from mrhubo.robot.discovery.leg_axes import parallel
from mrhubo.robot.discovery.lines import cross, unit
from mrhubo.robot.discovery.motion import straight_angle
from mrhubo.robot.soles import sole_balls

_FLAT, _TILTED = 0.9, 0.9998
"""Cosines of how far the flat of a foot's box may be from the robot's up to be its sole (25 degrees), and within which
it stands flat at the zero pose (1 degree)."""
_ACROSS = 0.3
"""Cosine of how far from left and right an ankle's axis may lie at the zero pose that tells where a foot points: a leg
may be turned there."""
_STANDING = 0.8
"""Cosine of how far from downwards a leg may run at the zero pose for its foot to stand on a floor there."""
_SPREAD = 0.2
"""Sine of how far outwards or inwards it may run there for its foot to be flat (12 degrees)."""
_BEYOND = 0.35
"""How far beyond its limits an ankle may have to turn [rad] for the foot to be flat below an upright shin."""
_HEIGHT, _HEEL = 0.165, 0.32
"""Where an ankle is that has no joint: how high above the sole, as a share of the knee's height, and how far before the
heel, as a share of the foot's length. Both are medians of fifteen public humanoids whose ankles have joints, of which
the height is 0.11 to 0.31 and the distance 0.22 to 0.5."""
_THICK = 0.025
"""How far above the lowest of a sole's shapes others touch a floor too, as a share of the shin."""
_TILTS = np.radians(np.arange(0, 16) * np.array([[1], [-1]])).T.ravel().tolist()
"""How far such a sole may be tilted forwards or backwards at zero [rad], the least first."""
_FOOT, _FLOOR = 0.25, 0.1
"""How long a foot is at least, and how far above the lowest of its shapes the others may end, as shares of the knee's
height."""


@dataclass(frozen=True)
class Foot:
    """A foot's link and directions at the zero pose, root's frame."""

    link: str
    forward_3: np.ndarray
    up_3: np.ndarray
    confidence: float
    cue: str
    doubt: str | None
    """What could not be told, if anything."""


def read_foot(bodies: Bodies, leg: Leg, heading: Heading) -> Foot:
    """The foot at the end of a leg."""
    last = leg.chain[-1]
    link = last.outer_link
    up_3, how, sure = _up(bodies, leg, _upright(bodies, leg, heading))
    up_3 = heading.up_3 if how is None else up_3
    doubt = None
    along_3 = unit(leg.ankle.point_3 - leg.hip.point_3)
    down, aside = -float(along_3 @ heading.up_3), abs(float(along_3 @ heading.left_3))
    if how is None:
        how, sure = "as it stands at the zero pose", 0.7
        stands = _stands(leg, up_3)
        if down < _STANDING or aside > _SPREAD or leg.ankle_at is None or not stands:
            sure = 0.4
            why = "the leg is spread at zero" if aside > _SPREAD else "the leg does not stand at zero"
            why = "no joint turns it against the shin" if leg.ankle_at is None else why
            why = "it ends in a wheel, which is no foot" if leg.wheeled else why
            taken = "upright as the robot is at zero"
            if leg.ankle_at is not None and aside > _SPREAD and stands and down >= _STANDING:
                up_3, taken = _flatter(bodies, leg, heading, link)
            doubt = f"{why}, so nothing tells how the foot lies on a floor; taken: {taken}"
    forward_3 = heading.forward_3
    if leg.straight and leg.ankle_at is not None:
        # By left and right, which no foot that hangs at zero changes.
        axis_3 = leg.chain[leg.ankle_at].hinge.line.axis_3
        left = float(axis_3 @ heading.left_3)
        if abs(left) > _ACROSS:
            forward_3, how = unit(cross(np.sign(left) * axis_3, up_3)), f"{how}; across the ankle's pitch axis"
    forward_3 = unit(forward_3 - up_3 * (up_3 @ forward_3))
    return Foot(link, forward_3, up_3, sure, how, doubt)


def with_fixed_ankle(bodies: Bodies, leg: Leg, heading: Heading) -> Leg:
    """The leg with its ankle above the sole of a foot that no joint turns; as it is if a joint turns it, or no shape
    tells a foot from a shin that ends in a peg.
    """
    foot = leg.chain[-1].end
    if leg.ankle_at is not None or leg.wheeled or not bodies.shapes_of[foot]:
        return leg
    knee_3 = leg.knee.point_3
    up_3 = _up(bodies, leg, _upright(bodies, leg, heading))[0]
    ahead_3 = unit(heading.forward_3 - up_3 * (up_3 @ heading.forward_3))
    corners = [bodies.shape_corners(shape) - knee_3 for shape in bodies.shapes_of[foot]]
    tall = -min(float((corners_83 @ up_3).min()) for corners_83 in corners)
    along = np.concatenate([
        corners_83 @ ahead_3 for corners_83 in corners if float((corners_83 @ up_3).min()) < (_FLOOR - 1) * tall
    ]) if tall > 0 else np.zeros(1)  # fmt: skip
    length = float(along.max() - along.min())
    if length < _FOOT * tall or tall <= 0:
        return leg
    # Seen from before, a shin goes straight down from its knee.
    ankle_3 = knee_3 - (1 - _HEIGHT) * tall * up_3 + (float(along.min()) + _HEEL * length) * ahead_3
    cue = "the point as high above the sole and as far before the heel as usual, as no joint tells the ankle"
    return replace(leg, ankle=Spot(ankle_3, foot, leg.ankle.links, cue, GUESS))


def _upright(bodies: Bodies, leg: Leg, heading: Heading) -> np.ndarray:
    """Where a foot's sole may face away from (3,): the robot's up, or, where no joint turns the foot against the shin,
    the way up the shin, which stands upright on a flat foot.
    """
    shapes = bodies.shapes_of[leg.chain[-1].end]
    if leg.ankle_at is not None or not shapes:
        return heading.up_3
    lowest = min((bodies.shape_corners(shape) for shape in shapes), key=lambda c_83: float((c_83 @ heading.up_3).min()))
    return unit(leg.knee.point_3 - lowest.mean(0))


def _up(bodies: Bodies, leg: Leg, up_3: np.ndarray) -> tuple[np.ndarray, str | None, float]:
    """Where a foot's sole faces away from, by its largest box: a given up_3 itself, and no cue, where there is none
    near it. Of a foot that hangs at the zero pose, the only side with which the ankle can stand tells.
    """
    boxes = [shape for shape in bodies.shapes_of[leg.chain[-1].end] if shape.kind == "box"]
    if boxes:
        box = max(boxes, key=lambda shape: float(np.prod(shape.size)))
        axes_33 = (bodies.pose_44[box.link] @ box.origin_44)[:3, :3].T
        sides = [sign * axis_3 for axis_3 in axes_33 for sign in (1.0, -1.0)]
        near = max(sides, key=lambda side_3: float(side_3 @ up_3))
        cosine = float(near @ up_3)
        if cosine > _FLAT and _stands(leg, near):
            return (up_3 if cosine > _TILTED else unit(near)), "flat as its box is", 0.9
        standing = [side_3 for side_3 in sides if _stands(leg, side_3)]
        if len(standing) == 1:
            return unit(standing[0]), "flat as its box is, on the only side on which the ankle lets it stand", 0.7
    return up_3, None, 0.0


def _flatter(bodies: Bodies, leg: Leg, heading: Heading, link: str) -> tuple[np.ndarray, str]:
    """Where the sole of a foot without a box, at the end of a leg that is spread at zero, faces away from, and what was
    taken: along the leg as seen from before, if its lowest shapes are far wider then, and tilted as they lie, if they
    are far longer then; else the robot's up.
    """
    up_3, forward_3 = heading.up_3, heading.forward_3
    leg_3 = leg.hip.point_3 - leg.ankle.point_3
    along_3 = unit(leg_3 - forward_3 * (leg_3 @ forward_3))
    balls_K4, known = sole_balls(link, bodies.description)
    places_K3 = balls_K4[:, :3] @ bodies.pose_44[link][:3, :3].T
    thick = _THICK * float(np.linalg.norm(leg.knee.point_3 - leg.ankle.point_3))

    def size(sole_3: np.ndarray, across_3: np.ndarray) -> float:
        height_K = places_K3 @ sole_3 - balls_K4[:, 3]
        return float(np.ptp(places_K3[height_K < height_K.min() + thick] @ across_3))

    def lying(sole_3: np.ndarray) -> tuple[np.ndarray, float]:
        """It, tilted where its lowest shapes are far longer then, and how wide they are."""
        left_3 = cross(sole_3, forward_3)
        tilted = [math.cos(tilt) * sole_3 + math.sin(tilt) * forward_3 for tilt in _TILTS]
        longest_3 = max(tilted, key=lambda tilted_3: size(tilted_3, cross(left_3, tilted_3)))
        if size(longest_3, cross(left_3, longest_3)) > 2 * size(sole_3, forward_3) + thick:
            sole_3 = longest_3
        return sole_3, size(sole_3, left_3)

    (sole_3, wide), (_, narrow) = lying(along_3), lying(up_3)
    if known and wide > 2 * narrow + thick:
        return sole_3, "flat on what is lowest of its shapes where the leg is upright"
    return up_3, "upright as the robot is at zero"


def _stands(leg: Leg, up_3: np.ndarray) -> bool:
    """Whether the ankle's limits let a foot whose sole faces away from up_3 stand below an upright shin."""
    if leg.ankle_at is None or not leg.chain[leg.ankle_at].hinge.limited:
        return True
    step, lines = leg.chain[leg.ankle_at], lines_of(leg.chain)
    lower, upper = float(step.hinge.lower or 0.0) - _BEYOND, float(step.hinge.upper or 0.0) + _BEYOND
    axis_3 = step.sign * step.hinge.line.axis_3
    if abs(float(axis_3 @ up_3)) > _FLAT:
        return False
    # The shin begins at the knee, or at the second one of its hinges.
    knee_at = next(
        i for i in reversed(range(leg.ankle_at)) if i == leg.knee_at or parallel(lines[i], lines[leg.ankle_at])
    )
    angle = straight_angle(axis_3, up_3, lines[knee_at].nearest(leg.ankle.point_3) - leg.ankle.point_3)
    return any(lower <= angle + turn <= upper for turn in (-math.tau, 0.0, math.tau))
