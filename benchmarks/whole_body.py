"""Whole bodies: the optimiser's answers to clips with a root, on robots with legs, as whole motions and as streams.

    python benchmarks/whole_body.py [--robots g1] [--clips 16_15,02_06 | all | FOLDER] [--rate 60] [--collisions avoid]
        [--ways motion,stream,fast] [--root pelvis,chest,between] [--balance 0]
        [--picture FILE.png]

A table a robot and way, with a row a clip and the mean over clips: angles to the person by part, horizontal speed of
planted soles and the person's own, soles off the floor, what else is under it, the way gone, speeds of joints by their
limits, steps of more than 0.5 rad, CPU time. Clips are names of `data/external/cmu/whole_body`; robots are shipped as
conf/ROBOT-whole-body.yaml. Of a robot without feet, whose base stays where it is, there are angles, speeds, steps and
time alone. `--root`: a table for each `robot.root_follows`; `--balance`: `robot.balance`. The picture shows moments of
the first clip, the person above the robots.
"""

from __future__ import annotations

import dataclasses
import itertools
import statistics
import sys
import time
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import torch
from common import beginning, mean_of, most_of, print_header, print_table, read_options, whole_body_clips
from PIL.Image import Image

from mrhubo import rotation
from mrhubo.body import Skeleton
from mrhubo.config import load_config
from mrhubo.errors import InputWarning
from mrhubo.evaluation.whole_body import WholeBodyScore, score_whole_body
from mrhubo.fast import FastRetargeter, FastStream
from mrhubo.frames import human_to_world
from mrhubo.motion import Motion, read_motion, resample
from mrhubo.reference import OptimizationResult, OptimizationRetargeter
from mrhubo.reference.metrics import direction_error
from mrhubo.reference.standing import Legs, has_root, motion_root
from mrhubo.retargeter import RetargetResult, optimised
from mrhubo.robot import build_body_map
from mrhubo.robot_motion import RobotMotion
from mrhubo.robot_motion.motion import PER_FRAME
from mrhubo.streaming import Stream, StreamSettings
from mrhubo.view import Solids, human_figure
from mrhubo.view.camera import Camera
from mrhubo.view.painter import render
from mrhubo.view.pictures import Artist
from mrhubo.view.sheets import contact_sheet, save_png

Answer = OptimizationResult | RetargetResult | RobotMotion

_MOMENTS = 8
"""Of the picture."""
_PARTS = {"knee": "thigh", "ankle": "shin", "trunk": "chest", "foot": "feet", "elbow": "upper arm", "wrist": "forearm"}


def main(argv: list[str]) -> None:
    """Prints a table a robot."""
    options, rest = read_options(
        argv, robots="g1", clips="all", rate="", collisions="", ways="motion", root="pelvis", balance="0", picture=""
    )
    ways = options["ways"].split(",")
    if rest or not set(ways) <= set(_WAYS):
        sys.exit(f"{[*rest, *(way for way in ways if way not in _WAYS)][0]}: is unknown")
    torch.set_num_threads(1)
    print_header()
    rows_of_pictures: dict[str, list[Image]] = {}
    for name, root in itertools.product(options["robots"].split(","), options["root"].split(",")):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", InputWarning)  # collision meshes that are not there
            config = load_config(
                Path(f"conf/{name}-whole-body.yaml"),
                [f"robot.root_follows={root}", f"robot.balance={options['balance']}"],
            )
            retargeter = OptimizationRetargeter(build_body_map(config.robot))
        motions = [_motion(path, options["rate"]) for path in whole_body_clips(options["clips"])]
        if not retargeter.body_map.keypoints.standing:
            for way in ways:
                _print_without_feet(name, way, retargeter, motions, bool(options["collisions"]))
            continue
        if options["picture"]:
            rows_of_pictures.setdefault("person", _person(motions[0]))
            rows_of_pictures[name] = _robot(retargeter, motions[0])
        for way in ways:
            answers = _WAYS[way](retargeter, bool(options["collisions"]))
            answers(beginning(motions[0], 10))  # not timed
            found = [_measure(retargeter, motion, answers) for motion in motions]
            parts = [part for part in _PARTS if part in found[0][0].parts_deg]
            rows = [_row(motion.name, [score], parts) for motion, score in zip(motions, found, strict=True)]
            follows = "" if root == "pelvis" else f", whose root follows {root}"
            print(f"## {name}{follows}, as a {way}: {len(motions)} clips, {sum(map(len, motions)):,} frames\n")
            heads = ["chest, in the world [deg]", "slide, own [cm/s]", "over 1 cm/s", "sunk", "body sunk (max [cm])",
                     "floats (max [cm])", "height [cm]", "path [cm/m]", "heading [deg]", "speed", "jumps", "touches",
                     "ms a frame"]  # fmt: skip
            columns = ["clip", *(f"{_PARTS[part]} [deg]" for part in parts), *heads]
            print_table(columns, [*rows, _row("mean", found, parts)])
            print()
    if options["picture"]:
        seconds = [f"{second:.1f} s" for second in _moments(motions[0]) / motions[0].frame_rate]
        sheet = contact_sheet(list(rows_of_pictures.values()), seconds, list(rows_of_pictures), motions[0].description)
        print(f"picture: {save_png(sheet, options['picture'])}")


