"""A retargeter for a robot that nothing was trained for."""

from __future__ import annotations

import math

from mrhubo.body import BodyPrior
from mrhubo.retargeter.calibration import calibrate
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
    network, prior = UniversalJoints(body_map, open_network()), BodyPrior.open()
    retargeter = Retargeter(network, body_map, prior, None, math.nan)
    retargeter.origin = "the universal network of mrhubo, without training"
    retargeter.confidence = calibrate(retargeter)
    return retargeter
