"""A retargeter for a robot that nothing was trained for."""

from __future__ import annotations

import math

from mrhubo.body import BodyPrior
from mrhubo.retargeter.kept_confidence import calibrated
from mrhubo.retargeter.nearest import NearestJoints
from mrhubo.retargeter.networks import JointNetwork
from mrhubo.retargeter.package import Retargeter
from mrhubo.retargeter.universal import UniversalJoints
from mrhubo.robot import BodyMap, Robot
from mrhubo.universal.weights import open_network


def untrained(robot: Robot | BodyMap) -> Retargeter:
    """A robot's retargeter with the universal network (docs/universal.md) in place of trained ones; made in seconds.

    Its confidence is calibrated as that of a trained one is. It has no pairs and no config, so it is not saved; a fit
    with `model.start: universal` makes a package.

    Args:
        robot: which knows its body parts: `Robot.from_config`, or `Robot.from_urdf` with `keypoints`.

    Raises:
        UserError: the robot's body parts make no sense.
    """
    body_map = robot if isinstance(robot, BodyMap) else BodyMap.of(robot)
    return _calibrated(
        UniversalJoints(body_map, open_network()), body_map, "the universal network of mrhubo, without training"
    )


def optimised(body_map: BodyMap) -> Retargeter:
    """A retargeter without any network, for streams of the optimiser: its answers come from the nearest of some
    thousand robot poses. Its confidence is calibrated as that of a trained one is.
    """
    return _calibrated(NearestJoints(body_map), body_map, "the optimiser of mrhubo")


def _calibrated(network: JointNetwork, body_map: BodyMap, origin: str) -> Retargeter:
    retargeter = Retargeter(network, body_map, BodyPrior.open(), None, math.nan)
    retargeter.origin = origin
    retargeter.confidence = calibrated(retargeter)
    return retargeter
