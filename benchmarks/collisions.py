"""How often a robot touches itself, before and after answers give way, and what that costs.

    python benchmarks/collisions.py PACKAGE [--motions data/motions] [--rate 30] [--rounds 300] [--random 0]

PACKAGE is the folder of a trained retargeter. First a table over all frames of the folder's motions at --rate frames a
second: frames on their own, whole motions and streams, with `avoid_collisions` and without. Columns: frames that touch,
mean angle between the robot's limbs, hands and head and the human's, jumps (steps over 0.5 rad per 1/24 s that the
human did not make), steps with a joint over its speed, jerk of the directions over the human's. Then how long an answer
to one frame takes without PyTorch, by one thread's own time: means over frames that stay as they are and over frames
that give way, with `avoid_collisions` and without in turns; --random adds so many random human poses to these frames.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from common import print_header, print_table, read_options
from torch import Tensor

import mrhubo
from mrhubo.fast import FastRetargeter
from mrhubo.fast.engines import forms_here
from mrhubo.motion import Motion, read_folder, resample
from mrhubo.pairing.random_poses import random_poses
from mrhubo.reference import count_jumps, direction_error, direction_jerk
from mrhubo.retargeter import POLISH, Retargeter
from mrhubo.runtime.threads import use_threads
from mrhubo.streaming import Stream, StreamSettings


def ways(retargeter: Retargeter, avoid: bool) -> dict[str, Callable[[Motion], Tensor]]:
    """By name: joint angles (T, N) of a motion."""
    stream = Stream(retargeter, settings=StreamSettings(avoid_collisions=avoid))
    return {
        "frames": lambda m: retargeter.predict(m, POLISH, avoid_collisions=avoid),
        "whole motions": lambda m: retargeter.predict(m, POLISH, m.frame_rate, avoid_collisions=avoid),
        "streams": lambda m: stream.retarget(m).q,
    }


def figures(retargeter: Retargeter, motions: list[Motion], answers: list[Tensor]) -> list[str]:
    """A row of the first table."""
    body_map, robot = retargeter.body_map, retargeter.body_map.robot
    touched, error, jerk, human_jerk, jumps, fast, steps = 0.0, 0.0, 0.0, 0.0, 0, 0, 0
    for motion, q_TN in zip(motions, answers, strict=True):
        rate, human_TD3 = motion.frame_rate, body_map.human_directions(motion.local_TJ33)
        robot_TD3, measured = body_map.robot_directions(robot.forward(q_TN)), body_map.measured
        touched += float(body_map.collision.collides(q_TN).sum())
        error += float(direction_error(body_map, q_TN, motion.local_TJ33).mean(dim=1).sum())
        jerk += float(direction_jerk(robot_TD3[:, measured], rate).mean()) * len(motion)
        human_jerk += float(direction_jerk(human_TD3[:, measured], rate).mean()) * len(motion)
        jumps += count_jumps(retargeter.directions, q_TN, human_TD3, rate)
        fast += int((q_TN.double().diff(dim=0).abs() * rate > robot.velocity_N).any(dim=1).sum())
        steps += len(motion) - 1
    frames = sum(len(motion) for motion in motions)
    shares = [f"{100 * touched / frames:.2f}%", f"{error / frames:.2f}", f"{jumps}", f"{100 * fast / steps:.2f}%"]
    return [*shares, f"{jerk / human_jerk:.2f}"]


def microseconds(fast: FastRetargeter, poses: np.ndarray, rounds: int) -> tuple[float, float]:
    """Mean time of an answer without giving way, and with it."""
    taken = [0.0, 0.0]
    for avoid in (False, True):  # compiles, and fills the caches
        fast(poses[0], avoid_collisions=avoid)
    for number in range(rounds):
        for avoid in (False, True):
            start = time.thread_time_ns()
            fast(poses[number % len(poses)], avoid_collisions=avoid)
            taken[avoid] += time.thread_time_ns() - start
    return taken[0] / rounds / 1e3, taken[1] / rounds / 1e3


def main(argv: list[str]) -> None:
    """Prints the tables."""
    options, rest = read_options(argv, motions="data/motions", rate="30", rounds="300", random="0")
    if len(rest) != 1 or not Path(rest[0]).is_dir():
        sys.exit(
            "usage: python benchmarks/collisions.py [--motions FOLDER] [--rate HERTZ] [--rounds N] [--random N] PACKAGE"
        )
    print_header()
    retargeter = mrhubo.load(rest[0])
    motions = [resample(motion, float(options["rate"])) for motion in read_folder(Path(options["motions"]))]
    rows = []
    with torch.no_grad():
        for name in ways(retargeter, True):
            for avoid in (False, True):
                answers = [ways(retargeter, avoid)[name](motion) for motion in motions]
                rows.append([name, "yes" if avoid else "no", *figures(retargeter, motions, answers)])
    print_table(["answers of", "give way", "touch", "off [deg]", "jumps", "over limit", "jerk ratio"], rows)
    poses_TJ33 = torch.cat([motion.local_TJ33 for motion in motions]).float()[::7]
    generator, parts = torch.Generator().manual_seed(0), retargeter.body_map.keypoints.parts
    poses_TJ33 = torch.cat((poses_TJ33, random_poses(parts, int(options["random"]), generator).float()))
    q_TN = retargeter.predict(poses_TJ33, POLISH, avoid_collisions=False)
    close_T, rows = retargeter.avoidance.close(q_TN), []
    with use_threads(1):
        for form in forms_here():
            fast = FastRetargeter(retargeter.describe(), form)
            for name, chosen_T in (("stay", ~close_T), ("give way", close_T)):
                off, on = microseconds(fast, poses_TJ33[chosen_T].numpy(), int(options["rounds"]))
                rows.append([form, name, f"{off:,.0f}", f"{on:,.0f}", f"{on - off:,.1f}", f"{on / off:.3f}"])
    print()
    print_table(["form", "frames that", "without [us]", "with [us]", "more [us]", "ratio"], rows)


if __name__ == "__main__":
    main(sys.argv[1:])
