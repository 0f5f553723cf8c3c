"""Draws a person and the robot side by side as a GIF.

    python examples/06_moving_picture.py PACKAGE [MOTION.npz] [OUT.gif] [FIRST] [SECONDS]

FIRST is the second of the motion at which the picture starts, by default 0; SECONDS is its length, by default 4.
The README's picture was made so, of NAO and CMU's clip 13_15 from second 1.5.
"""

from __future__ import annotations

import sys
from pathlib import Path

import mrhubo
from mrhubo.view import figure_animation, save_gif
from mrhubo.view.pictures import GIF_RATE, Artist

WAVE = Path(__file__).parents[1] / "data" / "motions" / "wave.npz"


def main(
    package: str, motion_file: str = str(WAVE), out: str = "robot.gif", first: float = 0.0, seconds: float = 4.0
) -> None:
    """Retargets the whole motion, draws a part of it."""
    retargeter = mrhubo.load(package)
    motion = mrhubo.read_motion(motion_file)
    q_TN = retargeter(motion).q
    artist = Artist(retargeter.body_map.robot, retargeter.body_map.skeleton)

    times = [first + i / GIF_RATE for i in range(round(seconds * GIF_RATE))]
    frames = [round(time * motion.frame_rate) for time in times if time * motion.frame_rate <= len(q_TN) - 1]
    people = [artist.human(motion.local_TJ33[frame]) for frame in frames]
    robots = [artist.robot_figure(q_TN[frame]) for frame in frames]
    pictures = figure_animation([people, robots], ["person", artist.robot.name], [""] * len(frames), (260, 330))
    save_gif(pictures, out, GIF_RATE)
    print(f"written: {out}, {len(frames)} pictures")


if __name__ == "__main__":
    if not 2 <= len(sys.argv) <= 6:
        sys.exit(__doc__)
    main(*sys.argv[1:4], *map(float, sys.argv[4:]))
