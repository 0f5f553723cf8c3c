"""An output as ROS 2's trajectory_msgs/msg/JointTrajectory, for the bag and for who listens.

Its first point is where the robot is to be after a period, its second where it stands if it hears no more: a controller
that plays a trajectory to its end then brakes by itself, whatever becomes of this process.

The message: https://docs.ros.org/en/rolling/p/trajectory_msgs/msg/JointTrajectory.html
"""

from __future__ import annotations

from typing import Any

from mrhubo.live.output import Output

_SECOND = 1_000_000_000


def time_of(seconds: float) -> tuple[int, int]:
    """Seconds and nanoseconds."""
    return divmod(round(seconds * _SECOND), _SECOND)


def trajectory(output: Output, period: float, stamp: float) -> dict[str, Any]:
    """The message as nested dictionaries.

    Args:
        output: of this moment.
        period: between two of them [s].
        stamp: time in its header [s].
    """
    still = [0.0] * len(output.joint_names)
    points = [
        (output.q_N.tolist(), output.velocity_N.tolist(), period),
        (output.stop_N.tolist(), still, period + max(output.stop_in, period)),
    ]
    return {
        "header": {"stamp": stamped(stamp), "frame_id": ""},
        "joint_names": list(output.joint_names),
        "points": [
            {
                "positions": positions,
                "velocities": velocities,
                "accelerations": [],
                "effort": [],
                "time_from_start": stamped(after),
            }
            for positions, velocities, after in points
        ],
    }


def stamped(seconds: float) -> dict[str, int]:
    """As messages tell times."""
    sec, nanosec = time_of(seconds)
    return {"sec": sec, "nanosec": nanosec}
