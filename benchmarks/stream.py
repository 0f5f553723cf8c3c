"""How long a frame takes, alone, and how the robot moves: networks, `retarget` and streams side by side.

    python benchmarks/stream.py PACKAGE [--motions data/motions] [--rate 60] [--noise 2] [--seconds 1]

PACKAGE is the folder of a trained retargeter. Times are medians of single frames on one thread: its own time, to which
other programs that run on the machine add little. The motions are told at
--rate frames a second; a straight hanging arm that is seen with --noise degrees of noise is added to them. Columns:
error of the limbs, its excess over each frame's own optimum (`solve_frames`), jumps (steps over 0.5 rad per 1/24 s that
the human did not make), frames with a joint over the URDF's speed, the highest speed, jerk of the directions over the
human's, and by how many frames the robot lags (where the correlation of both speeds is highest).
"""

from __future__ import annotations

import argparse
import itertools
import math
import time
from collections.abc import Callable
from pathlib import Path

import torch
from common import print_header, print_table
from torch import Tensor

import mrhubo
from mrhubo import rotation
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.fast import FastStream
from mrhubo.fast.engines import forms_here
from mrhubo.motion import Motion, read_folder, resample
from mrhubo.reference import OptimizationRetargeter, direction_jerk
from mrhubo.reference.metrics import angle_between
from mrhubo.reference.retarget import count_jumps
from mrhubo.retargeter import Retargeter
from mrhubo.runtime.threads import use_threads
from mrhubo.streaming import Stream

_MOST_LAG = 8
_HANGING_DEG = 83.0
_HANGING_S = 8.0


def hanging(noise_deg: float, rate: float) -> Motion:
    """Both arms hang down straight for eight seconds, every joint seen with noise."""
    turns_TJ3 = torch.zeros(round(_HANGING_S * rate), len(POSED_JOINT_NAMES), 3)
    for side, sign in (("left", -1), ("right", 1)):
        turns_TJ3[:, POSED_JOINT_NAMES.index(f"{side}_shoulder"), 2] = sign * math.radians(_HANGING_DEG)
    noise_TJ3 = math.radians(noise_deg) * torch.randn(turns_TJ3.shape, generator=torch.Generator().manual_seed(0))
    local_TJ33 = rotation.axis_angle_to_matrix(turns_TJ3) @ rotation.axis_angle_to_matrix(noise_TJ3)
    return Motion(f"hanging, {noise_deg:g} degrees of noise", local_TJ33, rate)


def lag(robot_TD3: Tensor, human_TD3: Tensor) -> float:
    """By how many frames one motion is behind another, by the peak of a parabola through the best three."""
    robot, human = (directions.diff(dim=0).flatten(1) for directions in (robot_TD3, human_TD3))
    inner, lags = slice(_MOST_LAG, -_MOST_LAG), range(-_MOST_LAG, _MOST_LAG + 1)
    found = [float((robot[inner] * human.roll(n, dims=0)[inner]).sum()) for n in lags]
    best = min(max(found.index(max(found)), 1), len(found) - 2)
    before, peak, after = found[best - 1 : best + 2]
    bend = before - 2 * peak + after
    return lags[best] + ((before - after) / (2 * bend) if bend else 0.0)


def measures(retargeter: Retargeter, motion: Motion, q_TN: Tensor, best_T: Tensor) -> list[float]:
    """The columns, see above."""
    body_map = retargeter.body_map
    human_TD3 = body_map.human_directions(motion.local_TJ33)
    robot_TD3, columns = body_map.robot_directions(body_map.robot.forward(q_TN)), body_map.measured
    error_T = torch.rad2deg(angle_between(robot_TD3[:, columns], human_TD3[:, columns])).mean(dim=1)
    speed_TN = q_TN.diff(dim=0).abs() * motion.frame_rate
    jerk, human_jerk = (
        float(direction_jerk(directions[:, columns], motion.frame_rate).mean()) for directions in (robot_TD3, human_TD3)
    )
    return [
        float(error_T.mean()), float((error_T - best_T).mean()),
        count_jumps(retargeter.directions, q_TN, human_TD3, motion.frame_rate),
        float((speed_TN > body_map.robot.velocity_N).any(dim=1).float().mean()), float(speed_TN.max()),
        jerk / human_jerk if human_jerk else math.nan, lag(robot_TD3[:, columns], human_TD3[:, columns]),
    ]  # fmt: skip


