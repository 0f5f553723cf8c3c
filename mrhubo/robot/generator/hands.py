"""Hands of random humanoids: none, a fixed palm, jaws that slide or turn, fingers that are driven or mimic."""

from __future__ import annotations

import numpy as np

from mrhubo.robot.generator.limbs import SIDES, Chance, limits
from mrhubo.robot.generator.plan import Plan, X, Z, mirrored

KINDS = ("none", "palm", "sliding jaws", "turning jaws", "one jaw", "fingers", "fingers", "mimicking fingers")


class HandShape:
    """What both hands have in common."""

    def __init__(self, chance: Chance, scale: float) -> None:
        self.scale = scale
        self.kind = chance.either(*KINDS)
        self.length = scale * chance.between(0.07, 0.12)
        """Of the palm."""
        self.fingers = chance.either(2, 3, 4)
        """Without the thumb."""
        self.phalanges = chance.either(1, 2, 3)
        self.pronated = chance.maybe(0.3)
        """Whether the palm faces back as the arm hangs, thumb inwards; else inwards, thumb forward."""
        self.thumb_opposes = chance.maybe(0.4)
        """Whether the thumb begins before the palm and not at its side."""

    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Where the left hand's thumb and palm point as the arm hangs."""
        thumb_3, palm_3 = X, np.array([0.0, -1.0, 0.0])
        return (palm_3, -thumb_3) if self.pronated else (thumb_3, palm_3)


def hand(chance: Chance, plan: Plan, wrist: int, wrist_3: np.ndarray, shape: HandShape, name: str) -> None:
    """A hand upon an arm's last body.

    Args:
        chance: what is random.
        plan: the robot.
        wrist: the arm's last body.
        wrist_3: where it begins, true side.
        shape: what both hands have in common.
        name: left or right.
    """
    side, scale = SIDES[name], shape.scale
    thumb_3, palm_3 = (mirrored(axis_3, side) for axis_3 in shape.axes())
    end_3 = wrist_3 - shape.length * Z
    plan.directions[f"{name}_fingers"] = (wrist, -Z)
    plan.directions[f"{name}_thumb"] = (wrist, thumb_3)
    if shape.kind == "none":
        return
    plan.solid(wrist, wrist_3, end_3, 0.02 * scale)
    if shape.kind == "palm":
        plan.fix(f"{name}_hand_palm", wrist, end_3)
        return
    if "jaw" in shape.kind:
        _jaws(plan, wrist, end_3, thumb_3, shape, name)
        return
    mimics = shape.kind == "mimicking fingers"
    if mimics:
        plan.join(f"{name}_hand_drive", wrist, wrist_3 - 0.3 * shape.length * Z, thumb_3, (0.0, 1.0))
    # Flexing about this axis by a positive angle closes a finger towards the palm: a pointing-down finger goes to it.
    flex_3 = np.cross(-Z, palm_3)
    spread = 0.022 * scale
    for finger in range(shape.fingers):
        aside_3 = (finger - (shape.fingers - 1) / 2) * spread * thumb_3
        _finger(chance, plan, wrist, end_3 + aside_3, -Z, flex_3, shape, f"{name}_finger{finger}", mimics, side)
    base_3 = (
        wrist_3
        - 0.35 * shape.length * Z
        + (0.03 * scale * palm_3 if shape.thumb_opposes else 0.035 * scale * thumb_3 + 0.01 * scale * palm_3)
    )
    out_3 = -Z if shape.thumb_opposes else (thumb_3 - Z) / np.sqrt(2)
    thumb_flex_3 = np.cross(out_3, -palm_3) if shape.thumb_opposes else np.cross(out_3, palm_3)
    _finger(chance, plan, wrist, base_3, out_3, thumb_flex_3, shape, f"{name}_thumb", mimics, side)


def _finger(
    chance: Chance, plan: Plan, palm: int, base_3: np.ndarray, out_3: np.ndarray, flex_3: np.ndarray, shape: HandShape,
    role: str, mimics: bool, side: float,
) -> None:  # fmt: skip
    body, at_3 = palm, base_3
    name = role.split("_")[0]
    for phalanx in range(shape.phalanges):
        source = (f"{name}_hand_drive", 1.0) if mimics else None
        body = plan.join(f"{role}_{phalanx}", body, at_3, flex_3, limits(0.0, 1.5, 1.0), mimics=source)
        plan.solid(body, at_3, at_3 + 0.03 * shape.scale * out_3, 0.006 * shape.scale)
        at_3 = at_3 + 0.03 * shape.scale * out_3


def _jaws(plan: Plan, wrist: int, end_3: np.ndarray, thumb_3: np.ndarray, shape: HandShape, name: str) -> None:
    open_3 = 0.02 * shape.scale
    axis_3 = np.cross(Z, thumb_3)
    if shape.kind == "sliding jaws":
        first = plan.join(
            f"{name}_jaw_a", wrist, end_3 + open_3 * thumb_3, thumb_3, (0.0, 0.04 * shape.scale), "prismatic"
        )
        second = plan.join(
            f"{name}_jaw_b", wrist, end_3 - open_3 * thumb_3, -thumb_3, (0.0, 0.04 * shape.scale), "prismatic",
            mimics=(f"{name}_jaw_a", 1.0),
        )  # fmt: skip
        jaws = [(first, 1.0), (second, -1.0)]
    elif shape.kind == "turning jaws":
        first = plan.join(f"{name}_jaw_a", wrist, end_3 + open_3 * thumb_3, axis_3, (-0.2, 0.8))
        second = plan.join(
            f"{name}_jaw_b", wrist, end_3 - open_3 * thumb_3, -axis_3, (-0.2, 0.8), mimics=(f"{name}_jaw_a", 1.0)
        )
        jaws = [(first, 1.0), (second, -1.0)]
    else:
        jaws = [(plan.join(f"{name}_jaw", wrist, end_3 + open_3 * thumb_3, axis_3, (-0.4, 1.2)), 1.0)]
    for jaw, sign in jaws:
        start_3 = end_3 + sign * open_3 * thumb_3
        plan.solid(jaw, start_3, start_3 - 0.06 * shape.scale * Z, 0.008 * shape.scale)
