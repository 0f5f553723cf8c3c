"""Which joints of a robot move with a person, which are held, which are no part of a body, and why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mrhubo.robot.discovery.arm import Arm
from mrhubo.robot.discovery.bodies import Bodies, Chain, Hinge, Step, lines_of
from mrhubo.robot.discovery.facing import Heading
from mrhubo.robot.discovery.hand import Hand
from mrhubo.robot.discovery.leg import Leg
from mrhubo.robot.discovery.lines import PARALLEL, sine
from mrhubo.robot.discovery.ranges import driver
from mrhubo.robot.discovery.roles import Roles
from mrhubo.robot.joint import drive

_STILL = 0.02
"""By how much of a joint's angle a chain may turn that is meant not to: what rounded multipliers leave."""


@dataclass(frozen=True)
class Limbs:
    """Limbs and trunk of a robot, with their roles."""

    bodies: Bodies
    roles: Roles
    heading: Heading
    arms: Mapping[str, Arm]
    """By side, as legs and hands."""
    legs: Mapping[str, Leg]
    hands: Mapping[str, Hand]
    whole_body: bool
    """Whether legs and waist move too."""

    @cached_property
    def chains(self) -> dict[str, Chain]:
        """From the body outwards, and from the pelvis to the chest."""
        chains: dict[str, Chain] = {f"{side}_arm": arm.chain for side, arm in self.arms.items()}
        chains |= {f"{side}_leg": leg.chain for side, leg in self.legs.items()}
        return chains | {"neck": self.roles.neck, "waist": self.roles.waist}

    @cached_property
    def moving(self) -> dict[str, Chain]:
        """What of the chains moves."""
        found = {
            f"{side}_arm": arm.chain if side in self.hands else arm.chain[: arm.elbow_at + 1]
            for side, arm in self.arms.items()
        }
        if not self.whole_body:
            return found | {"neck": self.roles.neck}
        return {**self.chains, **found}

    @cached_property
    def moved(self) -> tuple[str, ...]:
        """The joints by which the limbs are driven, chain by chain."""
        found = [
            hinge.name
            for name in self.chains for step in self.moving.get(name, ())
            if (hinge := driver(self.bodies, step)) is not None and hinge.rotary
            and not self._turned_back(self.moving[name], hinge)
        ]  # fmt: skip
        return tuple(dict.fromkeys(found))

    def _turned_back(self, chain: Chain, hinge: Hinge) -> bool:
        """Whether what a joint turns of a chain is turned back by those that mimic it, as a column's parallelogram is,
        so that it only carries.
        """
        at = [i for i, step in enumerate(chain) if driver(self.bodies, step) is hinge]
        lines = lines_of(chain[at[0] : at[-1] + 1])
        if len(at) < 2 or any(sine(line.axis_3, lines[0].axis_3) > PARALLEL for line in lines):
            return False
        joints = self.bodies.description.joints
        net_3 = sum(chain[i].sign * drive(joints, chain[i].hinge.name).multiplier * lines[i - at[0]].axis_3 for i in at)
        return float(np.linalg.norm(net_3)) < _STILL

    def held(self, moved: tuple[str, ...]) -> Iterator[tuple[str, str]]:
        """The other joints of the chains, springs among them, and why they do not move."""
        for name, motor in self.bodies.springs.items():
            if motor in {step.hinge.name for chain in self.chains.values() for step in chain}:
                yield name, f"it turns about the axis of '{motor}', and less: a spring"
        for name, chain in self.chains.items():
            for step in (step for step in chain if step.hinge.name not in moved):
                yield step.hinge.name, self._why_held(name, step)

    def _why_held(self, name: str, step: Step) -> str:
        if not self.whole_body and name == "waist":
            return "it turns the chest against the base, and directions are seen from the chest"
        if not self.whole_body and name.endswith("_leg"):
            return "it belongs to a leg, and no direction of the table tells legs"
        part = name.split("_")[-1]
        what = f"it belongs to {'an arm' if part == 'arm' else f'the {part}' if part in ('waist', 'neck') else 'a leg'}"
        if not step.hinge.rotary:
            return f"{what}, but slides"
        if step.hinge.motor is not None:
            return f"{what}, and is moved by '{step.hinge.motor}'"
        return f"{what}, but {'turns nothing that can be told' if step.hinge.free else 'mimics another joint'}"

    def left_out(self, used: set[str]) -> Iterator[tuple[str, str]]:
        """All joints that are not among `used`, and why."""
        cut = {name: why for arm in self.arms.values() for name, why in arm.left_out}
        where = {}
        for side, arm in self.arms.items():
            where |= {
                h.name: f"beyond the {side} wrist: a finger or gripper" for h in self.bodies.beyond(arm.chain[-1])[1]
            }
        for side, leg in self.legs.items():
            where |= {h.name: f"beyond the {side} ankle" for h in self.bodies.beyond(leg.chain[-1])[1]}
        if self.roles.neck:
            where |= {h.name: "on the head: an eye, jaw or antenna" for h in self.bodies.beyond(self.roles.neck[-1])[1]}
        for hinge in self.bodies.hinges:
            if hinge.name in used:
                continue
            why = cut.get(hinge.name) or where.get(hinge.name)
            if why is None:
                why = "it mimics another joint" if not hinge.free else "on no limb: a base, wheel, sensor or linkage"
            yield hinge.name, why

    def key_links(self) -> tuple[str, ...]:
        """The links that the moving limbs carry."""
        steps = [step for arm in self.arms.values() for step in arm.chain]
        links = [step.outer_link for step in (*steps, *self.roles.neck[-1:])]
        if self.whole_body:
            links += [step.outer_link for leg in self.legs.values() for step in leg.chain]
        return tuple(dict.fromkeys(links))