def milliseconds(answer: Callable[[Tensor], object], poses: Tensor, seconds: float) -> str:
    """Median and 90th percentile of one frame's time."""
    taken: list[float] = []
    for pose in itertools.cycle(poses):
        start = time.thread_time()
        answer(pose)
        taken.append(time.thread_time() - start)
        if sum(taken) > seconds and len(taken) > 10:
            break
    taken = sorted(taken[3:])
    return f"{1e3 * taken[len(taken) // 2]:.2f} ({1e3 * taken[int(0.9 * len(taken))]:.2f})"


@torch.no_grad()
def main(argv: list[str] | None = None) -> None:
    """Prints two tables."""
    parser = argparse.ArgumentParser(description="What a stream costs and how the robot moves.")
    parser.add_argument("package", type=Path, help="folder of a trained retargeter")
    parser.add_argument("--motions", type=Path, default=Path("data/motions"), help="default: %(default)s")
    parser.add_argument("--rate", type=float, default=60.0, help="frames a second (default: %(default)s)")
    parser.add_argument("--noise", type=float, default=2.0, help="degrees (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=1.0, help="for each time (default: %(default)s)")
    given = parser.parse_args(argv)
    print_header()
    retargeter = Retargeter.load(given.package)
    motions = [resample(motion, given.rate) for motion in read_folder(given.motions)]
    stream = Stream(retargeter, given.rate)
    poses = torch.cat([motion.local_TJ33 for motion in motions])
    ways: dict[str, Callable[[Tensor], object]] = {
        "networks (`predict`)": lambda pose: retargeter.predict(pose[None]),
        "`retarget`": lambda pose: retargeter.retarget(pose[None]),
        "stream, all of the answer": stream,
        "stream, joint angles alone": stream.joints,
    }
    for form in forms_here():
        fast = FastStream(mrhubo.load_fast(given.package, form), given.rate)
        ways[f"`FastStream`, {form}, all of the answer"] = lambda pose, fast=fast: fast(pose.numpy())
        ways[f"`FastStream`, {form}, joint angles alone"] = lambda pose, fast=fast: fast.joints(pose.numpy())
    with use_threads(1):
        rows = [[name, milliseconds(answer, poses, given.seconds)] for name, answer in ways.items()]
    print_table(["a frame alone", "ms (90th percentile)"], rows)
    print()

    motions.append(hanging(given.noise, given.rate))
    reference = OptimizationRetargeter(retargeter.body_map)
    answers = {
        "networks": [retargeter.predict(motion) for motion in motions],
        "`retarget`": [retargeter.retarget(motion.local_TJ33).q for motion in motions],
        "stream": [result.q for result in stream.retarget_all(motions)],
    }
    form = "{:.2f} {:.2f} {:.0f} {:.1%} {:.1f} {:.2f} {:.2f}"
    rows = []
    for number, motion in enumerate(motions):
        best, _ = reference.solve_frames(motion.local_TJ33)
        best_T = retargeter.judge(best, motion.local_TJ33).direction_error_deg.mean(dim=1)
        for name, found in answers.items():
            cells = form.format(*measures(retargeter, motion, found[number], best_T)).split()
            rows.append([motion.name, name, *cells])
    heads = ["error [deg]", "excess [deg]", "jumps", "too fast", "fastest [rad/s]", "jerk", "lag [frames]"]
    print_table(["motion", "answers of", *heads], rows)


if __name__ == "__main__":
    main()
