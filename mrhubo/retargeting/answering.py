"""Who answers a motion: a package, or, for a robot that has none, the universal network or the optimiser.

What needs PyTorch is imported where it is needed: most packages are answered without.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mrhubo.body.joints import SIDES
from mrhubo.errors import InputWarning
from mrhubo.fast.description import FILE, Description
from mrhubo.robot_motion import RobotFacts, RobotMotion

if TYPE_CHECKING:
    from mrhubo.motion import Motion
    from mrhubo.retargeter import Retargeter
    from mrhubo.robot import BodyMap, Robot


@dataclass(frozen=True)
class Answerer:
    """Something that makes a robot's motion of a human's."""

    described: str
    """What it is, a sentence."""
    answer: Callable[[Motion], RobotMotion]
    joint_names: tuple[str, ...]
    facts: RobotFacts
    """Of the robot, with the limits of its joints."""
    limb_names: tuple[str, ...]
    """The directions of a robot motion that are of limbs, and not of a hand or the head."""

    @property
    def at_rest(self) -> RobotMotion:
        """A motion of one frame in which the robot stands still."""
        home_N = np.clip(np.zeros(len(self.joint_names), np.float32), self.facts.lower, self.facts.upper)
        return RobotMotion(home_N[None], self.joint_names, robot=self.facts)


def of_package(source: str | os.PathLike[str], avoid_collisions: bool = True) -> Answerer:
    """A package's networks and their steps of optimisation, each motion as a whole; without PyTorch, but for a robot
    with feet.

    Args:
        source: as for `mrhubo.load`.
        avoid_collisions: as for `Retargeter.predict`.

    Raises:
        UserError: there is no such package, or it is damaged.
    """
    import mrhubo

    folder = mrhubo.package_folder(source)
    arrays = Description.read(folder) if (folder / FILE).is_file() else None
    if arrays is not None and arrays.settings.own_rest and not has_feet(arrays):
        said = _describe(folder, arrays.settings.robot, arrays.settings.joint_names)
        return _of_description(said, arrays, avoid_collisions)
    retargeter = mrhubo.load(folder)
    described = _describe(folder, retargeter.body_map.robot.name, retargeter.joint_names)
    return _of_retargeter(described, retargeter, avoid_collisions)


def has_feet(description: Description) -> bool:
    """Whether a retargeter's robot has feet: where its base goes, only PyTorch works out.

    By the names of its directions, for descriptions written before they held `legs` tell feet by nothing else.
    """
    names = description.settings.direction_names
    return any(f"{side}_foot_up" in names for side in SIDES)


def _of_retargeter(described: str, retargeter: Retargeter, avoid_collisions: bool) -> Answerer:
    return Answerer(
        described,
        lambda motion: retargeter(motion, avoid_collisions=avoid_collisions).robot_motion,
        retargeter.joint_names,
        retargeter.facts,
        _limb_names(retargeter.body_map),
    )


def _of_description(said: str, description: Description, avoid_collisions: bool) -> Answerer:
    """Without PyTorch."""
    from mrhubo.retargeting.forms import Forms

    forms, names = Forms(description, avoid_collisions), description.settings.direction_names
    measured = [d for d in description.trust.measured if description.kinematics.limb_D[d]]
    return Answerer(
        said,
        forms,
        forms.fast.joint_names,
        forms.fast.facts,
        tuple(names[d] for d in measured),
    )


def of_universal(robot: Robot, avoid_collisions: bool = True) -> Answerer:
    """The network that is the same for every robot, and steps of optimisation, each motion as a whole; no training."""
    from mrhubo.retargeter import untrained

    retargeter = untrained(robot)
    if (why := retargeter.collision.why_unknown()) is not None:
        warnings.warn(why, InputWarning, stacklevel=2)
    said = f"no package: the universal network answers, without any training; {_sized(robot)}"
    description = retargeter.describe()
    if has_feet(description) or not description.settings.own_rest:
        return _of_retargeter(said, retargeter, avoid_collisions)
    return _of_description(said, description, avoid_collisions)


def of_reference(robot: Robot, avoid_collisions: bool = True) -> Answerer:
    """The optimiser, which needs no training and takes longer."""
    from mrhubo.reference import OptimizationRetargeter
    from mrhubo.robot import robot_facts

    reference = OptimizationRetargeter(robot)
    if (why := reference.body_map.collision.why_unknown()) is not None:
        warnings.warn(why, InputWarning, stacklevel=2)
    return Answerer(
        f"no package: the reference retargeter answers, by optimisation and without any training; {_sized(robot)}",
        lambda motion: reference(motion, avoid_collisions=avoid_collisions).robot_motion,
        robot.joint_names,
        robot_facts(robot, "", ""),
        _limb_names(reference.body_map),
    )


def _sized(robot: Robot) -> str:
    return f"robot '{robot.name}', {len(robot.joint_names)} joints"


def _describe(folder: Path, robot: str, joint_names: tuple[str, ...]) -> str:
    return f"package {folder.resolve().name}: robot '{robot}', {len(joint_names)} joints"


def _limb_names(body_map: BodyMap) -> tuple[str, ...]:
    from mrhubo.robot import Axis
    from mrhubo.robot.bending import BendAxis

    limbs = {d.name for d in body_map.directions if not isinstance(d, Axis | BendAxis)}
    return tuple(name for name in body_map.measured_names if name in limbs)
