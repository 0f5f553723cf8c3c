"""What packages answer: arms, hands and head, seen from a chest that carries itself."""

from __future__ import annotations

from mrhubo.config import RobotConfig
from mrhubo.errors import UserError
from mrhubo.robot.keypoints import entry_names
from mrhubo.robot.parts import UPPER_BODY


def check_upper_body(config: RobotConfig) -> None:
    """Refuses a robot with more, for which there are no networks yet.

    Raises:
        UserError: names the entries.
    """
    more = [name for name in config.keypoints if name not in entry_names(UPPER_BODY)]
    if more:
        raise UserError(
            f"robot.keypoints.{more[0]}: pairs and networks are of arms, hands and head so far, and not of "
            f"{', '.join(more)}; leave these out, with the joints that they tell, or retarget without a package: "
            "mrhubo retarget --robot"
        )
