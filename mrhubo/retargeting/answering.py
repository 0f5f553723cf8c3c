"""Who answers a motion: a package, or the optimiser for a robot that has none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mrhubo.motion import Motion
from mrhubo.reference import OptimizationRetargeter
from mrhubo.retargeter import Retargeter
from mrhubo.robot import Axis, BodyMap, Robot, robot_facts
from mrhubo.robot.bending import BendAxis
from mrhubo.robot_motion import RobotMotion


@dataclass(frozen=True)
class Answerer:
    """Something that makes a robot's motion of a human's."""

    described: str
    """What it is, a sentence."""
    answer: Callable[[Motion], RobotMotion]
    body_map: BodyMap

    @property
    def at_rest(self) -> RobotMotion:
        """A motion of one frame in which the robot stands still."""
        robot = self.body_map.robot
        return RobotMotion(robot.home()[None].cpu().numpy(), robot.joint_names, robot=robot_facts(robot, "", ""))

    @property
    def limb_names(self) -> tuple[str, ...]:
        """The directions of a robot motion that are of limbs, and not of a hand or the head."""
        limbs = {d.name for d in self.body_map.directions if not isinstance(d, Axis | BendAxis)}
        return tuple(name for name in self.body_map.measured_names if name in limbs)


def of_package(retargeter: Retargeter, avoid_collisions: bool = True) -> Answerer:
    """A package's networks and their steps of optimisation, each motion as a whole."""
    return Answerer(
        f"{retargeter.origin}: robot '{retargeter.body_map.robot.name}', {len(retargeter.joint_names)} joints",
        lambda motion: retargeter(motion, avoid_collisions=avoid_collisions).robot_motion,
        retargeter.body_map,
    )


def of_reference(robot: Robot, avoid_collisions: bool = True) -> Answerer:
    """The optimiser, which needs no training and takes longer."""
    reference = OptimizationRetargeter(robot)
    return Answerer(
        f"no package: the reference retargeter answers, by optimisation and without any training; robot '{robot.name}',"
        f" {len(robot.joint_names)} joints",
        lambda motion: reference(motion, avoid_collisions=avoid_collisions).robot_motion,
        reference.body_map,
    )