def _moments(motion: Motion) -> np.ndarray:
    return np.linspace(0.1, 0.9, _MOMENTS).round(2) * (len(motion) - 1) // 1


def _person(motion: Motion) -> list[Image]:
    skeleton, arrays = Skeleton(), motion.arrays
    assert arrays.root_rotation_T33 is not None and arrays.root_position_T3 is not None
    soles = skeleton.rest_points["left_heel"][1]
    figures = []
    for t in _moments(motion).astype(int):
        pose_44 = np.eye(4)
        pose_44[:3, :3] = human_to_world(human_to_world(arrays.root_rotation_T33[t]).T).T
        pose_44[:3, 3] = human_to_world(arrays.root_position_T3[t])
        figures.append(human_figure(motion.local_TJ33[t], skeleton).transformed(pose_44))
    return _pictures(figures, -float(soles))


def _robot(retargeter: OptimizationRetargeter, motion: Motion) -> list[Image]:
    robot, result = retargeter.body_map.robot, retargeter(motion, avoid_collisions=True)
    assert result.root_position is not None and result.root_quaternion_wxyz is not None
    base_T33 = rotation.wxyz_to_matrix(result.root_quaternion_wxyz)
    artist, figures = Artist(robot), []
    for t in _moments(motion).astype(int):
        pose_44 = np.eye(4)
        pose_44[:3, :3], pose_44[:3, 3] = base_T33[t].numpy(), result.root_position[t].numpy()
        figures.append(artist.robot_figure(result.q[t], scaled=False).transformed(pose_44))
    return _pictures(figures, float(np.ptp(figures[0].bounds()[:, 2])) / 2)


def _pictures(figures: list[Solids], middle: float) -> list[Image]:
    """Each figure seen from its left, with the floor at z = 0."""
    found = []
    for figure in figures:
        x, y, _ = figure.bounds().mean(axis=0)
        camera = Camera(60.0, 8.0, (float(x), float(y), middle), 1.75 * middle)
        found.append(render(figure, (170, 235), camera, ground=0.0))
    return found


def _motion(path: Path, rate: str) -> Motion:
    motion = read_motion(path)
    return resample(motion, float(rate)) if rate else motion


def _as_motion(retargeter: OptimizationRetargeter, avoid: bool) -> Callable[[Motion], Answer]:
    """All frames at once."""
    return lambda motion: retargeter(motion, avoid_collisions=avoid)


def _as_stream(retargeter: OptimizationRetargeter, avoid: bool) -> Callable[[Motion], Answer]:
    """One frame after the other."""
    return Stream(retargeter, settings=StreamSettings(avoid_collisions=avoid)).retarget


def _as_fast(retargeter: OptimizationRetargeter, avoid: bool) -> Callable[[Motion], Answer]:
    """The same without PyTorch, with the root's way as `Stream.retarget` has it."""
    fast = FastRetargeter(optimised(retargeter.body_map).describe())
    legs = Legs(retargeter.body_map)

    def answer(motion: Motion) -> RobotMotion:
        stream = FastStream(fast, motion.frame_rate, StreamSettings(avoid_collisions=avoid))
        local_TJ33 = motion.for_skeleton(retargeter.body_map.skeleton).local_TJ33
        roots = [None] * len(motion)
        if legs.has_feet and has_root(motion):
            roots = list(zip(*(part.numpy() for part in motion_root(motion, local_TJ33, legs)), strict=True))
        found = [stream(pose, root=root) for pose, root in zip(local_TJ33.numpy(), roots, strict=True)]
        columns = {name: [getattr(frame, name) for frame in found] for name in PER_FRAME}
        told = {name: np.stack(column) for name, column in columns.items() if column[0] is not None}
        return dataclasses.replace(found[0], frame_rate=motion.frame_rate, **told)

    return answer


