"""The settings of a live session: how a robot follows a person who is seen now."""

from __future__ import annotations

from dataclasses import dataclass

from mrhubo.config.fields import bounded, choice


@dataclass
class LiveConfig:
    """How a robot follows, and when it stops."""

    rate: float = bounded(60.0, 10.0, 1_000.0)
    """Joint angles that are sent per second."""
    acceleration: float = bounded(60.0, 0.1, 10_000.0)
    """Limit of every joint's acceleration, rad/s^2. It also limits speed: no joint turns faster than it can brake from
    within `stop_time`."""
    speed: float = bounded(1.0, 0.01, 1.0)
    """Limit of every joint's speed, as a share of that in the robot's description."""
    ramp_time: float = bounded(2.0, 0.0, 60.0)
    """Seconds over which speed rises to its limit after a start, and after every stop."""
    deadman: str = choice("auto", "auto", "held", "frames")
    """What says that the robot may move: `held`, a client's heartbeat that tells that its key or button is held;
    `frames`, the stream itself; `auto`, `held` where a source has a heartbeat, as WebSocket and UDP have, else
    `frames`."""
    heartbeat_timeout: float = bounded(0.1, 0.02, 0.19)
    """Seconds without a heartbeat, or without a frame where frames are the dead-man, after which the robot brakes."""
    stop_time: float = bounded(0.2, 0.05, 2.0)
    """Seconds from the last heartbeat until every joint stands still, at most. It has to be longer than
    `heartbeat_timeout` by three of the times between two sent angles."""
    doubt: str = choice("hold", "hold", "slow", "relax")
    """What arms, head or legs do while they are hardly seen: `hold`, they stay where they are; `slow`, they follow at a
    speed that falls with the confidence; `relax`, they are held for `relax_after`, and then go slowly to the rest
    pose."""
    doubt_below: float = bounded(0.5, 0.0, 1.0)
    """Confidence of the source under which a part is hardly seen, 0 to 1."""
    relax_after: float = bounded(1.0, 0.0, 600.0)
    """Seconds of doubt until `relax` begins."""
    relax_speed: float = bounded(0.5, 0.01, 10.0)
    """Speed of every joint on the way to the rest pose, rad/s at most."""
    unseen_after: float = bounded(0.3, 0.05, 60.0)
    """Seconds without a frame after which nobody is seen: all parts are then in doubt."""
    late: float = bounded(0.25, 0.02, 10.0)
    """Frames that come so many seconds later than the quickest came are left out and counted."""
    home: str = choice("hanging", "hanging", "zero")
    """Where the robot starts and rests: `hanging`, its answer to a person who stands and whose arms hang, or `zero`,
    the angles 0, or the nearest to it inside the limits. The robot has to stand there when the session starts."""
    avoid_collisions: bool = True
    """Whether answers in which the robot would touch itself give way."""
