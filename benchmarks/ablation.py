"""What each part of whole motions on the floor brings: the same clips with one of them switched off.

    python benchmarks/ablation.py [--robots g1] [--clips 05_12,127_29,135_04,16_15,16_17,49_03 | all | FOLDER]
        [--rate 60] [--parts 0,5]

A table a robot, a row a part (docs/whole-body.md has their numbers; default: each), means over clips: the measures of
`benchmarks/whole_body.py`, the base's fastest turn from frame to frame, and the jerk of the legs' joints over that of
the whole. Clips are names of `data/external/cmu/whole_body`; robots are shipped as conf/ROBOT-whole-body.yaml.
"""

from __future__ import annotations

import statistics
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np
import torch
from common import mean_of, most_of, print_header, print_table, read_options, whole_body_clips

from mrhubo import rotation
from mrhubo.errors import InputWarning
from mrhubo.evaluation.whole_body import WholeBodyScore, score_whole_body
from mrhubo.motion import Motion, read_motion, resample
from mrhubo.reference import OptimizationRetargeter, retarget
from mrhubo.reference.standing import Legs, LowBody, human, stand
from mrhubo.reference.standing.carried import Carried
from mrhubo.reference.terms.soles import SoleTerm
from mrhubo.robot import Robot

_FAST = 1e3
"""Joints as fast as that [times what the URDF allows] have no limit of speed."""


def _on_path(
    on_path_TPX: np.ndarray,
    weight_TP: np.ndarray,
    phase_TP: np.ndarray,
    rate: float,
    place_KX: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """In place of `carry`: a root that stays on the person's path, and contacts where their points are on the mean."""
    if place_KX is None:
        contacts = range(int(phase_TP.max(initial=-1)) + 1)
        means = [on_path_TPX[phase_TP == contact].mean(axis=0) for contact in contacts]
        place_KX = np.reshape(means, (len(contacts), on_path_TPX.shape[-1]))
    return np.zeros((len(on_path_TPX), on_path_TPX.shape[-1])), place_KX


PARTS: dict[str, list[tuple[Any, str, Any]]] = {
    "nothing": [],
    "0. steady pelvis": [(retarget, "steady_root", lambda motion: motion)],
    "2. flat feet": [(retarget, "flatten", lambda target_TD3, steps, legs: target_TD3)],
    "3. the person's size": [(human, "root_scale", lambda *_: 1.0)],
    "4. planted feet carry the root": [(stand, "carry", _on_path)],
    "5. legs give way": [(stand, "ROUNDS", 0)],
    "6. legs give way again": [(stand, "ROUNDS", 1)],
    "6. no sole under the floor": [(Carried, "lift_T", property(lambda carried: np.zeros(len(carried.low_TP))))],
    "7. nothing else under the floor": [(LowBody, "near", lambda *_: False)],
}
"""What stands for a part that is switched off: names of modules and classes, and their values."""


def main(argv: list[str]) -> None:
    """Prints a table a robot."""
    clips = "05_12,127_29,135_04,16_15,16_17,49_03"
    options, rest = read_options(argv, robots="g1", clips=clips, rate="60", parts="")
    if rest:
        sys.exit(f"{rest[0]}: is unknown")
    torch.set_num_threads(1)
    print_header()
    motions = [resample(read_motion(path), float(options["rate"])) for path in whole_body_clips(options["clips"])]
    columns = ["without", "thigh [deg]", "shin [deg]", "feet [deg]", "slide, own [cm/s]", "sunk (max [cm])",
               "body sunk (max [cm])", "floats (max [cm])", "path [cm/m]", "speed", "base turns [deg a frame]",
               "legs' jerk"]  # fmt: skip
    for name in options["robots"].split(","):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", InputWarning)  # collision meshes that are not there
            robot = Robot.from_config(f"conf/{name}-whole-body.yaml")
            retargeter = OptimizationRetargeter(robot)
        found = {}
        for part, changes in PARTS.items():
            if changes and options["parts"] and part[0] not in options["parts"].split(","):
                continue
            with _switched(changes):
                found[part] = [_measure(retargeter, motion) for motion in motions]
        speed_N = robot.velocity_N.clone()
        robot.velocity_N.mul_(_FAST)
        found["limits of speed"] = [_measure(retargeter, motion, speed_N) for motion in motions]
        robot.velocity_N.copy_(speed_N)
        smooth = statistics.fmean(jerk for *_, jerk in found["nothing"])
        print(f"## {name}: {len(motions)} clips, {sum(map(len, motions)):,} frames\n")
        print_table(columns, [_row(part, measured, smooth) for part, measured in found.items()])
        print()


@contextmanager
def _switched(changes: list[tuple[Any, str, Any]]) -> Iterator[None]:
    """With a part switched off."""
    before = [getattr(module, name) for module, name, _ in changes]
    for module, name, value in changes:
        setattr(module, name, value)
    yield
    for (module, name, _), value in zip(changes, before, strict=True):
        setattr(module, name, value)


def _measure(
    retargeter: OptimizationRetargeter, motion: Motion, speed_N: torch.Tensor | None = None
) -> tuple[WholeBodyScore, float, float, float]:
    """Measures, the base's largest turn in a frame [deg], the fastest joint by its limit, and the legs' jerk [rad/s^3];
    `speed_N`: the limits, where the robot's are not.
    """
    result = retargeter(motion)
    assert result.root_position is not None and result.root_quaternion_wxyz is not None
    base_T33 = rotation.wxyz_to_matrix(result.root_quaternion_wxyz)
    body_map = retargeter.body_map
    score = score_whole_body(body_map, motion, result.q, result.root_position, base_T33)
    turned_T = torch.rad2deg(rotation.geodesic_distance(base_T33[1:], base_T33[:-1]))
    limit_N = body_map.robot.velocity_N if speed_N is None else speed_N
    speed = float((result.q.diff(dim=0).abs() * motion.frame_rate / limit_N).max())
    legs = sorted(set().union(*SoleTerm(Legs(body_map)).couplings()))
    jerk = result.q[:, legs].diff(n=3, dim=0) * motion.frame_rate**3
    return score, float(turned_T.max()), speed, float(jerk.square().mean().sqrt())


def _row(part: str, found: list[tuple[WholeBodyScore, float, float, float]], smooth: float) -> list[str]:
    scores = [score for score, *_ in found]
    mean, most = partial(mean_of, scores), partial(most_of, scores)

    angles = [statistics.fmean(score.parts_deg[joint] for score in scores) for joint in ("knee", "ankle", "foot")]
    return [
        part,
        *(f"{angle:.1f}" for angle in angles),
        f"{mean('slide_cm_s'):.1f}, {mean('human_slide_cm_s'):.1f}",
        f"{mean('sunk'):.1%} ({most('sunk_max_cm'):.1f})",
        f"{mean('body_sunk'):.1%} ({most('body_sunk_max_cm'):.1f})",
        f"{mean('floating'):.1%} ({most('floating_max_cm'):.1f})",
        f"{mean('path_cm_m'):.1f}",
        f"{max(speed for *_, speed, _ in found):.2f}",
        f"{max(turned for _, turned, *_ in found):.1f}",
        f"{statistics.fmean(jerk for *_, jerk in found) / smooth:.2f}",
    ]


if __name__ == "__main__":
    main(sys.argv[1:])