_WAYS = {"motion": _as_motion, "stream": _as_stream, "fast": _as_fast}


def _measure(
    retargeter: OptimizationRetargeter, motion: Motion, answers: Callable[[Motion], Answer]
) -> tuple[WholeBodyScore, float, float]:
    """Measures, share of frames that touch, and milliseconds a frame."""
    start = time.process_time()
    result = answers(motion)
    seconds = time.process_time() - start
    assert result.root_position is not None and result.root_quaternion_wxyz is not None
    q_TN, place_T3, quaternion_T4 = map(torch.as_tensor, (result.q, result.root_position, result.root_quaternion_wxyz))
    base_T33 = rotation.wxyz_to_matrix(quaternion_T4)
    score = score_whole_body(retargeter.body_map, motion, q_TN, place_T3, base_T33)
    touches = float("nan") if result.collision is None else float(torch.as_tensor(result.collision).float().mean())
    return score, touches, 1000 * seconds / len(motion)


def _print_without_feet(
    name: str, way: str, retargeter: OptimizationRetargeter, motions: list[Motion], avoid: bool
) -> None:
    """The table of a robot with arms, head and waist alone."""
    body_map, answers = retargeter.body_map, _WAYS[way](retargeter, avoid)
    answers(beginning(motions[0], 10))  # not timed
    regions = {
        "chest": "chest_", "upper arm": "_elbow", "forearm": "_wrist", "hand": "_hand_", "head": "head_",
    }  # fmt: skip
    columns = {
        region: [i for i, direction in enumerate(body_map.measured_names) if word in direction]
        for region, word in regions.items()
    }
    columns = {region: found for region, found in columns.items() if found}
    rows: list[list[float]] = []
    for motion in motions:
        start = time.process_time()
        q_TN = torch.as_tensor(answers(motion).q)
        seconds = time.process_time() - start
        off_TD = direction_error(body_map, q_TN, motion.for_skeleton(body_map.skeleton).local_TJ33)
        change_TN = q_TN.diff(dim=0).abs() * motion.frame_rate
        rows.append([
            *(float(off_TD[:, found].mean()) for found in columns.values()),
            float((change_TN / body_map.robot.velocity_N).max()),
            float((change_TN / 24 > 0.5).any(dim=1).sum()),
            1000 * seconds / len(motion),
        ])  # fmt: skip
    print(f"## {name}, as a {way}: {len(motions)} clips, {sum(map(len, motions)):,} frames, no feet\n")
    means = [*np.mean(rows, axis=0)]
    means[-3:-1] = [max(row[-3] for row in rows), sum(row[-2] for row in rows)]
    print_table(
        ["clip", *(f"{region} [deg]" for region in columns), "speed", "jumps", "ms a frame"],
        [
            [clip, *(f"{angle:.1f}" for angle in row[:-3]), f"{row[-3]:.2f}", f"{row[-2]:.0f}", f"{row[-1]:.1f}"]
            for clip, row in zip([*(motion.name for motion in motions), "mean"], [*rows, means], strict=True)
        ],
    )
    print()


def _row(name: str, found: list[tuple[WholeBodyScore, float, float]], parts: list[str]) -> list[str]:
    scores = [score for score, *_ in found]
    mean, most = partial(mean_of, scores), partial(most_of, scores)

    touches = statistics.fmean(touches for _, touches, _ in found)
    return [
        name,
        *(f"{statistics.fmean(score.parts_deg[part] for score in scores):.1f}" for part in parts),
        f"{mean('chest_deg'):.1f}",
        f"{mean('slide_cm_s'):.1f}, {mean('human_slide_cm_s'):.1f}",
        f"{mean('sliding'):.0%}",
        f"{mean('sunk'):.1%} ({most('sunk_max_cm'):.1f})",
        f"{mean('body_sunk'):.1%} ({most('body_sunk_max_cm'):.1f})",
        f"{mean('floating'):.1%} ({most('floating_max_cm'):.1f})",
        f"{mean('height_cm'):.2f}",
        f"{mean('path_cm_m'):.1f}",
        f"{mean('heading_deg'):.1f}",
        f"{most('speed_max'):.2f}",
        f"{sum(score.jumps for score in scores):.0f}",
        "-" if touches != touches else f"{touches:.1%}",
        f"{statistics.fmean(ms for *_, ms in found):.1f}",
    ]


if __name__ == "__main__":
    main(sys.argv[1:])
