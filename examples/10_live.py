"""A robot follows a stream, inside limits of position, speed and acceleration, and goes to a sink of one's own.

    python examples/10_live.py PACKAGE [MOTION.npz] [SECONDS]

PACKAGE is the folder that `mrhubo fit` printed at its end. MOTION stands in for a camera, by default a wave of the
right hand. docs/live.md says what other sources there are, and what a sink for a real robot has to do.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from mrhubo.live import LiveConfig, LiveRobot, Output, ReplaySource, run

WAVE = Path(__file__).parents[1] / "data" / "motions" / "wave.npz"


class Printer:
    """A sink that tells what it was sent."""

    def open(self, robot: LiveRobot, config: LiveConfig) -> None:
        """Gets ready, before anything moves."""
        print(f"{len(robot.joint_names)} joints, {config.rate:g} times a second")
        self.fastest_N = np.zeros(len(robot.joint_names))

    def send(self, output: Output) -> None:
        """Takes the joint angles of a moment."""
        self.fastest_N = np.maximum(self.fastest_N, np.abs(output.velocity_N))
        if output.number % 60 == 1:
            seen = ", ".join(f"{part} {value:.2f}" for part, value in _named(output.confidence))
            print(f"{output.state:<10} {output.joint_names[0]} {output.q_N[0]:6.2f} rad; confidence: {seen}")

    def close(self) -> None:
        """The robot stands by now."""
        print(f"no joint turned faster than {self.fastest_N.max():.2f} rad/s")


def _named(confidence: Mapping[str, float]) -> list[tuple[str, float]]:
    return [(name.replace("_", " "), value) for name, value in confidence.items()]


def main(package: str, motion_file: str = str(WAVE), seconds: str = "4") -> None:
    """Some seconds of a session."""
    config = LiveConfig(ramp_time=1.0)
    session = run(
        LiveRobot.of_package(package, config), [ReplaySource.of_file(Path(motion_file))], [Printer()], config,
        float(seconds),
    )  # fmt: skip
    print(session.summary())


if __name__ == "__main__":
    if not 2 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
