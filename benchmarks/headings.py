"""Whether it matters which way a person looks: motions turned about the upright axis, answered from a cold start.

    python benchmarks/headings.py [--robots g1] [--clips 16_15,02_06 | all | FOLDER] [--headings 36] [--seconds 2]

The beginning of each clip of `data/external/cmu/whole_body` is turned to so many headings all around, and each of them
is answered by itself, as a whole motion and as a stream. A row a robot, clip and way: the largest difference to the
answer of the clip as it is, over frames and headings, of joint angles, and of the base's place and rotation when they
are turned back; and at how many headings a joint is more than a degree off. Robots are shipped as
conf/ROBOT-whole-body.yaml.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Callable, Sequence

import torch
from common import beginning, print_header, print_table, read_options, whole_body_clips
from torch import Tensor

from mrhubo import rotation
from mrhubo.errors import InputWarning
from mrhubo.motion import Motion, read_motion
from mrhubo.reference import OptimizationRetargeter
from mrhubo.reference.result import OptimizationResult
from mrhubo.retargeter import RetargetResult
from mrhubo.robot import Robot
from mrhubo.streaming import Stream, StreamSettings

Answer = OptimizationResult | RetargetResult
Answers = Callable[[Sequence[Motion]], Sequence[Answer]]


def main(argv: list[str]) -> None:
    """Prints a table."""
    options, rest = read_options(argv, robots="g1", clips="all", headings="36", seconds="2")
    if rest:
        sys.exit(f"{rest[0]}: is unknown")
    torch.set_num_threads(1)
    print_header()
    turns = [2 * math.pi * k / int(options["headings"]) for k in range(int(options["headings"]))]
    rows = []
    for name in options["robots"].split(","):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", InputWarning)  # collision meshes that are not there
            optimiser = OptimizationRetargeter(Robot.from_config(f"conf/{name}-whole-body.yaml"))
        stream = Stream(optimiser, settings=StreamSettings(avoid_collisions=False))
        ways: dict[str, Answers] = {
            "motion": lambda asked, optimiser=optimiser: [optimiser(motion) for motion in asked],
            "stream": stream.retarget_all,
        }
        for path in whole_body_clips(options["clips"]):
            motion = read_motion(path)
            motion = beginning(motion, round(float(options["seconds"]) * motion.frame_rate))
            for way, answers in ways.items():
                found = answers([turned(motion, turn) for turn in turns])
                rows.append([name, motion.name, way, *differences(found, turns)])
    print_table(["robot", "clip", "way", "joints [deg]", "base [mm]", "base [deg]", "headings over 1 deg"], rows)


def turned(motion: Motion, turn: float) -> Motion:
    """A motion that is turned about the upright axis [rad]."""
    turn_33 = rotation.axis_angle_to_matrix(torch.tensor([0.0, turn, 0.0]))
    assert motion.root_rotation_T33 is not None and motion.root_position_T3 is not None
    return motion.changed(
        root_rotation_T33=turn_33 @ motion.root_rotation_T33, root_position_T3=motion.root_position_T3 @ turn_33.T
    )


def differences(found: Sequence[Answer], turns: Sequence[float]) -> list[str]:
    """Of answers to the first of them: joints, the base's place and its rotation, and headings that are far off."""
    back = [rotation.axis_angle_to_matrix(torch.tensor([0.0, 0.0, -turn])) for turn in turns]
    places, bases = zip(*(_turned_base(*pair) for pair in zip(found, back, strict=True)), strict=True)
    joints_H = torch.stack([torch.rad2deg((answer.q - found[0].q).abs().max()) for answer in found])
    place = max(float((place_T3 - places[0]).norm(dim=-1).max()) for place_T3 in places)
    turn = max(float(rotation.geodesic_distance(base_T33, bases[0]).max()) for base_T33 in bases)
    return [f"{float(joints_H.max()):.3f}", f"{1000 * place:.2f}", f"{math.degrees(turn):.3f}",
            f"{int((joints_H > 1).sum())} of {len(turns)}"]  # fmt: skip


def _turned_base(answer: Answer, back_33: Tensor) -> tuple[Tensor, Tensor]:
    assert answer.root_position is not None and answer.root_quaternion_wxyz is not None
    base_T33 = rotation.wxyz_to_matrix(answer.root_quaternion_wxyz)
    return answer.root_position @ back_33.T, back_33 @ base_T33


if __name__ == "__main__":
    main(sys.argv[1:])
